"""The filter beside the map: its steps meet differences, small noise makes it honest, real noise does not."""

import numpy as np
import pytest
from marker_map_worlds import mapped, recorded

from factorlab.marker_map import Inertial
from factorlab.marker_map.beside import beside
from factorlab.marker_map.filter import filter_markers
from factorlab.marker_map.filter_gauge import held_at
from factorlab.marker_map.filter_steps import Body, propagated, started
from factorlab.marker_map.segments import cut_at_frames
from factorlab.marker_map.world import BIAS_SIGMAS, NOISE
from sequential.errors import DataError
from sequential.manifold import SE3, quaternion_inverse, quaternion_log, quaternion_multiply, rotate

SE = SE3()
PARTS = {"pose": slice(0, 6), "velocity": slice(6, 9), "accel bias": slice(9, 12), "gyro bias": slice(12, 15)}


def filtered(seed, seconds=8.0, **settings):
    """World, recording, true markers, and the filter in the gauge of the true reference."""
    world, told, markers = recorded(seed, seconds, **settings)
    reference = int(np.argmax(told.sightings.counts))
    inertial = Inertial(told.imu, world.body_T_camera, NOISE, bias_sigmas=BIAS_SIGMAS)
    run = filter_markers(told.sightings, inertial, reference, markers[reference])
    return world, told, run


def anees(told, run):
    """Of each part over the frames after three seconds, and the number of dimensions."""
    kept = np.isfinite(run.poses[:, 0]) & (told.truth.t[run.frames] > 3_000_000_000)
    rows, truth = run.frames[kept], told.truth
    error = np.hstack(
        [
            SE.local(run.poses[kept], truth.poses[rows]),
            truth.velocities[rows] - run.velocities[kept],
            truth.biases[rows] - run.biases[kept],
        ]
    )
    covs = run.covs[kept]
    return {
        name: np.mean(np.einsum("ki,kij,kj->k", error[:, s], np.linalg.inv(covs[:, s, s]), error[:, s]))
        / (s.stop - s.start)
        for name, s in PARTS.items()
    }


def between(a, b):
    """(15,) step of the filter from body a to body b."""
    turn = quaternion_log(quaternion_multiply(quaternion_inverse(a.pose[:4]), b.pose[:4]))
    return np.concatenate([turn, b.pose[4:] - a.pose[4:], b.velocity - a.velocity, b.bias - a.bias])


def test_no_start_from_poses_that_contradict_the_imu():
    world, told, _ = recorded(0, 1.5)
    inertial = Inertial(told.imu, world.body_T_camera, NOISE)
    segments = cut_at_frames(told.imu, told.sightings.t)
    truth = told.truth.poses
    body, _ = started(truth, segments, inertial)
    tilt = rotate(body.pose[:4], np.array([0.0, 0.0, 1.0])) - rotate(truth[-1, :4], np.array([0.0, 0.0, 1.0]))
    assert abs(tilt[2]) < 0.05
    flipped = truth.copy()
    flipped[::2, :4] = quaternion_multiply(flipped[::2, :4], np.array([0.0, 1.0, 0.0, 0.0]))
    assert started(flipped, segments, inertial) is None


@pytest.mark.parametrize("seed", [5, 7])
def test_rooms_with_few_sure_sightings_do_not_lead_astray(seed):
    _, told, run = filtered(seed, 8.0, world={"flat": True}, sigma_px=0.3)
    kept = np.isfinite(run.poses[:, 0]) & (run.frames > 45)
    gap = run.poses[kept, 4:] - told.truth.poses[run.frames[kept], 4:]
    assert np.sqrt(np.mean(np.sum(gap**2, axis=1))) < 0.1


def test_the_covariance_is_carried_as_differences_say():
    world, told, _ = recorded(0, 0.5)
    inertial = Inertial(told.imu, world.body_T_camera, NOISE)
    segment = cut_at_frames(told.imu, told.sightings.t)[2]
    body = Body(told.truth.poses[2], told.truth.velocities[2], told.truth.biases[2])
    moved, none = propagated(body, np.zeros((15, 15)), segment, inertial)
    F, step = np.empty((15, 15)), 1e-5
    for k in range(15):
        one = np.zeros(15)
        one[k] = step
        ahead, behind = (propagated(body.moved(s * one), none, segment, inertial)[0] for s in (1, -1))
        F[:, k] = (between(moved, ahead) - between(moved, behind)) / (2 * step)
    P = np.diag(np.arange(1.0, 16.0))
    np.testing.assert_allclose(propagated(body, P, segment, inertial)[1] - none, F @ P @ F.T, atol=5e-3)
    assert np.linalg.norm(told.truth.poses[3][4:] - moved.pose[4:]) < 1e-3


