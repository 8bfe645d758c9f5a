"""Chordal initialisation: rotations as matrices by one linear solve, then positions by another.

Carlone, Tron, Daniilidis, Dellaert 2015, "Initialization techniques for 3D SLAM: a survey on rotation
estimation and its use in pose graph optimization", ICRA, section III-B; in the plane the same with 2x2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.manifold import SE2
from sequential.manifold.quaternion import quaternion_from_matrix, rotation_matrix
from sequential.slam.initial.lago import inverses, solve_blocks
from sequential.slam.initial.links import Links

__all__ = ["chordal_poses", "chordal_rotations", "positions_given"]

Array = NDArray[np.float64]


def rotations_of(links: Links, poses: Array) -> Array:
    """(N, 2, 2) or (N, 3, 3)."""
    if isinstance(links.manifold, SE2):
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        return np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)
    return rotation_matrix(poses[:, :4])


def chordal_rotations(links: Links, *, weighted: bool = False) -> Array:
    """Rotations (n, a, a): least squares of R_head = R_tail R_measured, then the nearest.

    Parameters
    ----------
    weighted : by the rotation's information (its trace over the axes), otherwise all alike, as GTSAM does
    """
    measured = rotations_of(links, links.z)
    a = measured.shape[-1]
    count = len(links.tail)
    # each row of R is a variable of its own in the same system: row_head = row_tail R_measured
    weight = np.ones(count)
    if weighted:
        turn = slice(2, 3) if a == 2 else slice(0, 3)
        weight = 1.0 / np.linalg.eigvalsh(links.cov[:, turn, turn]).mean(axis=1)
    information = weight[:, None, None] * np.eye(a)
    at_tail = -np.swapaxes(measured, 1, 2)
    at_head = np.tile(np.eye(a), (count, 1, 1))
    known = rotations_of(links, links.poses)
    rows = []
    for k in range(a):
        start = np.zeros((links.count, a))
        start[links.anchors] = known[:, k]
        rows.append(solve_blocks(links, at_tail, at_head, information, np.zeros((count, a)), start))
    return nearest_rotations(np.stack(rows, axis=1))


def nearest_rotations(matrices: Array) -> Array:
    """The rotations (n, a, a) nearest to matrices in the Frobenius norm, determinants 1."""
    u, _, vt = np.linalg.svd(matrices)
    sign = np.sign(np.linalg.det(u @ vt))
    u[..., -1] *= sign[:, None]
    return np.asarray(u @ vt)


def positions_given(links: Links, rotations: Array) -> Array:
    """Positions (n, axes), m: least squares given the rotations, which makes it linear."""
    at = slice(0, 2) if isinstance(links.manifold, SE2) else slice(3, 6)
    z = links.z[:, :2] if isinstance(links.manifold, SE2) else links.z[:, 4:]
    places = links.poses[:, :2] if isinstance(links.manifold, SE2) else links.poses[:, 4:]
    axes, tail = z.shape[1], rotations[links.tail]
    seen = tail @ rotations_of(links, links.z)  # world_R_head as measured: the chart's axes
    information = inverses(seen @ links.cov[:, at, at] @ np.swapaxes(seen, 1, 2))
    start = np.zeros((links.count, axes))
    start[links.anchors] = places
    eye = np.tile(np.eye(axes), (len(links.tail), 1, 1))
    return solve_blocks(links, -eye, eye, information, (tail @ z[..., None])[..., 0], start)


def chordal_poses(links: Links, *, weighted: bool = False) -> Array:
    """Poses (n, 3) or (n, 7)."""
    rotations = chordal_rotations(links, weighted=weighted)
    positions = positions_given(links, rotations)
    if isinstance(links.manifold, SE2):
        heading = np.arctan2(rotations[:, 1, 0], rotations[:, 0, 0])
        return np.column_stack([positions, heading])
    return np.column_stack([quaternion_from_matrix(rotations), positions])
