"""The gauge of a reconstruction: photographs say neither where the world is, how it is turned, nor its scale.

Of the seven directions in which cameras and points may move together without any projection noticing, each is
fixed by a constraint.  Estimates differ by a similarity from gauge to gauge, and covariances by Baarda's
S-transformation (1973): C' = P C P' with P = 1 − G (D'G)⁻¹ D', G the directions, D the constraints.

| gauge | what is taken as known |
|---|---|
| `first pose and scale` | the pose of the first image, and its distance to the image farthest from it |
| `centres` | place, attitude and size of the cloud of camera centres, as where trajectories are aligned |
| `points` | the same of the cloud of points: inner constraints, whose points' covariances are the smallest |

The first two cases of Triggs et al. 2000 ("Bundle adjustment - a modern synthesis", section 9) and its inner
gauge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError, UnderConstrainedError
from sequential.manifold.quaternion import quaternion_multiply, rotate, rotation_matrix
from vision3d.rigid import inverse
from vision3d.sfm.bundle_problem import BundleProblem, BundleState

__all__ = ["GAUGES", "Directions", "check_gauge", "constraints", "directions", "restore"]

Array = NDArray[np.float64]

GAUGES = ("first pose and scale", "centres", "points")
NULL = 1e-9
"""Relative size of a singular value that is taken for zero."""


@dataclass(frozen=True, eq=False)
class Directions:
    """Columns over all unknowns: views (n, k) in the order of the problem, points (N, 3, k)."""

    views: Array
    points: Array

    @property
    def count(self) -> int:
        """How many there are."""
        return int(self.views.shape[1])

    def dot(self, other: Directions) -> Array:
        """(k, l) inner products."""
        product: Array = self.views.T @ other.views + np.einsum("nxk,nxl->kl", self.points, other.points)
        return product

    def times(self, matrix: Array) -> Directions:
        """Columns combined by a (k, l) matrix."""
        return Directions(self.views @ matrix, self.points @ matrix)


def check_gauge(gauge: str) -> str:
    """The name of a gauge; raises `ModelError` for an unknown one."""
    if gauge not in GAUGES:
        raise ModelError(f"no gauge {gauge!r}; known are {', '.join(map(repr, GAUGES))}")
    return gauge


def directions(problem: BundleProblem, state: BundleState) -> Directions:
    """Motions that no projection notices: turns (3), shifts (3), scale, less what held poses forbid."""
    by_pose, by_point = _similarity(state)
    views = np.zeros((problem.size, 7))
    places = problem.columns[:, :6]
    moving = places[:, 0] >= 0
    views[places[moving]] = by_pose[moving]
    whole = Directions(views, by_point)
    if moving.all():
        return whole
    # lengths in units of the scene, so that radians and metres compare
    size = _extent(state)
    units = np.array([1.0, 1.0, 1.0, size, size, size, 1.0])
    held = (by_pose[~moving] * units / np.array([1, 1, 1, size, size, size])[:, None]).reshape(-1, 7)
    _, values, turned = np.linalg.svd(held)
    rank = int(np.sum(values > NULL * values[0]))
    return whole.times(units[:, None] * turned[rank:].T)


def _similarity(state: BundleState) -> tuple[Array, Array]:
    """How poses (V, 6, 7), in their cameras' axes, and points (N, 3, 7) follow a similarity of the world."""
    R = rotation_matrix(state.poses[:, :4])  # camera_R_world
    by_pose = np.zeros((len(R), 6, 7))
    by_pose[:, :3, :3] = R
    by_pose[:, 3:] = R @ _moves(inverse(state.poses)[:, 4:])
    return by_pose, _moves(state.points)


def _moves(places: Array) -> Array:
    """How places (N, 3) follow turn, shift and scale: (N, 3, 7)."""
    moves = np.zeros((len(places), 3, 7))
    x, y, z = places.T
    moves[:, 0, 1], moves[:, 0, 2] = z, -y
    moves[:, 1, 0], moves[:, 1, 2] = -z, x
    moves[:, 2, 0], moves[:, 2, 1] = y, -x
    moves[:, :, 3:6] = np.eye(3)
    moves[:, :, 6] = places
    return moves


