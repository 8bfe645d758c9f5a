"""Essential matrices and the motions they stand for: composition, the four candidates, cheirality, a chart.

A motion is a pose (7,) b_T_a whose translation has length one: what two pictures tell of b_T_a.  A point at
x_a is at x_b = R x_a + t, and its rays satisfy b' E a = 0 with E = [t]x R.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ShapeError
from sequential.manifold.quaternion import (
    quaternion_exp,
    quaternion_from_matrix,
    quaternion_inverse,
    quaternion_log,
    quaternion_multiply,
    quaternion_normalize,
    rotation_matrix,
)
from sequential.manifold.so3 import skew
from vision3d.camera import Array

__all__ = [
    "Recovered",
    "decompose_essential",
    "direction_basis",
    "essential_matrix",
    "local_motion",
    "motion",
    "ray_depths",
    "recover_pose",
    "retract_motion",
]


@dataclass(frozen=True, slots=True)
class Recovered:
    """The motion of an essential matrix that has the points in front of both cameras.

    Parameters
    ----------
    b_T_a : (7,) qw qx qy qz px py pz, translation of length one
    in_front : (N,) bool, pairs whose point is ahead along both rays
    votes : (4,) how many pairs each candidate of `decompose_essential` has in front
    """

    b_T_a: Array
    in_front: NDArray[np.bool_]
    votes: NDArray[np.int64]


def motion(R: Array, t: Array) -> Array:
    """The motion (7,) of a rotation matrix (3, 3) and a translation (3,) of any length but zero."""
    t = np.asarray(t, dtype=np.float64).reshape(3)
    return np.concatenate([quaternion_from_matrix(np.asarray(R, dtype=np.float64)), t / np.linalg.norm(t)])


def essential_matrix(b_T_a: Array) -> Array:
    """E = [t]x R (3, 3) of a pose (7,) b_T_a, with t of length one: singular values 1, 1, 0.

    Raises
    ------
    DataError
        where the translation is zero: two pictures from one place have no essential matrix.
    """
    b_T_a = np.asarray(b_T_a, dtype=np.float64)
    length = float(np.linalg.norm(b_T_a[4:]))
    if not length > 0.0:
        raise DataError(
            "two pictures from the same place have no essential matrix: the translation is zero; "
            "a camera that only turns is described by its rotation"
        )
    E: Array = skew(b_T_a[4:] / length) @ rotation_matrix(b_T_a[:4])
    return E


def decompose_essential(E: Array) -> Array:
    """The four motions (4, 7) with this essential matrix, up to its sign: R₁ t, R₁ -t, R₂ t, R₂ -t.

    R₁ and R₂ differ by half a turn about t, the twisted pair.  Hartley, Zisserman 2004, result 9.19.
    """
    E = np.asarray(E, dtype=np.float64)
    if E.shape != (3, 3):
        raise ShapeError(f"an essential matrix is (3, 3), got shape {E.shape}")
    U, _, Vt = np.linalg.svd(E)
    U, Vt = U * np.sign(np.linalg.det(U)), Vt * np.sign(np.linalg.det(Vt))
    W = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    return np.array([motion(U @ turn @ Vt, sign * U[:, 2]) for turn in (W, W.T) for sign in (1.0, -1.0)])


def ray_depths(b_T_a: Array, rays_a: Array, rays_b: Array) -> tuple[Array, Array]:
    """How far along rays (N, 3) the nearest points of each pair are, (N,) and (N,), in baselines.

    Infinite or of either sign where the rays are parallel.
    """
    turned = rays_a @ rotation_matrix(b_T_a[:4]).T
    t = b_T_a[4:]
    cosine = np.sum(turned * rays_b, axis=1)
    along_a, along_b = turned @ t, rays_b @ t
    # sin² from the cross product: one minus cosine² loses the small angles
    with np.errstate(divide="ignore", invalid="ignore"):
        sine2 = np.sum(np.cross(turned, rays_b) ** 2, axis=1)
        return (cosine * along_b - along_a) / sine2, (along_b - cosine * along_a) / sine2


def recover_pose(E: Array, rays_a: Array, rays_b: Array) -> Recovered:
    """Choose among the four motions of E the one with most points in front of both cameras.

    Parameters
    ----------
    E : (3, 3)
    rays_a, rays_b : (N, 3) unit rays, of pairs that agree with E

    Raises
    ------
    DataError
        where no candidate has a point in front: the pairs do not belong to E, or all rays are parallel.
    """
    candidates = decompose_essential(E)
    front = np.array(
        [np.min(ray_depths(one, rays_a, rays_b), axis=0, initial=np.inf) > 0.0 for one in candidates]
    )
    votes = front.sum(axis=1)
    best = int(np.argmax(votes))
    if votes[best] == 0:
        raise DataError(
            f"none of the {len(rays_a)} pairs lies in front of both cameras for any motion of this essential "
            "matrix; are they the pairs that agree with it?"
        )
    return Recovered(candidates[best], front[best], votes.astype(np.int64))


def direction_basis(t: Array) -> Array:
    """Two unit vectors (2, 3) across a unit vector t: the basis of GTSAM's Unit3, where steps of t live."""
    axis = np.eye(3)[int(np.argmin(np.abs(t)))]
    first = np.cross(t, axis)
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(t, first)])


def retract_motion(b_T_a: Array, step: Array) -> Array:
    """Move by a step (5,): R <- R Exp(step[:3]); t along the great circle in the basis's directions.

    The chart of GTSAM's EssentialMatrix, in which covariances of motions are given.
    """
    size = float(np.hypot(step[3], step[4]))
    across = step[3:] @ direction_basis(b_T_a[4:])
    t = np.cos(size) * b_T_a[4:] + np.sinc(size / np.pi) * across
    R = quaternion_normalize(quaternion_multiply(b_T_a[:4], quaternion_exp(step[:3])))
    return np.concatenate([R, t / np.linalg.norm(t)])


def local_motion(b_T_a: Array, other: Array) -> Array:
    """The step (5,) that takes one motion to another: `retract_motion` inverted."""
    turn = quaternion_log(quaternion_multiply(quaternion_inverse(b_T_a[:4]), other[:4]))
    across = direction_basis(b_T_a[4:]) @ other[4:]
    size = float(np.linalg.norm(across))
    angle = float(np.arctan2(size, b_T_a[4:] @ other[4:]))
    return np.concatenate([turn, across * (angle / size if size > 0.0 else 1.0)])
