"""Plaza 1 and 2: a robotic mower with odometry and ranges to four radio beacons.

Djugash, Hamner, Roth, "Navigating with ranging radios: five data sets with ground truth", J. Field Robotics
2009.  The ranges read about 7 % too far.  Taken for an offset alone, this leaves an error of more than a
metre; with a scale beside the offset, a fifth of one.  Both are states here, and so is the heading at the
start: in Plaza 2 the recorded heading is half a turn away from the direction of motion, so it is used neither
for the start nor for a score.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.datasets.dataset import Dataset, Truth, require_file
from factorlab.datasets.wheel import gtsam_data
from sequential.log import SensorLog, Stream, nanoseconds
from sequential.manifold import SE2, Product, Vector
from sequential.model import Gaussian, Loss, StateSpace
from sequential.models import Range, Unicycle
from sequential.noise import diagonal
from sequential.tuning import Knob

__all__ = ["load_plaza"]

Array = NDArray[np.float64]

STATE = Product(pose=SE2(), range_bias=Vector(1), range_scale=Vector(1))
UNIFORM = float(np.pi / np.sqrt(3))  # rad, standard deviation of a heading of which nothing is known
# x, y (m), heading (rad), range bias (m), range scale
PRIOR_SIGMAS = (0.1, 0.1, UNIFORM, 1.0, 0.1)
LOSS = Loss("cauchy", 2.385)  # 95 % as good as least squares where the noise is Gaussian after all
# Fitted to the used ranges of both recordings together, by the likelihood of a filter's innovations.
KNOBS = (
    Knob("along", 0.07, "m/√s"),
    Knob("across", 0.03, "m/√s"),
    Knob("heading", 0.0015, "rad/√s"),
    Knob("slip", 0.01, "m/√m"),
    Knob("turn_slip", 0.003, "rad/√rad"),
    Knob("drift", 0.01, "rad/√m"),
    Knob("range_sigma", 0.55, "m"),
)


def load_plaza(number: int, data: Path | None) -> Dataset:
    """Plaza `number`, 1 or 2; all ranges are used and the truth scores the result."""
    recording = _read(number, data)
    odometry, ranges, repeats = _streams(recording)
    name = f"plaza{number}"
    log = SensorLog({"odometry": odometry, "range": ranges}, name)
    truth = Truth(nanoseconds(recording["GT"][:, 0]), recording["GT"][:, 1:3])
    beacons, start = recording["TL"][:, 1:3], int(truth.t[0])
    mean = STATE.pack(pose=[*truth.position[0], 0.0], range_bias=0.0, range_scale=0.0)

    def build(values: Mapping[str, float]) -> StateSpace:
        process = Unicycle(
            along=values["along"],
            across=values["across"],
            heading=values["heading"],
            slip=values["slip"],
            turn_slip=values["turn_slip"],
            drift=values["drift"],
        )
        sensor = Range(beacons, values["range_sigma"] ** 2, bias="range_bias", scale="range_scale", loss=LOSS)
        prior, static = Gaussian(mean, diagonal(PRIOR_SIGMAS)), ("range_bias", "range_scale")
        return StateSpace(STATE, prior, process, {"range": sensor}, "odometry", start, static)

    return Dataset(
        name=name,
        title=f"Plaza {number}: ranges to four known beacons",
        log=log,
        model=build({knob.name: knob.initial for knob in KNOBS}),
        held_out=None,
        truth=truth,
        axes=2,
        knobs=KNOBS,
        build=build,
        notes=(
            f"{len(ranges)} ranges, all used ({repeats} repeats dropped); scored against the recorded truth",
            "range offset and range scale are states: the radios read about 7 % too far",
            "the start position is the recording's; of the heading nothing is taken as known (0 ± π/√3)",
        ),
        default_estimators=("ekf", "iekf", "ukf", "ekf_rts", "ieks", "batch"),
    )


def _read(number: int, data: Path | None) -> dict[str, Any]:
    import scipy.io

    folder = gtsam_data() if data is None else data
    remedy = "it comes with the gtsam wheel (pip install gtsam); data=… takes another folder"
    path = require_file(folder / f"Plaza{number}_.mat", f"the dataset plaza{number}", remedy)
    return dict(scipy.io.loadmat(path))


def _streams(recording: Mapping[str, Any]) -> tuple[Stream, Stream, int]:
    """Odometry as (speed, turn rate) over the interval before each stamp; ranges with the beacon's row."""
    start, driven, measured = recording["GT"][0, 0], recording["DR"], recording["TD"]
    dt = np.diff(driven[:, 0], prepend=start)
    odometry = Stream(nanoseconds(driven[:, 0]), driven[:, 1:3] / dt[:, None], covers="before")
    order = np.argsort(measured[:, 0], kind="stable")
    known = measured[order]
    known = known[(known[:, 0] > start) & (known[:, 0] <= driven[-1, 0])]
    rows = {int(beacon): row for row, beacon in enumerate(recording["TL"][:, 0])}
    context = np.array([[rows[int(beacon)]] for beacon in known[:, 2]])
    ranges = Stream(nanoseconds(known[:, 0]), known[:, 3], context)
    once = ~ranges.repeated()
    return odometry, ranges.select(once), int((~once).sum())
