"""How far off poses and landmarks are, and whether the estimate says so."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.compare.accuracy import TRUTH_BLOCK_S, Errors
from factorlab.compare.honesty import NormalisedError, normalised_error_of
from factorlab.datasets.dataset import Truth
from factorlab.datasets.slam import SlamDataset
from sequential.evaluate import umeyama
from sequential.history import Run
from sequential.manifold import SE2, rotation_matrix
from sequential.slam import SlamRun

__all__ = ["MapScore", "Scores", "map_score_of", "positions", "scores_of", "truth_of"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Scores:
    """Errors of a trajectory.

    Parameters
    ----------
    pose : errors of poses in the chart at the estimate (planar x, y, heading; spatial rotation, position),
        or of positions alone where the truth has no orientation
    error : (M, axes) of positions, world frame, m
    rotation : (M,) angle between estimated and true orientation, rad, or None
    honesty : of `pose`; None where there is no covariance, or the frame was aligned
    against : "truth", or the name of the estimate that stands in for it
    """

    t: Ints
    rows: Ints
    pose: Errors
    error: Array
    rotation: Array | None
    honesty: NormalisedError | None
    against: str

    @property
    def rmse(self) -> float:
        """Of positions, m."""
        return float(np.sqrt(np.mean(np.sum(self.error**2, axis=1))))

    @property
    def rotation_rmse(self) -> float | None:
        """Of orientations, rad."""
        return None if self.rotation is None else float(np.sqrt(np.mean(self.rotation**2)))

    def inside(self) -> tuple[float, ...]:
        """Share of the errors inside ±3σ, for each direction of `pose`."""
        three = 3 * np.sqrt(np.diagonal(self.pose.cov, axis1=1, axis2=2))
        return tuple(float(share) for share in np.mean(np.abs(self.pose.error) <= three, axis=0))


@dataclass(frozen=True, slots=True)
class MapScore:
    """Landmarks beside their true places: RMSE in m, mean normalised error over its freedom, how many."""

    rmse: float
    normalised: float | None
    count: int

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        return {"rmse_m": self.rmse, "nees_per_dof": self.normalised, "landmarks": self.count}


def positions(run: Run, axes: int) -> Array:
    """(K, axes) positions of planar or spatial poses."""
    start = 0 if isinstance(run.manifold, SE2) else 4
    return run.mean[:, start : start + axes]


def truth_of(run: Run) -> Truth:
    """A trajectory in the place of a truth, for problems that have none."""
    if isinstance(run.manifold, SE2):
        return Truth(run.t, run.mean[:, :2], np.unwrap(run.mean[:, 2]))
    return Truth(run.t, run.mean[:, 4:7], None, run.mean[:, :4])


def scores_of(dataset: SlamDataset, run: Run, stand_in: Run | None, seed: int, name: str) -> Scores | None:
    """Errors against the truth, or against a stand-in (`name`) where there is none; else None."""
    recorded = dataset.truth
    if recorded is None and stand_in is not None:
        recorded = truth_of(stand_in)
    if recorded is None:
        return None
    rows, truth = recorded.at(run.t)
    if not len(rows):
        return None
    against = "truth" if dataset.truth is not None else name
    moved = _aligned(dataset, run, rows, truth)
    error = positions(moved, dataset.axes)[rows] - truth.position[:, : dataset.axes]
    block = ((truth.t - truth.t[0]) * 1e-9 // TRUTH_BLOCK_S).astype(np.int64)
    pose = _pose_errors(dataset, moved, rows, truth, block)
    known = against == "truth" and dataset.aligned == "none" and np.isfinite(pose.cov).all()
    honesty = normalised_error_of(pose, np.random.default_rng(seed)) if known else None
    return Scores(truth.t, rows, pose, error, _turned(moved, rows, truth), honesty, against)


def _aligned(dataset: SlamDataset, run: Run, rows: Ints, truth: Truth) -> Run:
    """The run in the frame of the truth, moved as a whole where its own frame is arbitrary."""
    if dataset.aligned == "none":
        return run
    axes = dataset.axes
    rotation, shift, _ = umeyama(positions(run, axes)[rows], truth.position[:, :axes])
    if isinstance(run.manifold, SE2):
        heading = run.mean[:, 2] + np.arctan2(rotation[1, 0], rotation[0, 0])
        mean = run.manifold.normalize(np.column_stack([run.mean[:, :2] @ rotation.T + shift, heading]))
    else:
        from sequential.manifold import quaternion_from_matrix, quaternion_multiply

        turn = np.broadcast_to(quaternion_from_matrix(rotation), (len(run), 4))
        mean = np.hstack([quaternion_multiply(turn, run.mean[:, :4]), run.mean[:, 4:7] @ rotation.T + shift])
    return Run(run.t, mean, run.cov, run.manifold, run.innovations, run.log_likelihood, run.report)


def _pose_errors(dataset: SlamDataset, run: Run, rows: Ints, truth: Truth, block: Ints) -> Errors:
    """Pose errors where the truth has orientations, else position errors in the world."""
    target = _poses(truth, run)
    if target is not None:
        error = run.manifold.local(run.mean[rows], target)
        return Errors(truth.t, error, run.cov[rows], block, "truth", metres=False)
    axes = dataset.axes
    if isinstance(run.manifold, SE2):
        c, s = np.cos(run.mean[rows, 2]), np.sin(run.mean[rows, 2])
        turn = np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)
        body = run.cov[rows, :2, :2]
    else:
        turn, body = rotation_matrix(run.mean[rows, :4]), run.cov[rows, 3:6, 3:6]
    error = positions(run, axes)[rows] - truth.position[:, :axes]
    return Errors(truth.t, error, turn @ body @ np.swapaxes(turn, -1, -2), block, "truth", metres=True)


def _poses(truth: Truth, run: Run) -> Array | None:
    """The truth on the pose's manifold, or None where it has no orientation."""
    if isinstance(run.manifold, SE2):
        if truth.heading is None:
            return None
        return run.manifold.normalize(np.column_stack([truth.position[:, :2], truth.heading]))
    if truth.quaternion is None:
        return None
    return run.manifold.normalize(np.hstack([truth.quaternion, truth.position]))


def _turned(run: Run, rows: Ints, truth: Truth) -> Array | None:
    target = _poses(truth, run)
    if target is None:
        return None
    e = run.manifold.local(run.mean[rows], target)
    return np.abs(e[:, 2]) if isinstance(run.manifold, SE2) else np.linalg.norm(e[:, :3], axis=1)


def map_score_of(dataset: SlamDataset, run: SlamRun, kind: str = "l") -> MapScore | None:
    """Landmarks against their true places, where these are known; None where none is."""
    known = np.array(sorted(dataset.landmarks), dtype=np.int64)
    if dataset.aligned != "none" or not len(known) or kind not in run.values.index:
        return None
    known = known[run.values.has(kind, known)]
    if not len(known):
        return None
    error = run.values.at(kind, known) - np.stack([dataset.landmarks[int(k)] for k in known])
    rmse = float(np.sqrt(np.mean(np.sum(error**2, axis=1))))
    normalised = None
    if kind in run.covs:
        cov = run.covs[kind][np.searchsorted(run.values.index[kind], known)]
        if np.isfinite(cov).all():
            squared = np.einsum("ni,ni->n", error, np.linalg.solve(cov, error[..., None])[..., 0])
            normalised = float(squared.mean() / error.shape[1])
    return MapScore(rmse, normalised, len(known))
