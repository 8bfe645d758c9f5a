"""What the IMU says about the size of the markers: it knows metres, they know only ratios.

The whole problem is solved again with all sizes a little smaller and a little larger; a parabola through the
three costs has its minimum at the size that accelerations ask for, and its curvature is the information.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from factorlab.graph.marker_map import MapSolved, MarkerMapGraph

__all__ = ["size_by_imu"]

Array = NDArray[np.float64]
STEP = 0.02


def size_by_imu(graph: MarkerMapGraph, solved: MapSolved) -> tuple[float, float] | None:
    """Size asked for over size given, and its standard deviation; None where the motion tells nothing."""
    costs = [_cost(graph, solved, 1.0 + step) for step in (-STEP, STEP)]
    bend = (costs[0] - 2.0 * solved.cost + costs[1]) / STEP**2
    if not (np.isfinite(bend) and bend > 0.0):
        return None
    return 1.0 + (costs[0] - costs[1]) / (2.0 * STEP * bend), 1.0 / float(np.sqrt(bend))


def _cost(graph: MarkerMapGraph, solved: MapSolved, ratio: float) -> float:
    """The least cost with all sizes multiplied, from the solution scaled about the reference marker."""
    sightings = replace(graph.sightings, size_m=graph.sightings.size_m * ratio)
    state = solved.state
    origin = state.markers[graph.reference, 4:]
    frames, markers = state.frames.copy(), state.markers.copy()
    for poses in (frames, markers):
        poses[:, 4:] = origin + ratio * (poses[:, 4:] - origin)
    velocities = None if state.velocities is None else ratio * state.velocities
    start = replace(state, frames=frames, markers=markers, velocities=velocities)
    return replace(graph, sightings=sightings).solve(start, check=False).cost
