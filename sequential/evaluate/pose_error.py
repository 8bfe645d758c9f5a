"""Absolute and relative pose error by evo's definitions: ATE and RPE."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ShapeError
from sequential.evaluate.trajectory import Trajectory
from sequential.manifold import quaternion_inverse, quaternion_log, quaternion_multiply, rotate

__all__ = ["PoseErrors", "ape", "rpe", "statistics"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


def statistics(values: Array) -> dict[str, float]:
    """`rmse mean median std min max sse` of errors (N,); `std` divides by N, as evo's does."""
    squared = float(np.sum(values**2))
    return {
        "rmse": float(np.sqrt(squared / len(values))),
        "mean": float(values.mean()),
        "median": float(np.median(values)),
        "std": float(values.std()),
        "min": float(values.min()),
        "max": float(values.max()),
        "sse": squared,
    }


@dataclass(frozen=True, slots=True, eq=False)
class PoseErrors:
    """Errors pose by pose, or pair by pair.

    `translation` (K,) m, `rotation` (K,) rad or None without rotations, `t` (K,) ns of the poses, or of the
    later pose of each pair.
    """

    t: Ints
    translation: Array
    rotation: Array | None

    def statistics(self, what: Literal["translation", "rotation"] = "translation") -> dict[str, float]:
        """`rmse mean median std min max sse` of the translation (m) or of the rotation angle (rad)."""
        values = self.translation if what == "translation" else self.rotation
        if values is None:
            raise DataError("the trajectories carry no rotations, so there is no rotation error")
        return statistics(values)


def _require_pairs(reference: Trajectory, estimate: Trajectory) -> None:
    if len(reference) != len(estimate) or not len(reference):
        raise ShapeError(
            f"errors are taken pose by pose: the reference has {len(reference)} poses, the estimate "
            f"{len(estimate)}; pair them with associate()"
        )


def ape(reference: Trajectory, estimate: Trajectory) -> PoseErrors:
    """Absolute pose error, E_i = Q_i⁻¹ P_i: distance of the positions, angle of the rotation.

    Nothing is aligned here: see `align`.  Kümmerle et al. 2009, "On measuring the accuracy of SLAM".

    Raises
    ------
    ShapeError
        if the trajectories do not have the same number of poses.
    """
    _require_pairs(reference, estimate)
    translation = np.linalg.norm(estimate.position - reference.position, axis=1)
    rotation = None
    if reference.quaternion is not None and estimate.quaternion is not None:
        rotation = _angle(_between(reference.quaternion, estimate.quaternion))
    return PoseErrors(estimate.t, translation, rotation)


def rpe(
    reference: Trajectory,
    estimate: Trajectory,
    delta: float = 1.0,
    unit: Literal["f", "m", "s"] = "f",
    *,
    all_pairs: bool = False,
    tolerance: float = 0.1,
) -> PoseErrors:
    """Relative pose error over steps of `delta`: E = (Q_i⁻¹ Q_j)⁻¹ (P_i⁻¹ P_j).

    Parameters
    ----------
    delta, unit : length of a step in poses (`f`), metres of the estimated path (`m`) or seconds (`s`)
    all_pairs : a step from every pose, not only from where the last step ended
    tolerance : with `all_pairs`, metres and seconds may miss `delta` by this share of it

    Raises
    ------
    ShapeError, DataError

    Notes
    -----
    Sturm et al. 2012, "A benchmark for the evaluation of RGB-D SLAM systems", eq. 1.
    """
    _require_pairs(reference, estimate)
    if reference.quaternion is None or estimate.quaternion is None:
        raise DataError(
            "relative pose error needs rotations: a step is expressed in the frame of its first pose"
        )
    i, j = _pairs(estimate, delta, unit, all_pairs=all_pairs, tolerance=tolerance)
    true_p, true_q = _step(reference, i, j)
    step_p, step_q = _step(estimate, i, j)
    translation = np.linalg.norm(step_p - true_p, axis=1)
    return PoseErrors(estimate.t[j], translation, _angle(_between(true_q, step_q)))


def _between(a: Array, b: Array) -> Array:
    return quaternion_multiply(quaternion_inverse(a), b)


def _angle(quaternion: Array) -> Array:
    return np.asarray(np.linalg.norm(quaternion_log(quaternion), axis=-1))


def _step(trajectory: Trajectory, i: Ints, j: Ints) -> tuple[Array, Array]:
    """Translation (K, 3) and rotation (K, 4) from poses i to poses j, in the frame of poses i."""
    q = trajectory.quaternion
    if q is None:
        raise DataError("a step between poses needs rotations")
    p = trajectory.position
    return rotate(quaternion_inverse(q[i]), p[j] - p[i]), _between(q[i], q[j])


def _pairs(
    estimate: Trajectory, delta: float, unit: str, *, all_pairs: bool, tolerance: float
) -> tuple[Ints, Ints]:
    count = len(estimate)
    if unit not in {"f", "m", "s"} or not delta > 0 or (unit == "f" and delta != int(delta)):
        raise DataError(
            f"a step is a whole number of poses ('f'), or metres ('m') or seconds ('s') > 0; "
            f"got {delta} {unit!r}"
        )
    if unit == "f":
        k = int(delta)
        starts = np.arange(0, count - k, 1 if all_pairs else k)
        found = starts, starts + k
    else:
        # Seconds are counted in whole nanoseconds, so that ten steps of 0.1 s make one of 1 s.
        length = delta if unit == "m" else round(delta * 1e9)
        steps = (
            np.linalg.norm(np.diff(estimate.position, axis=0), axis=1) if unit == "m" else np.diff(estimate.t)
        )
        found = _nearest(steps, length, tolerance) if all_pairs else _one_after_the_other(steps, length)
    if not len(found[0]):
        raise DataError(f"no two of the {count} poses are {delta:g} {unit!r} apart; choose a smaller step")
    return found[0].astype(np.int64), found[1].astype(np.int64)


def _one_after_the_other(steps: NDArray[np.generic], delta: float) -> tuple[Ints, Ints]:
    """Pairs of poses between which the steps (N-1,) add up to delta or just over it."""
    ends, gone = [0], 0
    for k, step in enumerate(steps.tolist(), start=1):
        gone += step
        if gone >= delta:
            ends.append(k)
            gone = 0
    pairs = np.array(ends, dtype=np.int64)
    return pairs[:-1], pairs[1:]


def _nearest(steps: NDArray[np.generic], delta: float, tolerance: float) -> tuple[Ints, Ints]:
    """From every pose to the later one whose distance along the path is nearest to delta."""
    along = np.concatenate([[0.0], np.cumsum(steps, dtype=np.float64)])
    starts = np.arange(len(along) - 1)
    ends = np.array([i + 1 + int(np.argmin(np.abs(along[i + 1 :] - along[i] - delta))) for i in starts])
    fits = np.abs(along[ends] - along[starts] - delta) <= tolerance * delta
    return starts[fits], ends[fits]
