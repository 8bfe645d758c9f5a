"""What stands between frames: second order in the sample interval, native errors, pauses."""

import numpy as np
import pytest
from marker_map_worlds import recorded

from factorlab.graph.marker_inertial import InertialLinks
from factorlab.marker_map.segments import cut_at_frames
from factorlab.marker_map.world import NOISE
from sequential.sensors.recording import ImuRecording


def links_of(world, rate, frames, *, turned=True):
    """Links of exact readings at a rate; without `turned`, forces stand where GTSAM takes them."""
    t = np.arange(-1, int(frames[-1] * rate) + 2) / rate
    force, turn = world.inertial(t)
    imu = ImuRecording(np.round(t * 1e9).astype(np.int64), accel=force, gyro=turn)
    segments = cut_at_frames(imu, np.round(frames * 1e9).astype(np.int64))
    if not turned:
        for segment in segments:
            object.__setattr__(segment, "accel", segment.accel - np.cross(
                0.5 * segment.dt[:, None] * segment.gyro, segment.accel))  # fmt: skip
    return InertialLinks(segments, np.diff(frames), NOISE)


def velocity_gap(world, rate, *, turned=True):
    """Largest error of the velocity at the end of a second, m/s."""
    frames = np.array([0.0, 1.0, 2.0])
    links = links_of(world, rate, frames, turned=turned)
    motion = (world.poses(frames), world.velocities(frames), np.zeros((3, 6)))
    error, _, after = links.rows(links.about(motion[2]), *motion)
    return np.abs(np.linalg.solve(after, error[..., None])[:, 6:9]).max()


def test_the_integration_is_of_second_order():
    world = recorded(0, 0.5)[0]
    gaps = np.array([velocity_gap(world, rate) for rate in (25.0, 50.0, 100.0)])
    assert (gaps[:-1] / gaps[1:] > 3.2).all()
    assert gaps[-1] < 2e-3


def test_forces_that_are_not_turned_half_way_cost_an_order():
    world = recorded(0, 0.5)[0]
    turned, plain = velocity_gap(world, 100.0), velocity_gap(world, 100.0, turned=False)
    assert plain > 8 * turned


def test_rows_are_those_of_the_native_graph():
    _world, told, _ = recorded(1, 1.0)
    truth, t = told.truth, told.sightings.t
    links = InertialLinks(cut_at_frames(told.imu, t), np.diff(t) * 1e-9, NOISE)
    motion = (truth.poses, truth.velocities + 0.01, truth.biases)
    graph = links.about(truth.biases)
    error, _, _ = links.rows(graph, *motion)
    assert 0.5 * np.sum(error**2) == pytest.approx(links.cost(graph, *motion), rel=1e-9)


def test_at_the_truth_the_errors_are_white():
    errors = []
    for seed in range(6):
        _world, told, _ = recorded(seed, 4.0)
        truth, t = told.truth, told.sightings.t
        links = InertialLinks(cut_at_frames(told.imu, t), np.diff(t) * 1e-9, NOISE)
        errors.append(links.rows(links.about(truth.biases), truth.poses, truth.velocities, truth.biases)[0])
    squared = np.mean(np.concatenate(errors) ** 2, axis=0)
    assert (squared[:3] > 0.6).all()  # rotation: neighbours share the reading between them, so a little less
    assert (squared[:9] < 1.2).all()
    assert np.abs(squared[9:] - 1.0).max() < 0.25  # biases


def test_a_pause_leaves_only_the_walk_of_the_biases():
    _world, told, _ = recorded(2, 2.0)
    t = told.imu.t * 1e-9
    imu = told.imu.select((t < 0.8) | (t > 1.5))
    segments = cut_at_frames(imu, told.sightings.t)
    apart = np.array([one is None for one in segments])
    frames = told.sightings.t * 1e-9
    np.testing.assert_array_equal(apart, (frames[1:] > 0.795) & (frames[:-1] < 1.5))
    links = InertialLinks(segments, np.diff(frames), NOISE)
    truth = told.truth
    motion = (truth.poses, truth.velocities, truth.biases)
    error, before, after = links.rows(links.about(truth.biases), *motion)
    assert not error[apart, :9].any()
    assert not before[apart][:, :9].any()
    assert (np.abs(np.einsum("kii->ki", after[apart])[:, 9:]) > 0).all()
    assert 0.5 * np.sum(error**2) == pytest.approx(links.cost(links.about(truth.biases), *motion))
