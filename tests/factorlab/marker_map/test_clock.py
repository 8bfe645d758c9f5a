"""Two clocks: offsets found from turns, spans that share nothing, clocks that drift, wrong mounts."""

from dataclasses import replace

import numpy as np
import pytest
from marker_map_worlds import mapped, recorded

from factorlab.marker_map.clock import clock_offset, require_overlap
from factorlab.marker_map.extrinsics import Extrinsics
from factorlab.marker_map.job import MapSettings, map_job
from factorlab.marker_map.verdicts import map_verdicts
from factorlab.marker_map.world import NOISE
from sequential.errors import DataError
from vision3d.rigid import inverse


@pytest.fixture(scope="module")
def turned():
    world, told, _ = recorded(0, 5.0, sigma_px=0.2)
    return world, told, mapped(world, told, imu=False)


def shifted(imu, seconds):
    return replace(imu, t=imu.t + round(seconds * 1e9))


@pytest.mark.parametrize(
    ("offset", "reach"), [(0.083, 0.3), (-0.041, 0.3), (1_700_000_000.25, None), (0.0, 0.3)]
)
def test_the_offset_is_found_to_milliseconds(turned, offset, reach):
    world, told, found = turned
    clock = clock_offset(
        found.t, found.trajectory, world.body_T_camera, shifted(told.imu, offset), reach_s=reach
    )
    assert clock.offset_s == pytest.approx(offset, abs=3e-3)
    assert abs(clock.offset_s - offset) < 4 * clock.sigma_s
    assert clock.explained > 0.9


def test_a_camera_that_does_not_turn_tells_no_offset(turned):
    world, told, found = turned
    still = np.tile(found.trajectory[0], (len(found.t), 1))
    clock = clock_offset(found.t, still, world.body_T_camera, told.imu, reach_s=0.3)
    assert clock is None or clock.explained < 0.5


def test_spans_without_overlap_are_told(turned):
    _, told, _ = turned
    with pytest.raises(
        DataError, match=r"no time in common: frames run from 0.000 to 5.000 s, the IMU from 99"
    ):
        require_overlap(told.sightings.t, shifted(told.imu, 100.0))


def job(turned, imu, mount=None, offset_s=0.0):
    world, told, _ = turned
    settings = MapSettings(
        0.12, "auto", None, Extrinsics(world.body_T_camera if mount is None else mount), NOISE, offset_s
    )
    return map_job("v", told.sightings, settings, imu)


def test_auto_maps_across_unrelated_clocks(turned):
    made = job(turned, shifted(turned[1].imu, 1_700_000_000.0), offset_s=float("nan"))
    assert made.offset_s == pytest.approx(1_700_000_000.0, abs=3e-3)
    assert {one.verdict for one in map_verdicts(made)} <= {"PASS", "INFO"}


def test_clocks_apart_are_told_and_refused_where_nothing_fits(turned):
    imu = turned[1].imu
    late = {one.metric: one for one in map_verdicts(job(turned, shifted(imu, 0.02)))}
    assert late["clocks apart by"].verdict == "WARN"
    assert "--time-offset 0.0" in late["clocks apart by"].action
    with pytest.raises(
        DataError, match=r"contradict each other.* clocks are .* ms apart: give --time-offset 0.1"
    ):
        job(turned, shifted(imu, 0.15))


def test_a_mount_given_the_wrong_way_round_is_diagnosed(turned):
    world, told, found = turned
    clock = clock_offset(found.t, found.trajectory, inverse(world.body_T_camera), told.imu, reach_s=0.3)
    assert clock is None or clock.explained < 0.8


def test_a_clock_that_runs_fast_is_told(turned):
    world, told, found = turned
    fast = replace(told.imu, t=told.imu.t + np.round(told.imu.t * 0.03).astype(np.int64))
    clock = clock_offset(found.t, found.trajectory, world.body_T_camera, fast, reach_s=0.3)
    assert clock.drift_s[0] > 0.03
    assert clock.drift_s[0] > 4 * clock.drift_s[1]


@pytest.mark.parametrize("ratio", [0.8, 1.0, 1.1])
def test_accelerations_tell_a_wrong_size(turned, ratio):
    """The prints are said to be `ratio` times as large as they are."""
    world, told, _ = turned
    said = replace(told.sightings, size_m=told.sightings.size_m * ratio)
    size, sigma = mapped(world, told, sightings=said).size
    assert size == pytest.approx(1.0 / ratio, rel=0.04)
    assert sigma < 0.03
    if ratio == 1.0:
        assert abs(size - 1.0) < 4 * sigma
