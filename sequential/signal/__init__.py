"""Simple filters of one signal: mean, low-pass, median, outliers, and the blend of two sensors.

Each is a small frozen settings object with one verb: called on x, on t and x, or on a `Stream`, it returns
what it was given, filtered.  Each says what it costs (`response`: delay of a step, noise let through,
look-ahead), and can be stepped through sample by sample (`start`, `step`, `online`).

>>> from sequential.signal import SlidingMedian
>>> SlidingMedian(3)([1.0, 1.0, 9.0, 1.0, 1.0]).tolist()
[1.0, 1.0, 1.0, 1.0, 1.0]
>>> SlidingMedian(3).response().delay_90
1.0
"""

from sequential.signal.complementary import Complementary, ComplementaryState
from sequential.signal.hampel import SIGMA_PER_MAD, Hampel, LocalSpread
from sequential.signal.low_pass import LowPass, LowPassState
from sequential.signal.moving_mean import MovingMean
from sequential.signal.response import Response, measure_noise_gain, measure_step_delay
from sequential.signal.samples import SignalFilter
from sequential.signal.sliding_median import SlidingMedian
from sequential.signal.window import Edges, Windowed, WindowState

__all__ = [
    "SIGMA_PER_MAD",
    "Complementary",
    "ComplementaryState",
    "Edges",
    "Hampel",
    "LocalSpread",
    "LowPass",
    "LowPassState",
    "MovingMean",
    "Response",
    "SignalFilter",
    "SlidingMedian",
    "WindowState",
    "Windowed",
    "measure_noise_gain",
    "measure_step_delay",
]
