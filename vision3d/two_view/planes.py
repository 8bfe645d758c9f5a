"""A plane in two pictures: its homography, and the motions and normals that a homography may stand for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vision3d.camera import Array

__all__ = ["PlaneMotion", "decompose_homography", "plane_homography"]

TURN_ONLY = 1e-9


@dataclass(frozen=True, slots=True)
class PlaneMotion:
    """One reading of a homography H ~ R + t n'.

    Parameters
    ----------
    R : (3, 3) b_R_a
    t : (3,) b_t_a over the distance of the plane from camera a
    normal : (3,) unit, in a's frame, away from camera a: the plane is normal · x = distance
    """

    R: Array
    t: Array
    normal: Array


def plane_homography(R: Array, t: Array, normal: Array, distance: float = 1.0) -> Array:
    """H (3, 3) that takes rays of points of the plane normal · x = distance (a's frame) from a to b."""
    H: Array = np.asarray(R) + np.outer(t, normal) / distance
    return H


def decompose_homography(H: Array, rays_a: Array, rays_b: Array) -> tuple[PlaneMotion, ...]:
    """The motions of a homography of rays, b ~ H a, that have the plane in front of both cameras.

    Two, the usual ambiguity of a plane; one where the translation is along the normal; one with t = 0 where H
    is a rotation.  Those that put fewer of the pairs in front come last; those that put most behind are left
    out.

    Parameters
    ----------
    H : (3, 3) up to scale and sign
    rays_a, rays_b : (N, 3) pairs that agree with it

    Notes
    -----
    Ma, Soatto, Košecká, Sastry 2004, "An Invitation to 3-D Vision", section 5.3.3.
    """
    H = np.asarray(H, dtype=np.float64) / np.linalg.svd(H, compute_uv=False)[1]
    H = H if np.sum((rays_a @ H.T) * rays_b) >= 0.0 else -H
    values, vectors = np.linalg.eigh(H.T @ H)
    small, large = max(0.0, 1.0 - values[0]), max(0.0, values[2] - 1.0)
    if small + large < TURN_ONLY:
        return (PlaneMotion(_nearest_rotation(H), np.zeros(3), np.array([0.0, 0.0, 1.0])),)
    low, middle, high = vectors.T
    found: list[tuple[int, PlaneMotion]] = []
    for sign in (1.0, -1.0):
        # the two directions whose lengths H keeps, besides the middle one
        kept = (np.sqrt(small) * high + sign * np.sqrt(large) * low) / np.sqrt(small + large)
        normal = np.cross(middle, kept)
        R = np.column_stack([H @ middle, H @ kept, np.cross(H @ middle, H @ kept)]) @ np.array(
            [middle, kept, normal]
        )
        normal = normal if np.sum(rays_a @ normal) >= 0.0 else -normal
        reading = PlaneMotion(_nearest_rotation(R), (H - R) @ normal, normal)
        ahead = int(np.sum(rays_a @ normal > 0.0))
        if 2 * ahead >= len(rays_a) and not any(_same(reading, other) for _, other in found):
            found.append((ahead, reading))
    return tuple(reading for _, reading in sorted(found, key=lambda one: -one[0]))


def _nearest_rotation(R: Array) -> Array:
    U, _, Vt = np.linalg.svd(R)
    nearest: Array = U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    return nearest


def _same(one: PlaneMotion, other: PlaneMotion) -> bool:
    return float(np.abs(one.R - other.R).max() + np.abs(one.normal - other.normal).max()) < 1e-9
