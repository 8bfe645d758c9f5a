"""Laying one trajectory over another: Umeyama's fit, or the first pose alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ShapeError
from sequential.evaluate.trajectory import Trajectory
from sequential.manifold import (
    quaternion_from_matrix,
    quaternion_inverse,
    quaternion_multiply,
    rotation_matrix,
)

__all__ = ["Alignment", "align", "umeyama"]

Array = NDArray[np.float64]
Method = Literal["se3", "sim3", "se2", "first_pose", "first_position"]


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """ref_p = scale · rotation @ est_p + translation."""

    rotation: Array
    translation: Array
    scale: float = 1.0

    def apply(self, trajectory: Trajectory) -> Trajectory:
        """Move a trajectory into the frame of the reference."""
        position = self.scale * trajectory.position @ self.rotation.T + self.translation
        quaternion = trajectory.quaternion
        if quaternion is not None:
            quaternion = quaternion_multiply(quaternion_from_matrix(self.rotation), quaternion)
        return Trajectory(trajectory.t, position, quaternion)


def umeyama(source: Array, target: Array, *, scale: bool = False) -> tuple[Array, Array, float]:
    """Rotation (m, m), translation (m,) and scale that bring `source` (N, m) nearest to `target` (N, m).

    Least squares in closed form (Umeyama 1991, IEEE PAMI 13(4), eq. 34-43).

    Raises
    ------
    ShapeError
        if the point sets differ in shape.
    DataError
        if the points do not fix the rotation: all at one place or, in space, on one line.
    """
    if source.shape != target.shape or source.ndim != 2:
        raise ShapeError(f"point sets must both be (N, m), got {source.shape} and {target.shape}")
    centre, goal = source.mean(axis=0), target.mean(axis=0)
    cross = (target - goal).T @ (source - centre) / len(source)
    left, size, right = np.linalg.svd(cross)
    if np.count_nonzero(size > np.finfo(np.float64).eps * max(1.0, float(size[0]))) < source.shape[1] - 1:
        raise DataError(
            f"the {len(source)} positions lie at one place or on one line and do not fix a rotation; "
            "align with 'first_pose' or 'first_position'"
        )
    mirror = np.ones(len(size))
    mirror[-1] = np.sign(np.linalg.det(left) * np.linalg.det(right))
    rotation = (left * mirror) @ right
    factor = float(size @ mirror / np.mean(np.sum((source - centre) ** 2, axis=1))) if scale else 1.0
    return rotation, goal - factor * rotation @ centre, factor


def align(reference: Trajectory, estimate: Trajectory, method: Method = "se3") -> Alignment:
    """Find what brings an estimate into the frame of the reference; pose k belongs to pose k.

    Parameters
    ----------
    method : `se3` (rotation and translation), `sim3` (scale as well), `se2` (translation and heading in the
        plane), `first_pose` (the first poses coincide), `first_position` (translation only)

    Raises
    ------
    ShapeError, DataError
    """
    if len(reference) != len(estimate) or not len(reference):
        raise ShapeError(
            f"alignment pairs pose with pose: the reference has {len(reference)}, "
            f"the estimate {len(estimate)}; pair them with associate()"
        )
    if method in {"se3", "sim3"}:
        return Alignment(*umeyama(estimate.position, reference.position, scale=method == "sim3"))
    if method == "se2":
        return _planar(reference.position, estimate.position)
    if method == "first_pose":
        return _first_pose(reference, estimate)
    if method == "first_position":
        return Alignment(np.eye(3), reference.position[0] - estimate.position[0])
    raise DataError(f"align with 'se3', 'sim3', 'se2', 'first_pose' or 'first_position', got {method!r}")


def _planar(reference: Array, estimate: Array) -> Alignment:
    flat, shift, _ = umeyama(estimate[:, :2], reference[:, :2])
    rotation = np.eye(3)
    rotation[:2, :2] = flat
    height = float(np.mean(reference[:, 2] - estimate[:, 2]))
    return Alignment(rotation, np.append(shift, height))


def _first_pose(reference: Trajectory, estimate: Trajectory) -> Alignment:
    if reference.quaternion is None or estimate.quaternion is None:
        raise DataError("aligning first poses needs rotations in both trajectories; use 'first_position'")
    turn = quaternion_multiply(reference.quaternion[0], quaternion_inverse(estimate.quaternion[0]))
    rotation = rotation_matrix(turn)
    return Alignment(rotation, reference.position[0] - rotation @ estimate.position[0])
