"""The map once more with an IMU: first state, one joint problem, and markers that only motion reaches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from factorlab.marker_map.gating import gate
from factorlab.marker_map.inertial_start import InertialStart, carried, deltas, start_inertial, upright
from factorlab.marker_map.segments import cut_at_frames
from factorlab.marker_map.size_check import size_by_imu
from factorlab.marker_map.vision import VisionMap, renumbered
from sequential.errors import DataError
from sequential.manifold import SE3, rotate
from vision3d.rigid import compose

if TYPE_CHECKING:
    from factorlab.graph.marker_inertial import InertialLinks, Segment
    from factorlab.graph.marker_map import MapSolved, MapState, MarkerMapGraph
    from factorlab.marker_map.mapping import Inertial, MarkerMap

__all__ = ["with_imu"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
MANIFOLD = SE3()
REACH_S = 2.0  # how long an IMU alone may carry a frame to markers that nothing else ties
ROUNDS = 8
CONTRADICTS = 0.3  # share of the sightings that the IMU may turn out of the map
LIKE = 100.0  # squared sigmas within which two sightings of a carried marker agree


@dataclass(frozen=True, eq=False)
class _Nodes:
    """State of the frames (rows of the sightings) that take part."""

    rows: Ints
    segments: list[Segment | None]
    poses: Array
    velocities: Array
    biases: Array


def with_imu(seen: VisionMap, inertial: Inertial) -> MarkerMap:
    """Solve camera and IMU together, from the camera's map.

    Raises
    ------
    DataError
        where they share too little.
    UnderConstrainedError, NotConvergedError
    """
    from factorlab.marker_map.mapping import finish

    first = start_inertial(
        seen.poses[seen.frames], cut_at_frames(inertial.imu, seen.sightings.t[seen.frames])
    )
    gravity = float(np.linalg.norm(first.gravity))
    nodes = _levelled(seen, first, inertial)
    nodes = _bridged(seen, inertial, nodes)
    graph, solved = _solve(seen, inertial, nodes)
    for _ in range(ROUNDS):
        nodes = _Nodes(nodes.rows, nodes.segments, *solved.state.motion)
        if not _grown(seen, nodes):
            break
        nodes = _bridged(seen, inertial, nodes)
        graph, solved = _solve(seen, inertial, nodes)
    size = size_by_imu(graph, solved)
    return finish(seen, solved, graph.covariance(solved.state), inertial, gravity, size)


def _levelled(seen: VisionMap, first: InertialStart, inertial: Inertial) -> _Nodes:
    """Turn the world upright, its origin at the reference marker."""
    level = upright(first.gravity)
    level[4:] = -rotate(level[:4], seen.markers[seen.reference, 4:])
    seen.markers[seen.rows] = compose(level, seen.markers[seen.rows])
    seen.poses[seen.frames] = compose(level, seen.poses[seen.frames])
    biases = np.tile(np.concatenate([np.zeros(3), first.gyro_bias]), (len(seen.frames), 1))
    speeds = rotate(level[:4], first.velocities)
    segments = cut_at_frames(inertial.imu, seen.sightings.t[seen.frames])
    return _Nodes(seen.frames, segments, seen.poses[seen.frames], speeds, biases)


def _bridged(seen: VisionMap, inertial: Inertial, nodes: _Nodes) -> _Nodes:
    """Add frames that show nothing known but that the IMU leads to, carried from their neighbours."""
    t = seen.sightings.t
    every = cut_at_frames(inertial.imu, t)
    told = deltas(every, nodes.biases.mean(axis=0))
    down = np.array([0.0, 0.0, -inertial.gravity])
    state: dict[int, tuple[Array, Array]] = {
        int(row): (pose, speed)
        for row, pose, speed in zip(nodes.rows, nodes.poses, nodes.velocities, strict=True)
    }
    known = np.array(sorted(state))
    for back in (False, True):
        order = range(len(t) - 1, -1, -1) if back else range(len(t))
        for row in order:
            before = row + 1 if back else row - 1
            if row in state or before not in state:
                continue
            link = row if back else before
            if every[link] is None or np.abs(t[known] - t[row]).min() * 1e-9 > REACH_S:
                continue
            state[row] = carried(*state[before], told, link, down, back=back)
    rows = np.array(sorted(state), dtype=np.int64)
    near = np.abs(rows[:, None] - nodes.rows[None]).argmin(axis=1)
    return _Nodes(
        rows,
        cut_at_frames(inertial.imu, t[rows]),
        np.array([state[int(row)][0] for row in rows]),
        np.array([state[int(row)][1] for row in rows]),
        nodes.biases[near],
    )


def _solve(seen: VisionMap, inertial: Inertial, nodes: _Nodes) -> tuple[MarkerMapGraph, MapSolved]:
    """Robustly first, then twice by least squares on what passes the gate."""
    from factorlab.graph.marker_inertial import InertialLinks
    from factorlab.graph.marker_map import MapState

    sightings = seen.sightings
    seconds = np.diff(sightings.t[nodes.rows]) * 1e-9
    links = InertialLinks(nodes.segments, seconds, inertial.noise, inertial.gravity)
    kept = (seen.gated.taken | seen.gated.rejected) & np.isin(sightings.frame, nodes.rows)
    motion = MapState(nodes.poses, np.zeros((0, 7)), nodes.velocities, nodes.biases)
    taken = kept & seen.gated.sound[sightings.marker]
    graph, solved = _round(seen, inertial, links, nodes.rows, motion, taken, robust=True)
    for _ in range(2):
        before = int(seen.gated.taken.sum())
        seen.gated = gate(sightings, kept, seen.chi2(), seen.reference, 1.0, seen.gated)
        if seen.gated.taken.sum() < (1.0 - CONTRADICTS) * before:
            lost = before - int(seen.gated.taken.sum())
            raise DataError(
                f"camera and IMU contradict each other: {lost} of {before} sightings "
                "fit the map no more once the IMU is added; check the clocks, the mount (T_cam_imu, not its "
                "inverse), the units and the size of the markers"
            )
        graph, solved = _round(
            seen, inertial, links, nodes.rows, solved.state, seen.gated.taken, robust=False
        )
    return graph, solved


def _round(
    seen: VisionMap,
    inertial: Inertial,
    links: InertialLinks,
    frames: Ints,
    motion: MapState,
    taken: NDArray[np.bool_],
    *,
    robust: bool,
) -> tuple[MarkerMapGraph, MapSolved]:
    from factorlab.graph.marker_map import MapState, MarkerMapGraph

    own, seen.frames, seen.rows = renumbered(seen.sightings, taken, frames)
    reference = int(np.searchsorted(seen.rows, seen.reference))
    graph = MarkerMapGraph(own, seen.mount, reference, links, inertial.bias_sigmas, robust=robust)
    start = MapState(motion.frames, seen.markers[seen.rows], motion.velocities, motion.biases)
    solved = graph.solve(start, check=not robust)
    seen.poses[frames], seen.markers[seen.rows] = solved.state.frames, solved.state.markers
    seen.iterations += solved.iterations
    return graph, solved


def _grown(seen: VisionMap, nodes: _Nodes) -> bool:
    """Place markers that are seen from frames with a pose, though beside none that was placed."""
    sightings, modes = seen.sightings, seen.modes
    where = np.full(len(sightings.t), -1, dtype=np.int64)
    where[nodes.rows] = np.arange(len(nodes.rows))
    fresh = (where[sightings.frame] >= 0) & ~np.isin(sightings.marker, seen.rows)
    fresh &= seen.gated.sound[sightings.marker] & (modes.probability[:, 0] > 0)
    grown = False
    for marker in np.unique(sightings.marker[fresh]):
        rows = np.flatnonzero(fresh & (sightings.marker == marker))
        camera = compose(nodes.poses[where[sightings.frame[rows]]], seen.mount)
        told = np.stack([compose(camera, modes.poses[rows, mode]) for mode in range(2)], axis=1)
        chance = modes.probability[rows]
        whitening = np.linalg.inv(np.linalg.cholesky(4.0 * modes.covs[rows]))
        candidates = told[chance > 0]
        step = MANIFOLD.local(told[None], candidates[:, None, None])
        squared = np.sum(np.einsum("nmij,cnmj->cnmi", whitening, step) ** 2, axis=-1)
        cost = np.minimum(squared - 2.0 * np.log(np.maximum(chance, 1e-9)), LIKE).min(axis=2)
        seen.markers[marker] = candidates[int(np.argmin(cost.sum(axis=1)))]
        seen.gated.taken[rows] = True
        grown = True
    return grown
