"""LAGO: headings of a planar pose graph by one linear solve, then poses by another.

Carlone, Aragues, Castellanos, Bona 2014, "A fast and accurate approximation for planar pose graph
optimization", IJRR 33(7).  Headings would be linear in the measured turns if turns did not wrap; the number
of whole turns round each loop is read off a spanning tree (eq. 21), which is right where the loops' errors
stay below half a turn.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import splu

from sequential.errors import ModelError
from sequential.manifold import SE2
from sequential.manifold.so2 import wrap_angle
from sequential.slam.initial.links import Links
from sequential.slam.initial.tree import tree_poses

__all__ = ["lago_headings", "lago_poses"]

Array = NDArray[np.float64]


def lago_headings(links: Links) -> Array:
    """Headings (n,) rad, not wrapped: what is left of each measured turn is least squares of a Laplacian.

    Raises
    ------
    ModelError
        for poses in space; take `chordal_poses` there.
    """
    if not isinstance(links.manifold, SE2):
        msg = "LAGO is for poses in the plane; initialise poses in space with 'chordal'"
        raise ModelError(msg)
    first = np.asarray(tree_poses(links)[:, 2])
    tail, head = links.tail, links.head
    predicted = first[head] - first[tail]
    whole = np.round((predicted - links.z[:, 2]) / (2 * np.pi))
    measured = links.z[:, 2] + 2 * np.pi * whole
    weight = 1.0 / links.cov[:, 2, 2]
    # about the tree: the right side is small, and anchors stay where they are
    left = _laplacian_rows(links, weight)
    free = np.setdiff1d(np.arange(links.count), links.anchors)
    right = np.zeros(links.count)
    residual = weight * (measured - predicted)
    np.add.at(right, head, residual)
    np.add.at(right, tail, -residual)
    heading = first.copy()
    heading[free] += splu(left[free][:, free].tocsc()).solve(right[free])
    return heading


def _laplacian_rows(links: Links, weight: Array) -> csr_matrix:
    """The weighted Laplacian (n, n)."""
    tail, head, n = links.tail, links.head, links.count
    rows = np.concatenate([tail, head, tail, head])
    columns = np.concatenate([tail, head, head, tail])
    values = np.concatenate([weight, weight, -weight, -weight])
    return csr_matrix((values, (rows, columns)), shape=(n, n))


def lago_poses(links: Links) -> Array:
    """Poses (n, 3): headings first, then all three numbers by one linear step with the full weights."""
    heading = lago_headings(links)
    return planar_step(links, heading)


def planar_step(links: Links, heading: Array) -> Array:
    """Poses (n, 3) by least squares, linear about given headings (Carlone et al. 2014, eq. 31-34)."""
    tail, head, n = links.tail, links.head, links.count
    c, s = np.cos(heading[tail]), np.sin(heading[tail])
    dx, dy = links.z[:, 0], links.z[:, 1]
    moved = np.stack([c * dx - s * dy, s * dx + c * dy], axis=1)
    turn = wrap_angle(links.z[:, 2] - heading[head] + heading[tail])
    rotation = np.zeros((len(tail), 3, 3))
    rotation[:, 0, 0], rotation[:, 0, 1], rotation[:, 1, 0], rotation[:, 1, 1] = c, -s, s, c
    rotation[:, 2, 2] = 1.0
    # weights in the frame of the measurement, at its tail
    information = inverses(rotation @ _straight(links) @ np.swapaxes(rotation, 1, 2))
    at_tail = np.tile(-np.eye(3), (len(tail), 1, 1))
    at_tail[:, 0, 2], at_tail[:, 1, 2] = moved[:, 1], -moved[:, 0]
    right = np.concatenate([moved, turn[:, None]], axis=1)
    start = np.zeros((n, 3))
    start[links.anchors, :2] = links.poses[:, :2]
    step = solve_blocks(links, at_tail, np.tile(np.eye(3), (len(tail), 1, 1)), information, right, start)
    return SE2().normalize(np.column_stack([step[:, :2], heading + step[:, 2]]))


def inverses(matrices: Array) -> Array:
    """(N, d, d)."""
    return np.asarray(np.linalg.inv(matrices), dtype=np.float64)


def _straight(links: Links) -> Array:
    """Covariances of (x, y, heading) along the axes of the tail, from those in the chart at z."""
    c, s = np.cos(links.z[:, 2]), np.sin(links.z[:, 2])
    turned = np.zeros_like(links.cov)
    turned[:, 0, 0], turned[:, 0, 1], turned[:, 1, 0], turned[:, 1, 1] = c, -s, s, c
    turned[:, 2, 2] = 1.0
    return np.asarray(turned @ links.cov @ np.swapaxes(turned, 1, 2))


def solve_blocks(
    links: Links, at_tail: Array, at_head: Array, information: Array, right: Array, start: Array
) -> Array:
    """Least squares of `at_tail x_tail + at_head x_head = right` over the free nodes: (n, d).

    Anchors keep their rows of `start`.
    """
    n, d = start.shape
    tail, head = links.tail, links.head
    residual = right - (at_tail @ start[tail][..., None] + at_head @ start[head][..., None])[..., 0]
    sides = ((tail, at_tail), (head, at_head))
    rows, columns, values = [], [], []
    gradient = np.zeros((n, d))
    place = np.arange(d)
    for a, A in sides:
        weighted = np.swapaxes(A, 1, 2) @ information
        np.add.at(gradient, a, (weighted @ residual[..., None])[..., 0])
        for b, B in sides:
            block = weighted @ B
            rows.append(np.broadcast_to((a[:, None, None] * d + place[:, None]), block.shape).ravel())
            columns.append(np.broadcast_to((b[:, None, None] * d + place[None, :]), block.shape).ravel())
            values.append(block.ravel())
    joined = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    whole = csr_matrix(joined, shape=(n * d, n * d))
    free = np.setdiff1d(np.arange(n), links.anchors)
    kept = (free[:, None] * d + place).ravel()
    solved = start.copy()
    step = splu(
        whole[kept][:, kept].tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}
    ).solve(gradient.ravel()[kept])
    solved[free] += step.reshape(-1, d)
    return solved
