"""A room with markers that is simulated and solved."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from factorlab.marker_map.extrinsics import Extrinsics
from factorlab.marker_map.job import MapJob, MapSettings, map_job
from factorlab.marker_map.world import NOISE, MarkerWorld

__all__ = ["demo_job"]

SEED, SECONDS = 7, 12.0


def demo_job(reference: int | None = None, say: Callable[[str], object] = lambda _: None) -> MapJob:
    """Twelve seconds in a room with eight markers: a camera at 15 Hz and an IMU at 100 Hz."""
    rng = np.random.default_rng(SEED)
    world = MarkerWorld.room(rng)
    told = world.record(SECONDS, rng, sigma_px=0.25)
    settings = MapSettings(world.size_m, "4x4_50", reference, Extrinsics(world.body_T_camera), NOISE, 0.0)
    return map_job("a simulated room", told.sightings, settings, told.imu, dictionary="4x4_50", say=say)
