"""UTIAS MRCLAM, data set 7: small robots among coded posts, with odometry, a camera and Vicon truth.

Leung, Halpern, Barfoot, Liu, "The UTIAS multi-robot cooperative localization and mapping dataset", IJRR 2011.

What the recording calls range is the distance *along the camera's axis* (a barcode's height in pixels says
how deep it is, not how far), so it is divided by the cosine of the bearing here, at the door.  Innovations
say so without the truth: their log likelihood gains 2 500 and 9 600 for the two robots.  What is left, a few
per cent in range, wheel speed and turn rate, and where the camera sits, are states that do not move.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from factorlab.datasets.dataset import Dataset, Truth, require_file
from sequential.errors import DataError
from sequential.log import SensorLog, Stream, nanoseconds
from sequential.manifold import SE2, Product, Vector
from sequential.model import Gaussian, Loss, StateSpace
from sequential.models import RangeBearing, Unicycle
from sequential.noise import diagonal
from sequential.tuning import Knob

__all__ = ["load_mrclam"]

Array = NDArray[np.float64]

FOLDER = Path("robot") / "mrclam7"
ROBOTS = 5  # subjects 1 to 5 are robots, the others posts
TRUTH_GAP_S = 0.1  # farther than this from a Vicon sample a moment is not scored
HOLD_S = 0.5  # a pause of the odometry is filled with its last value at this interval
STATE = Product(pose=SE2(), odometry_scale=Vector(2), camera=SE2(), range_scale=Vector(1))
# pose (m, m, rad); speed and turn scale; camera (m, m, rad); range scale
PRIOR_SIGMAS = (0.02, 0.02, 0.02, 0.1, 0.1, 0.1, 0.1, 0.05, 0.1)
LOSS = Loss("cauchy", 2.385)  # 95 % as good as least squares where the noise is Gaussian after all
KNOBS = (
    Knob("along", 0.03, "m/√s"),
    Knob("across", 0.01, "m/√s"),
    Knob("heading", 0.06, "rad/√s"),
    Knob("range_sigma", 0.05, "m"),
    Knob("bearing_sigma", 0.02, "rad"),
)


class _Sightings(NamedTuple):
    stream: Stream
    of_robots: int
    repeats: int


def load_mrclam(data: Path | None, robot: int | None) -> list[Dataset]:
    """One dataset a robot; all sightings are used and Vicon scores the result."""
    folder = _folder(data)
    present = [r for r in range(1, ROBOTS + 1) if (folder / f"Robot{r}_Odometry.dat").is_file()]
    if robot is not None and robot not in present:
        msg = f"{folder} holds robots {', '.join(map(str, present)) or 'none'} of MRCLAM, not robot {robot}"
        raise DataError(msg)
    return [_load_robot(folder, r) for r in ([robot] if robot is not None else present)]


def _folder(data: Path | None) -> Path:
    root = os.environ.get("FACTORLAB_DATA")
    folder = data if data is not None else Path(root or "FACTORLAB_DATA") / FOLDER
    remedy = (
        f"set FACTORLAB_DATA to the folder that holds {FOLDER}, or give the folder itself with data=…; data "
        "set 7 of UTIAS MRCLAM is free at asrl.utias.utoronto.ca/datasets/mrclam"
    )
    require_file(folder / "Landmark_Groundtruth.dat", "the map of the dataset mrclam", remedy)
    return folder


def _load_robot(folder: Path, robot: int) -> Dataset:
    odometry = _table(folder, f"Robot{robot}_Odometry.dat")
    vicon = _table(folder, f"Robot{robot}_Groundtruth.dat")
    posts = _table(folder, "Landmark_Groundtruth.dat")
    stamps, heading = nanoseconds(vicon[:, 0]), np.unwrap(vicon[:, 3])
    truth = Truth(stamps, vicon[:, 1:3], heading, max_gap=TRUTH_GAP_S)
    wheels = Stream(nanoseconds(odometry[:, 0]), odometry[:, 1:3])
    start, stop = max(stamps[0], wheels.t[0]), min(stamps[-1], wheels.t[-1])
    seen = _sightings(folder, robot, posts[:, 0], (start, stop))
    log = SensorLog({"odometry": _held(wheels), "sighting": seen.stream}, f"mrclam robot {robot}")
    pose = [np.interp(start, stamps, column) for column in (vicon[:, 1], vicon[:, 2], heading)]
    mean = STATE.pack(
        pose=SE2().normalize(np.array(pose)), odometry_scale=np.zeros(2), camera=np.zeros(3), range_scale=0.0
    )

    def build(values: Mapping[str, float]) -> StateSpace:
        process = Unicycle(values["along"], values["across"], values["heading"], scale="odometry_scale")
        sensor = RangeBearing(
            posts[:, 1:3],
            [values["range_sigma"] ** 2, values["bearing_sigma"] ** 2],
            scale="range_scale",
            mount="camera",
            loss=LOSS,
        )
        prior, static = Gaussian(mean, diagonal(PRIOR_SIGMAS)), ("odometry_scale", "camera", "range_scale")
        return StateSpace(STATE, prior, process, {"sighting": sensor}, "odometry", int(start), static)

    return Dataset(
        name=f"mrclam-robot{robot}",
        title=f"MRCLAM 7, robot {robot}: a camera among known posts",
        log=log,
        model=build({knob.name: knob.initial for knob in KNOBS}),
        held_out=None,
        truth=truth,
        axes=2,
        knobs=KNOBS,
        build=build,
        notes=(
            f"{len(seen.stream)} sightings of {len(posts)} posts, all used",
            f"{seen.of_robots} sightings of other robots ignored, {seen.repeats} repeats dropped",
            "start: the first Vicon pose; nothing else of the truth is used, and nothing is aligned",
            "states beside the pose: scale of speed and turn rate, place of the camera, scale of its ranges",
            "successive sightings share errors: their noise is set wider than the innovations ask for",
        ),
        default_estimators=("ekf", "iekf", "ukf", "ekf_rts", "ieks", "batch"),
    )


def _table(folder: Path, name: str) -> Array:
    path = require_file(folder / name, "a file of the dataset mrclam", "copy the whole data set")
    return np.loadtxt(path, ndmin=2)


def _held(wheels: Stream) -> Stream:
    """Without repeats, and with the last value repeated through pauses, so that none counts as a gap."""
    wheels = wheels.select(~wheels.repeated())
    step = round(HOLD_S * 1e9)
    copies = np.ceil(np.diff(wheels.t) / step).astype(np.int64).clip(1, None)
    copies = np.append(copies, 1)
    first = np.repeat(np.arange(len(wheels)), copies)
    nth = np.arange(len(first)) - np.repeat(np.cumsum(copies) - copies, copies)
    return Stream(wheels.t[first] + nth * step, wheels.values[first], covers="after")


def _sightings(folder: Path, robot: int, posts: Array, span: tuple[int, int]) -> _Sightings:
    """Range and bearing with the row of the post that was seen, within the span of odometry and Vicon."""
    subject = {int(code): int(number) for number, code in _table(folder, "Barcodes.dat")}
    rows = {int(post): row for row, post in enumerate(posts)}
    read = _table(folder, f"Robot{robot}_Measurement.dat")
    t = nanoseconds(read[:, 0])
    who = np.array([subject.get(int(code), -1) for code in read[:, 1]])
    kept = np.isin(who, posts) & (t > span[0]) & (t <= span[1])
    bearing = read[kept, 3]
    values = np.column_stack([read[kept, 2] / np.cos(bearing), bearing])
    stream = Stream(t[kept], values, np.array([[rows[int(post)]] for post in who[kept]]))
    once = ~stream.repeated()
    of_robots = int(((who >= 1) & (who <= ROBOTS)).sum())
    return _Sightings(stream.select(once), of_robots, int((~once).sum()))
