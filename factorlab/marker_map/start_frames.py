"""First poses of the frames, given a first map: every reading of every marker proposes one, time decides.

Each frame keeps its two best proposals that differ; a shortest way through all frames (Viterbi) picks one of
each, where a step costs what it departs from the gyro's turn, or from standing still where there is no gyro.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from factorlab.marker_map.start import MapStart, Modes
from sequential.manifold import SE3, quaternion_inverse, quaternion_log, quaternion_multiply
from vision3d.rigid import compose, inverse

if TYPE_CHECKING:
    from factorlab.graph.marker_rows import CornerRows

__all__ = ["REFINED_PX", "FrameStart", "start_frames"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
MANIFOLD = SE3()
ROUGH_PX, REFINED_PX = 2.0, 0.5  # what corners may be off by while the map is rough, and later
CAP = 200.0  # squared sigmas of one sighting that no proposal is charged more for
APART_RAD = 0.08
SLACK_RAD, RATE = 0.06, 2.5  # rad, rad/s of a camera in a hand
SLACK_M, SPEED = 0.03, 1.0  # m, m/s
STEP_CAP = 30.0
GYRO_SLACK = 0.05
DOUBT = 12.0  # squared sigmas: the two best differ by less


@dataclass(frozen=True, eq=False)
class FrameStart:
    """Poses (F, 7) world_T_body where `placed` (F,), and how many frames time had to decide."""

    poses: Array
    placed: NDArray[np.bool_]
    doubtful: int


def start_frames(
    rows: CornerRows,
    modes: Modes,
    start: MapStart,
    turns: Array | None = None,
    *,
    rough_px: float = ROUGH_PX,
) -> FrameStart:
    """Pick poses.

    Parameters
    ----------
    turns : (F-1, 3) rotation vectors from each frame to the next by the gyro, NaN where it paused
    rough_px : what corners may be off by besides their noise
    """
    sightings = rows.sightings
    count = len(sightings.t)
    known = start.placed[sightings.marker] & (modes.probability[:, 0] > 0)
    first = _first_of_frames(sightings.frame, count)
    most = int(np.diff(first).max(initial=0))
    poses = np.tile(MANIFOLD.identity(), (2 * most, count, 1))
    costs = np.full((2 * most, count), np.inf)
    marked = start.poses[sightings.marker]
    camera_T_body = inverse(rows.body_T_camera)
    for slot in range(most):
        row = np.minimum(first[:-1] + slot, max(len(sightings) - 1, 0))
        there = (first[:-1] + slot < first[1:]) & known[row]
        for mode in range(2):
            proposed = there & (modes.probability[row, mode] > 0)
            world_T_camera = compose(marked[row], inverse(modes.poses[row, mode]))
            body = compose(world_T_camera, camera_T_body)
            poses[2 * slot + mode, proposed] = body[proposed]
            cost = _cost(rows, body, marked, known, rough_px)
            costs[2 * slot + mode, proposed] = (
                cost[proposed] - 2.0 * np.log(np.maximum(modes.probability[row, mode], 1e-6))[proposed]
            )
    two, price = _two_best(poses, costs)
    placed = np.isfinite(price[0])
    doubtful = int(np.sum(price[1, placed] - price[0, placed] < DOUBT))
    chosen = _viterbi(sightings.t, two, price, placed, turns)
    return FrameStart(two[chosen, np.arange(count)], placed, doubtful)


def _first_of_frames(frame: Ints, count: int) -> Ints:
    """(F+1,) first row of each frame; sightings come in the order of the frames."""
    return np.searchsorted(frame, np.arange(count + 1)).astype(np.int64)


def _cost(rows: CornerRows, body: Array, marked: Array, known: NDArray[np.bool_], rough: float) -> Array:
    """(F,) squared sigmas of all sightings of known markers, given a pose (F, 7) for each frame."""
    sightings = rows.sightings
    inside = rows.in_camera(body[sightings.frame], marked)
    pixels = sightings.camera.project(inside)
    away = np.sum((pixels - sightings.corners) ** 2, axis=(1, 2))
    variance = rough**2 + np.trace(sightings.cov, axis1=1, axis2=2) / 8.0
    squared = np.where(np.isfinite(away), np.minimum(away / variance, CAP), CAP) * known
    total = np.zeros(len(body))
    np.add.at(total, sightings.frame, squared)
    return total


def _two_best(poses: Array, costs: Array) -> tuple[Array, Array]:
    """Of proposals (C, F, 7) the best, and the best that is turned against it: (2, F, 7), (2, F)."""
    frames = np.arange(costs.shape[1])
    best = costs.argmin(axis=0)
    one = poses[best, frames]
    apart = np.linalg.norm(_turn(one[None], poses), axis=-1) > APART_RAD
    others = np.where(apart, costs, np.inf)
    second = others.argmin(axis=0)
    return np.stack([one, poses[second, frames]]), np.stack([costs[best, frames], others[second, frames]])


def _viterbi(t: Ints, poses: Array, price: Array, placed: NDArray[np.bool_], turns: Array | None) -> Ints:
    """(F,) 0 or 1: the cheapest way through the frames that are placed."""
    rows = np.flatnonzero(placed)
    chosen = np.zeros(len(t), dtype=np.int64)
    if not len(rows):
        return chosen
    total, backs = price[:, rows[0]].copy(), []
    for before, now in pairwise(rows):
        seconds = (t[now] - t[before]) * 1e-9
        turned = _turn(poses[:, before, None], poses[None, :, now])
        sigma = SLACK_RAD + RATE * seconds
        if turns is not None and now == before + 1 and np.isfinite(turns[before]).all():
            turned, sigma = turned - turns[before], GYRO_SLACK
        moved = np.linalg.norm(poses[:, before, None, 4:] - poses[None, :, now, 4:], axis=-1)
        step = np.sum((turned / sigma) ** 2, axis=-1) + (moved / (SLACK_M + SPEED * seconds)) ** 2
        through = total[:, None] + np.minimum(step, STEP_CAP)
        backs.append(through.argmin(axis=0))
        total = through.min(axis=0) + price[:, now]
    here = int(total.argmin())
    for row, back in zip(rows[:0:-1], reversed(backs), strict=True):
        chosen[row] = here
        here = int(back[here])
    chosen[rows[0]] = here
    return chosen


def _turn(a: Array, b: Array) -> Array:
    """Rotation vectors from poses a to poses b, in a's axes."""
    turn: Array = quaternion_log(quaternion_multiply(quaternion_inverse(a[..., :4]), b[..., :4]))
    return turn
