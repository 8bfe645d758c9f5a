"""MRCLAM without its map: posts of unknown place, the first pose known, nothing aligned.

What the maker's calibration left over are variables that do not move: scales of speed and turn rate, where
the camera sits, scale of its ranges.  Two facts about the recording are taken from innovations, never from
the truth:

- what the odometry says happens `DELAY_S` later.  The likelihood of the sightings of both robots is highest
  there; a robot that turns at 0.4 rad/s would begin its map a tenth of a radian off without it.
- sightings that follow each other share most of their error (how a barcode is printed, lit and seen), and no
  estimator here knows that, so each is given a noise several times what it scatters by.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from factorlab.datasets.dataset import Dataset
from factorlab.datasets.mrclam import load_mrclam
from factorlab.datasets.slam import SlamDataset
from sequential.log import Stream
from sequential.manifold import SE2, Vector
from sequential.models import RangeBearing
from sequential.slam import Factors, SlamProblem
from sequential.slam.ekf import filtered_start
from sequential.slam.models import MountedRangeBearing, Prior, ScaledOdometry
from sequential.slam.wheel_steps import WheelNoise, nodes_at, wheel_steps

__all__ = ["load_mrclam_slam", "mrclam_problem"]

Array = NDArray[np.float64]

LONGEST_STEP_S = 0.5
DELAY_S = 0.23
WHEELS = WheelNoise(along=0.03, across=0.01, heading=0.06)
RANGE_SIGMA_M, BEARING_SIGMA = 0.15, 0.03
START_SIGMAS = (0.02, 0.02, 0.02)  # m, m, rad
KINDS = {"x": SE2(), "l": Vector(2), "s": Vector(2), "c": Vector(4)}
# known beforehand: scales of speed and turn rate; place of the camera (m, m, rad), scale of its ranges
LEFT_OVER = {"s": (0.1, 0.1), "c": (0.05, 0.05, 0.1, 0.05)}
NOTES = (
    (
        "nothing of the truth is used but the first Vicon pose, and nothing is aligned: an error of the "
        "heading in the first seconds, before the map stands, turns the whole map"
    ),
    (
        "variables beside poses and posts: scales of speed and turn rate, place of the camera, scale of its "
        "ranges"
    ),
    (
        f"odometry is taken to happen {DELAY_S} s after its stamp, where the innovations of both robots are "
        "likeliest"
    ),
    (
        f"sightings are given {RANGE_SIGMA_M} m and {BEARING_SIGMA} rad, several times what they scatter by, "
        "because successive ones share their errors"
    ),
)


def load_mrclam_slam(
    data: Path | None = None, robot: int | None = None, *, hidden: bool = False
) -> list[SlamDataset]:
    """One problem a robot.

    Parameters
    ----------
    data : folder of the files, where it is not the usual one
    robot : only this one
    hidden : whether the barcodes are withheld, so that a filter has to say which post each sighting is of

    Raises
    ------
    DataError
        for missing files or a robot that is not there.
    """
    return [_dataset(known, hidden=hidden) for known in load_mrclam(data, robot)]


def _dataset(known: Dataset, *, hidden: bool) -> SlamDataset:
    sensor = known.model.sensors["sighting"]
    assert isinstance(sensor, RangeBearing)  # noqa: S101 - load_mrclam declares it
    posts = np.asarray(sensor.landmarks)
    problem = mrclam_problem(known, hidden=hidden)
    return SlamDataset(
        name=f"{known.name}-slam",
        title=f"{known.title.split(':')[0]}: a camera among posts of unknown place",
        problem=problem,
        truth=known.truth,
        landmarks={} if hidden else {int(i): posts[i] for i in problem.indices("l")},
        notes=NOTES,
        default_estimators=("ekf_slam", "fixed_lag", "batch", "batch_robust"),
        graph_options={"initial": filtered_start},
    )


def mrclam_problem(
    known: Dataset,
    *,
    hidden: bool = False,
    wheels: WheelNoise = WHEELS,
    sigmas: tuple[float, float] = (RANGE_SIGMA_M, BEARING_SIGMA),
    delay_s: float = DELAY_S,
) -> SlamProblem:
    """The recording of one robot as variables and measurements.

    Parameters
    ----------
    known : of `load_mrclam`; its posts are not looked at
    hidden : whether the barcodes are withheld
    wheels, sigmas, delay_s : noise of the odometry, of range (m) and bearing (rad), delay of the odometry
    """
    seen, told = known.log["sighting"], known.log["odometry"]
    start = int(known.model.start_ns or 0)
    nodes = nodes_at(seen.t, start, LONGEST_STEP_S)
    late = Stream(told.t + round(delay_s * 1e9), told.values)
    moves, covs = wheel_steps(late, nodes, wheels)
    k, at = np.arange(len(moves)), np.searchsorted(nodes, seen.t)
    post = np.asarray(seen.context)[:, 0].astype(np.int64)
    pose = np.asarray(known.model.prior.mean)[None, :3]
    zero = np.zeros_like(at)
    factors = (
        Factors(Prior(SE2()), ("x",), [[0]], pose, np.square(START_SIGMAS), name="start"),
        *(_left_over(kind, own) for kind, own in LEFT_OVER.items()),
        Factors(
            ScaledOdometry(), ("x", "x", "s"), np.stack([k, k + 1, 0 * k], 1), moves, covs, name="odometry"
        ),
        Factors(
            MountedRangeBearing(),
            ("x", "l", "c"),
            np.stack([at, post, zero], axis=1),
            seen.values,
            np.square(sigmas),
            name="sighting",
            unknown=1 if hidden else None,
        ),
    )
    return SlamProblem(KINDS, factors, t=nodes)


def _left_over(kind: str, sigmas: tuple[float, ...]) -> Factors:
    """What is known beforehand of a variable that calibration left over."""
    origin = np.zeros((1, len(sigmas)))
    return Factors(Prior(KINDS[kind]), (kind,), [[0]], origin, np.square(sigmas), name="left over")
