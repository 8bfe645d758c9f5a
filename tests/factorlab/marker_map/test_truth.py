"""Maps held to the truth they were simulated from, and their covariances by Monte Carlo."""

import numpy as np
import pytest
from marker_map_worlds import frame_errors, map_error, map_nees, mapped, nees, recorded

SECONDS = 4.0
PARTS = {"pose": slice(0, 6), "velocity": slice(6, 9), "accel bias": slice(9, 12), "gyro bias": slice(12, 15)}


@pytest.fixture(scope="module")
def fused(seeds):
    """Maps with an IMU, of as many worlds as there are seeds."""
    runs = []
    for seed in range(max(6, len(seeds) // 8)):
        world, told, markers = recorded(seed, SECONDS, world={"flat": seed % 2 == 1})
        found = mapped(world, told)
        runs.append((world, told, markers, found))
    return runs


@pytest.fixture(scope="module")
def alone(seeds):
    """The same worlds by the camera alone."""
    runs = []
    for seed in range(max(6, len(seeds) // 8)):
        world, told, markers = recorded(seed, SECONDS, world={"flat": seed % 2 == 1}, sigma_px=0.25)
        runs.append((world, told, markers, mapped(world, told, imu=False)))
    return runs


@pytest.mark.parametrize("kind", ["fused", "alone"])
def test_the_map_is_where_the_markers_are(kind, request):
    for _, _, markers, found in request.getfixturevalue(kind):
        error = map_error(found, markers)
        assert found.placed.all()
        assert np.abs(error[:, 3:]).max() < 8e-3
        assert np.degrees(np.abs(error[:, :3]).max()) < 1.0


@pytest.mark.parametrize("kind", ["fused", "alone"])
def test_the_maps_covariance_is_honest(kind, request):
    told = [map_nees(found, markers) for _, _, markers, found in request.getfixturevalue(kind)]
    total, free = np.sum(told, axis=0)
    assert abs(total - free) < 4.0 * np.sqrt(2.0 * free)


@pytest.mark.parametrize("part", PARTS)
def test_the_ways_covariance_is_honest(fused, part):
    """Frames of one run are nearly one draw for the biases: each run counts once."""
    span = PARTS[part]
    values = [
        nees(frame_errors(found, told.truth, markers, world)[:, span], found.frame_covs[:, span, span]).mean()
        for world, told, markers, found in fused
    ]
    dim = span.stop - span.start
    assert abs(np.mean(values) / dim - 1.0) < 4.5 * np.sqrt(2.0 / dim / len(values))


def test_poses_of_the_camera_alone_are_honest(alone):
    values = [
        nees(frame_errors(found, told.truth, markers, world), found.frame_covs).mean() / 6.0
        for world, told, markers, found in alone
    ]
    assert 0.7 < np.mean(values) < 1.4


def test_an_imu_makes_the_way_surer_and_truer(fused, alone):
    away = {
        name: np.sqrt(np.mean([
            np.mean(frame_errors(found, told.truth, markers, world)[:, 3:6] ** 2)
            for world, told, markers, found in runs
        ]))
        for name, runs in (("fused", fused), ("alone", alone))
    }  # fmt: skip
    assert away["fused"] < 0.7 * away["alone"]


def test_nothing_is_rejected_where_nothing_is_wrong(fused, alone):
    for *_, found in (*fused, *alone):
        assert found.gated.rejected.sum() <= 1
        assert found.gated.sound.all()
        assert found.scale == 1.0
