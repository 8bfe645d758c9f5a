"""A cart on a rail: odometry and a laser that looks at a post, one dimension, everything linear.

Barfoot, "State estimation for robotics" (course AER1513, University of Toronto), data set 1: 21 minutes at
10 Hz, truth by a motion-capture system.  The file states one variance for each sensor, as if their errors
were white.  They are not, and laser and odometry tell it of each other, without the truth: what the two say
was driven in a second differs by 22 mm as recorded, and by 6 mm when a speed is held from half an interval
before its stamp to half an interval after it, and the odometry is taken to count 6 % too far.  Both are
mended here, at the door.  What is left of the laser's error lasts for seconds, so it is a state.

The truth lags behind both sensors by 65 ms, 33 mm at the cart's full speed; it is moved earlier by as
much before it scores anything, which takes the laser's distance from it from 19 mm to 7.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from factorlab.datasets.dataset import Dataset, Truth, require_file
from sequential.log import SensorLog, Stream, nanoseconds
from sequential.manifold import Product, Vector
from sequential.model import Gaussian, StateSpace
from sequential.models import ContinuousProcess, GaussMarkov, Independent, LinearSensor
from sequential.noise import diagonal
from sequential.tuning import Knob

__all__ = ["load_rail"]

Array = NDArray[np.float64]

FILE = Path("robot") / "barfoot" / "dataset1.mat"
STATE = Product(position=Vector(1), offset=Vector(1))
TRUTH_LATE_S = 0.065  # the truth shows where the cart was so long before
ODOMETRY_SCALE = 0.943  # metres driven for each metre that the odometry counts
# Where the cart rests the laser is off by another 6 mm each time, which only the truth can tell.
OFFSET_SIGMA, OFFSET_TIME = 0.0064, 5.0  # m, s
# Fitted to the readings by the likelihood of a filter's innovations, with that offset as it is.
KNOBS = (Knob("walk", 0.0035, "m/√s"), Knob("laser_sigma", 0.00203, "m"))
ESTIMATORS = ("kf", "kf_rts", "ieks", "batch")


def load_rail(data: Path | None) -> Dataset:
    """All readings are used and the truth scores the result."""
    recording = _read(data)
    t, speed = recording["t"], recording["v"] * ODOMETRY_SCALE
    place = recording["l"][0] - recording["r"]
    half = 0.5 * float(np.median(np.diff(t)))
    odometry = Stream(nanoseconds(t + half), speed, covers="before")
    laser = Stream(nanoseconds(t), place)
    truth = Truth(nanoseconds(t - TRUTH_LATE_S), recording["x_true"][:, None])
    stated = tuple(float(recording[name][0]) ** 0.5 for name in ("r_var", "v_var"))

    stated_as = (
        f"the file states σ = {1e3 * stated[0]:.0f} mm (laser) and {1e3 * stated[1]:.0f} mm/s (odometry), "
        "both white; they are neither, so the noise here is this project's own"
    )

    def build(values: Mapping[str, float]) -> StateSpace:
        driven = ContinuousProcess([[0.0]], [[1.0]], values["walk"] ** 2, [[1.0]])
        process = Independent(position=driven, offset=GaussMarkov(OFFSET_TIME, OFFSET_SIGMA))
        prior = Gaussian(np.array([place[0], 0.0]), diagonal([0.02, OFFSET_SIGMA]))
        sensor = LinearSensor([[1.0, 1.0]], values["laser_sigma"] ** 2)
        return StateSpace(STATE, prior, process, {"laser": sensor}, "odometry", int(laser.t[0]))

    return Dataset(
        name="rail",
        title="Barfoot's rail: a laser at 10 Hz and odometry, one dimension",
        log=SensorLog({"odometry": odometry, "laser": laser}, "rail"),
        model=build({knob.name: knob.initial for knob in KNOBS}),
        held_out=None,
        truth=truth,
        axes=1,
        knobs=KNOBS,
        build=build,
        notes=(
            f"{len(laser)} readings of the laser, all used; scored against the recorded truth",
            "speeds held about their stamps and × 0.943: what laser and odometry say of each other",
            stated_as,
            "the truth lags behind both sensors by 65 ms and is moved earlier: as recorded, it is 19 mm off",
            "the laser's offset is a state; its size and duration (6 mm, 5 s) are set by the truth",
        ),
        default_estimators=ESTIMATORS,
    )


def _read(data: Path | None) -> dict[str, Array]:
    import scipy.io

    folder = Path(os.environ.get("FACTORLAB_DATA") or "FACTORLAB_DATA")
    path = folder / FILE if data is None else data / FILE.name
    remedy = (
        f"set FACTORLAB_DATA to the folder that holds {FILE}, or give the folder itself with data=…; it is "
        "data set 1 of T. Barfoot's course AER1513 at the University of Toronto"
    )
    require_file(path, "the dataset rail", remedy)
    return {name: np.ravel(v) for name, v in scipy.io.loadmat(path).items() if not name.startswith("__")}