def _extent(state: BundleState) -> float:
    """Size of the cloud of centres and points."""
    places = np.concatenate([inverse(state.poses)[:, 4:], state.points])
    return float(np.median(np.linalg.norm(places - np.median(places, axis=0), axis=1))) or 1.0


def farthest(state: BundleState, first: int) -> int:
    """The image whose centre is farthest from that of another."""
    centres = inverse(state.poses)[:, 4:]
    return int(np.argmax(np.linalg.norm(centres - centres[first], axis=1)))


def constraints(problem: BundleProblem, state: BundleState, gauge: str, free: Directions) -> Directions:
    """The constraints D of a gauge, as many as there are free directions.

    Raises
    ------
    UnderConstrainedError
        where the constraints do not hold the free directions, such as centres on one line.
    """
    if gauge == "first pose and scale":
        chosen = _first_pose_and_scale(problem, state, free.count)
    else:
        by_pose, by_point = _similarity(state)
        views, points = np.zeros((problem.size, 7)), np.zeros_like(by_point)
        if gauge == "points":
            points = by_point
        else:
            places = problem.columns[:, 3:6]
            moving = places[:, 0] >= 0
            views[places[moving]] = by_pose[moving, 3:]
        chosen = Directions(views, points)
        if free.count < 7:
            shifts = Directions(_only_shifts(problem, free.views), np.zeros_like(free.points))
            chosen = free if gauge == "points" else shifts
    product = chosen.dot(free)
    if free.count and not _is_regular(product):
        raise UnderConstrainedError(
            f"the gauge {gauge!r} does not hold this reconstruction: "
            + (
                "the camera centres lie in one point or on one line; use 'points'"
                if gauge == "centres"
                else "all camera centres coincide, so nothing has a scale"
            )
        )
    return chosen


def _is_regular(product: Array) -> bool:
    rows = product / np.maximum(np.linalg.norm(product, axis=1, keepdims=True), 1e-300)
    rows = rows / np.maximum(np.linalg.norm(rows, axis=0, keepdims=True), 1e-300)
    return bool(np.linalg.svd(rows, compute_uv=False)[-1] > NULL)


def _only_shifts(problem: BundleProblem, views: Array) -> Array:
    """Columns (n, k) with nothing left but the shifts of poses."""
    kept = np.zeros_like(views)
    places = problem.columns[:, 3:6]
    places = places[places[:, 0] >= 0].ravel()
    kept[places] = views[places]
    return kept


def _first_pose_and_scale(problem: BundleProblem, state: BundleState, count: int) -> Directions:
    """Six columns of the first pose, where it is not held, and one of its distance to the farthest centre."""
    first = problem.held[0] if problem.held else 0
    views = np.zeros((problem.size, 7))
    own = problem.columns[first, :6]
    if own[0] >= 0:
        views[own, np.arange(6)] = 1.0
    last = farthest(state, first)
    centres = inverse(state.poses)[:, 4:]
    along = centres[last] - centres[first]
    along /= np.linalg.norm(along) or 1.0
    for image, sign in ((last, 1.0), (first, -1.0)):
        place = problem.columns[image, 3:6]
        if place[0] >= 0:
            views[place, 6] = sign * rotation_matrix(state.poses[image, :4]) @ along
    columns = views if count == 7 else views[:, 6:]
    return Directions(columns[:, :count], np.zeros((len(state.points), 3, count)))


def restore(state: BundleState, start: BundleState) -> BundleState:
    """Move a state by the similarity that gives it the first pose, and the size, of the start."""
    last = farthest(start, 0)
    before, after = inverse(start.poses)[:, 4:], inverse(state.poses)[:, 4:]
    length = np.linalg.norm(after[last] - after[0])
    scale = float(np.linalg.norm(before[last] - before[0]) / length) if length > 0.0 else 1.0
    # start_T_state maps where the first camera is to where it was
    first, now = inverse(start.poses[0]), state.poses[0]
    turn = quaternion_multiply(first[:4], now[:4])
    centres = rotate(turn, scale * (after - after[0])) + before[0]
    attitudes = quaternion_multiply(state.poses[:, :4], turn * (1.0, -1.0, -1.0, -1.0))
    points = rotate(turn, scale * (state.points - after[0])) + before[0]
    poses = np.concatenate([attitudes, -rotate(attitudes, centres)], axis=1)
    return BundleState(state.parameters, poses, points)