def test_a_gauge_moves_nothing_that_is_held_there_already(rng):
    marker = SE.random(rng)
    body = Body(SE.random(rng), rng.standard_normal(3), rng.standard_normal(6))
    pose, cov, velocity = held_at(body, marker, np.eye(21), marker)
    np.testing.assert_allclose(pose, body.pose, atol=1e-12)
    np.testing.assert_allclose(velocity, body.velocity, atol=1e-12)
    np.testing.assert_allclose(cov[9:, 9:], np.eye(6))
    shifted = marker + np.array([0, 0, 0, 0, 1.0, 2.0, -1.0])
    pose, _, _ = held_at(body, marker, np.eye(21), shifted)
    np.testing.assert_allclose(pose[4:], body.pose[4:] + shifted[4:] - marker[4:], atol=1e-12)


def test_a_world_that_turns_as_one_leaves_no_covariance(rng):
    """Body and marker that are uncertain only by a common heading and shift are certain relative to it."""
    marker, body = SE.random(rng), Body(SE.random(rng), rng.standard_normal(3), np.zeros(6))
    J = np.zeros((21, 4))
    up = np.array([0.0, 0.0, 1.0])
    for k, at in enumerate((body.pose, marker)):
        rows = slice(15, 18) if k else slice(0, 3)
        J[rows, 0] = rotate(quaternion_inverse(at[:4]), up)
    J[3:6, 0] = np.cross(up, body.pose[4:])
    J[6:9, 0] = np.cross(up, body.velocity)
    J[3:6, 1:] = np.eye(3)
    back = quaternion_inverse(marker[:4])
    J[18:21, 0] = rotate(back, np.cross(up, marker[4:]))
    J[18:21, 1:] = rotate(back, np.eye(3)).T
    cov = held_at(body, marker, J @ J.T, marker)[1]
    np.testing.assert_allclose(cov, 0.0, atol=1e-7)


def test_with_small_noise_the_filter_is_honest():
    told = [anees(*filtered(seed, sigma_px=0.02)[1:]) for seed in range(4)]
    for name in PARTS:
        assert np.mean([one[name] for one in told]) < 2.2, name


def test_with_real_noise_it_is_surer_than_it_may_be_and_the_map_is_not(seeds):
    """EKF-SLAM gains information about directions that nothing tells; a batch cannot."""
    few = range(max(5, len(seeds) // 8))
    told = [anees(*filtered(seed, sigma_px=0.4)[1:])["pose"] for seed in few]
    assert np.mean(told) > 1.3


def test_beside_the_map_it_is_the_less_sure():
    world, told, _ = recorded(1, 8.0, sigma_px=0.2)
    found = mapped(world, told)
    run = filter_markers(found.sightings, found.inertial, found.reference, found.poses[found.reference])
    both = beside(found, run)
    assert (np.median(both.smoother_sigma, axis=0) < np.median(both.filter_sigma, axis=0)).all()
    assert both.apart_m < 0.02
    assert 0.5 < both.covered <= 1.0


def test_a_marker_that_moves_is_rejected():
    world, told, _ = recorded(2, 4.0)
    sightings = told.sightings
    corners = sightings.corners.copy()
    corners[(sightings.marker == 1) & (sightings.frame > 30)] += 40.0
    from dataclasses import replace

    inertial = Inertial(told.imu, world.body_T_camera, NOISE)
    run = filter_markers(replace(sightings, corners=corners), inertial, 0, world.markers[3])
    assert run.rejected > 10


def test_it_needs_a_second_with_a_marker():
    world, told, _ = recorded(3, 0.6)
    inertial = Inertial(told.imu, world.body_T_camera, NOISE)
    with pytest.raises(DataError, match="no frame to begin at"):
        filter_markers(told.sightings, inertial, 0, world.markers[3])
