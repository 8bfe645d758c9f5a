"""The firmware in figures: what C and Python differ by, how long an update takes, when frames leave."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from factorlab.report.attitude_figures import LOOKS
from factorlab.report.style import blank, legend_below, log_axis, thin

if TYPE_CHECKING:
    from factorlab.firmware.emulation import Emulation
    from factorlab.firmware.parity import Parity
    from factorlab.firmware.trial import Trial

__all__ = ["cycles", "differences", "from_model", "timing"]

Array = NDArray[np.float64]
BAR = {"color": "#444444", "linewidth": 0.8, "linestyle": (0, (4, 3))}
SMALLEST = 1e-7  # degrees that a logarithmic axis shows


def differences(parities: Sequence[Parity]) -> Figure | None:
    """Angle between C and Python over time, logarithmic: a panel a recording, 9-D and 6-D apart."""
    panels = list(dict.fromkeys((one.recording, one.magnetometer) for one in parities))
    if not panels:
        return None
    figure, axes = blank(1.0 + 2.4 * len(panels), len(panels), 1, sharex=False)
    for axis, panel in zip(axes[:, 0], panels, strict=True):
        for one in (one for one in parities if (one.recording, one.magnetometer) == panel):
            t, apart = _highest(one.seconds, one.apart)
            look = {**LOOKS[one.name], "linewidth": 1.1, "linestyle": "-" if not one.fixed else (0, (3, 1))}
            axis.plot(t, np.maximum(apart, SMALLEST), label=one.name, **look)
        axis.axhline(0.1, label="0.1°", **BAR)
        axis.set(ylabel="C - Python, °")
        axis.set_title(f"{panel[0]}, {'9-D' if panel[1] else '6-D'}")
        log_axis(axis)
    axes[-1, 0].set_xlabel("time, s")
    legend_below(figure, axes[-1, 0], columns=5)
    return figure


def from_model(trial: Trial) -> Figure | None:
    """Angle between the board and the Python filter over time."""
    if trial.apart is None:
        return None
    figure, axes = blank(2.6)
    t, apart = _highest(trial.board.seconds, trial.apart)
    axes[0, 0].plot(t, apart, color="#0072B2", linewidth=0.9)
    axes[0, 0].set(xlabel="time, s", ylabel="board - Python, °", ylim=(0.0, None))
    return figure


def cycles(emulation: Emulation, unit: str) -> Figure | None:
    """How often an update takes how long, and when the long ones were."""
    taken = emulation.update_cycles
    known = np.isfinite(taken)
    if not known.any():
        return None
    figure, axes = blank(3.0, 1, 2)
    _histogram(axes[0, 0], taken[known], f"{unit} of an update")
    seconds = 0.01 * np.arange(len(taken))
    t, highest = _highest(seconds[known], taken[known])
    axes[0, 1].plot(t, highest, color="#0072B2", linewidth=0.7)
    axes[0, 1].set(xlabel="time, s", ylabel=unit, ylim=(0.0, 1.1 * float(taken[known].max())))
    return figure


def timing(emulation: Emulation) -> Figure | None:
    """Latency of the first byte, and the period's departure from 10 ms."""
    latency, jitter = 1e6 * emulation.latency, 1e6 * emulation.jitter
    if not np.isfinite(latency).any():
        return None
    figure, axes = blank(3.0, 1, 2)
    _histogram(axes[0, 0], latency[np.isfinite(latency)], "from sample to first byte, µs")
    _histogram(axes[0, 1], jitter[np.isfinite(jitter)], "period of the frames less 10 ms, µs")
    return figure


def _histogram(axis: Axes, values: Array, label: str) -> None:
    """Counts on a logarithmic axis: the rare long ones are what matters."""
    span = float(np.ptp(values))
    bins = 60 if span > 0 else 1
    axis.hist(values, bins=bins, color="#0072B2", log=True)
    axis.set(xlabel=label, ylabel="samples")
    if span == 0:
        axis.set_title(f"always {values[0]:g}")


def _highest(t: NDArray[Any], values: NDArray[Any]) -> tuple[Array, Array]:
    """A long line made short: the largest value of each stretch."""
    edges = thin(len(t))
    return np.asarray(t[edges], np.float64), np.asarray(np.maximum.reduceat(values, edges), np.float64)
