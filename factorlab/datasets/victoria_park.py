"""Victoria Park: a pick-up truck drives 4 km among trees that its laser sees, and comes back again and again.

Recorded in Sydney by Guivant and Nebot ("Optimization of the simultaneous localization and map-building
algorithm for real-time implementation", IEEE Trans. Robotics and Automation 2001).  The gtsam wheel carries
it as Kaess, Ranganathan and Dellaert prepared it for iSAM (IEEE Trans. Robotics 2008): odometry between 6969
poses and 3640 sightings of 151 trees, whose association is known.  That file has no truth and no GPS.

Poses and trees share one count in the file, as they came: here poses are x0 to x6968, trees l0 to l150.  A
sighting is a tree's place in the frame of the truck, with equal variances; the laser that made it measures
range and bearing, and so do the factors here, with the same covariance turned that way.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from factorlab.datasets.dataset import require_file
from factorlab.datasets.slam import SlamDataset
from factorlab.datasets.wheel import gtsam_data
from sequential.errors import DataError
from sequential.manifold import SE2, Vector
from sequential.model import Loss
from sequential.slam import Factors, SlamProblem
from sequential.slam.models import Between, LandmarkRangeBearing, Prior

__all__ = ["load_victoria_park"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

FILE = "victoria_park.txt"
FIRST_SIGMAS = (1e-3, 1e-3, 1e-3)  # m, m, rad: the first pose is the origin of the map
ODOMETRY_SCALE, SIGHTING_SCALE = 3.0, 0.3  # of the standard deviations, where the noise is fitted
LOSS = Loss("cauchy", 2.385)  # 95 % as good as least squares where the noise is Gaussian after all
# ODOMETRY from to x y theta, LANDMARK pose tree x y, and the upper triangle of a covariance
WORDS = {"ODOMETRY": 12, "LANDMARK": 8}


def load_victoria_park(
    data: Path | None = None, *, steps: int | None = None, fitted: bool = False
) -> list[SlamDataset]:
    """The recording as one problem.

    Parameters
    ----------
    data : folder of the file; by default the one in the gtsam wheel
    steps : only so many of the first poses
    fitted : take the noise that best predicts sightings which were kept back, instead of the file's: three
        times that of the odometry, 0.3 times that of the sightings, and a Cauchy loss for wrong associations

    Raises
    ------
    DataError
        for a missing file, or a line that says nothing known; its number is named.
    """
    folder = gtsam_data() if data is None else data
    remedy = "it comes with the gtsam wheel (pip install gtsam); data=… takes another folder"
    path = require_file(folder / FILE, "the dataset victoria_park", remedy)
    odometry, sightings = _read(path)
    problem, trees = _problem(odometry, sightings, steps)
    problem = _fitted(problem) if fitted else problem
    noise = "3 cm and 6 mrad a step, 0.19 m for a sighting, fitted to visits that were kept back"
    as_stated = "as the file states it: 1 cm and 2 mrad a step, 0.63 m for a sighting"
    driven = float(np.linalg.norm(odometry[: len(problem.factors[1]), 2:4], axis=1).sum())
    said = (
        f"{len(problem.factors[1]) + 1} poses over {driven / 1000:.1f} km, "
        f"{len(problem.factors[2])} sightings of {trees} trees"
    )
    return [
        SlamDataset(
            name="victoria_park",
            title="Victoria Park: a truck among trees",
            problem=problem,
            reference={"chi2_of_batch_from_zero_landmarks": 210_200.0},
            notes=(
                f"{said}, association as given",
                f"noise {noise if fitted else as_stated}",
                "no truth: revisits are the check (loop error), and trajectories are set against the batch",
            ),
            graph_options={"initial": "incremental"},
            default_estimators=("ekf_slam", "isam2", "isam2_final", "fixed_lag", "batch", "batch_robust"),
            isam_every=10,
        )
    ]


def _read(path: Path) -> tuple[Array, Array]:
    """Rows from, to, x, y, theta and six of a covariance; rows pose, tree, x, y and three of a covariance."""
    rows: dict[str, list[list[float]]] = {word: [] for word in WORDS}
    for number, line in enumerate(path.read_text().splitlines(), 1):
        words = line.split()
        if not words:
            continue
        try:
            values = [float(word) for word in words[1:]]
        except ValueError:
            values = []
        if len(words) != WORDS.get(words[0]) or not np.isfinite(values).all() or not values:
            msg = (
                f"{path.name} line {number}: expected ODOMETRY with 11 numbers or LANDMARK with 7, got "
                f"{line.strip()[:60]!r}; mend the line or take it out"
            )
            raise DataError(msg)
        rows[words[0]].append(values)
    for word, found in rows.items():
        if not found:
            msg = f"{path.name} has no line of {word}; the whole file is needed"
            raise DataError(msg)
    return np.array(rows["ODOMETRY"]), np.array(rows["LANDMARK"])


def _problem(odometry: Array, sightings: Array, steps: int | None) -> tuple[SlamProblem, int]:
    """The problem, and how many trees it has."""
    poses = np.concatenate([odometry[:1, 0], odometry[:, 1]]).astype(np.int64)
    if (odometry[:, 0].astype(np.int64) != poses[:-1]).any() or (np.diff(poses) <= 0).any():
        msg = f"{FILE}: each line of ODOMETRY starts from the pose before it; this file has a gap or a jump"
        raise DataError(msg)
    last = len(poses) if steps is None else min(steps, len(poses))
    from_pose = _numbered(sightings[:, 0], poses)
    sightings, from_pose = sightings[from_pose < last], from_pose[from_pose < last]
    trees, which = np.unique(sightings[:, 1], return_inverse=True)
    range_bearing, noise = _polar(sightings[:, 2:4], sightings[:, 4:7])
    first = Factors(Prior(SE2()), ("x",), [[0]], np.zeros((1, 3)), np.square(FIRST_SIGMAS), name="first pose")
    index = np.arange(last)
    driven = Factors(
        Between(SE2()),
        ("x", "x"),
        np.column_stack([index[:-1], index[1:]]),
        odometry[: last - 1, 2:5],
        _symmetric(odometry[: last - 1, 5:11]),
        name="odometry",
    )
    seen = Factors(
        LandmarkRangeBearing(),
        ("x", "l"),
        np.column_stack([from_pose, which]),
        range_bearing,
        noise,
        name="laser",
    )
    return SlamProblem({"x": SE2(), "l": Vector(2)}, (first, driven, seen)), len(trees)


def _fitted(problem: SlamProblem) -> SlamProblem:
    first, odometry, laser = problem.factors
    driven = replace(odometry, noise_cov=odometry.covs() * ODOMETRY_SCALE**2)
    seen = replace(laser, noise_cov=laser.covs() * SIGHTING_SCALE**2, loss=LOSS)
    return replace(problem, factors=(first, driven, seen))


def _numbered(named: Array, poses: Ints) -> Ints:
    """Places of named poses among all; `DataError` names one that is none."""
    at = np.searchsorted(poses, named).clip(0, len(poses) - 1)
    missing = poses[at] != named
    if missing.any():
        msg = f"{FILE}: a sighting is from pose {named[missing][0]:.0f}, which no line of ODOMETRY leads to"
        raise DataError(msg)
    return np.asarray(at, dtype=np.int64)


def _symmetric(upper: Array) -> Array:
    """(N, 3, 3) from upper triangles (N, 6)."""
    full = np.empty((len(upper), 3, 3))
    row, column = np.triu_indices(3)
    full[:, row, column] = full[:, column, row] = upper
    return full


def _polar(place: Array, upper: Array) -> tuple[Array, Array]:
    """Range and bearing (N, 2) of places (N, 2), and their covariance (N, 2, 2) from that of the places."""
    distance = np.linalg.norm(place, axis=1)
    along = place / distance[:, None]
    across = np.column_stack([-along[:, 1], along[:, 0]]) / distance[:, None]
    slope = np.stack([along, across], axis=1)
    cov = np.empty((len(place), 2, 2))
    cov[:, 0, 0], cov[:, 0, 1], cov[:, 1, 0], cov[:, 1, 1] = (
        upper[:, 0],
        upper[:, 1],
        upper[:, 1],
        upper[:, 2],
    )
    turned = slope @ cov @ np.swapaxes(slope, 1, 2)
    turned[:, 0, 1] = turned[:, 1, 0] = 0.5 * (turned[:, 0, 1] + turned[:, 1, 0])
    return np.column_stack([distance, np.arctan2(place[:, 1], place[:, 0])]), turned
