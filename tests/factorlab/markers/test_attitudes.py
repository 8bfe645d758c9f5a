"""A marker and a gyro together: better than either, honest about it, and right about mirror images."""

import numpy as np
import pytest
from vision_imu_worlds import (
    BIAS_SIGMA,
    CAMERA,
    NOISE,
    ROTATIONS,
    SIZE_M,
    corner_readings,
    gyro_only,
    noisy_readings,
    off,
    rms_deg,
    squared,
    turning,
)

import sequential as sq
from factorlab.graph import BatchGraph
from factorlab.markers.attitudes import attitude_readings, fuse_attitude
from sequential.errors import DataError, ShapeError
from sequential.evaluate.consistency import chi2_band
from sequential.manifold.quaternion import quaternion_exp, quaternion_multiply
from vision3d.markers import marker_corners, marker_pose

FILTER, SMOOTHER = sq.ExtendedKalmanFilter(), sq.IteratedSmoother()


def fused(estimator, gyro, marker, **settings):
    return fuse_attitude(estimator, gyro, marker, NOISE, bias_sigma=BIAS_SIGMA, **settings)


@pytest.mark.parametrize("make", [noisy_readings, corner_readings], ids=["noisy", "corners"])
def test_fused_beats_camera_and_gyro(make, rng):
    motion, gyro, _ = turning(rng)
    marker = make(motion, rng)
    filtered, smoothed = (fused(one, gyro, marker, at=gyro.t[10:-10]) for one in (FILTER, SMOOTHER))
    errors = [rms_deg(off(motion, run.t, run.mean[:, :4])) for run in (filtered, smoothed)]
    camera = rms_deg(off(motion, marker.t, marker.context[:, :4]))
    alone = rms_deg(off(motion, *gyro_only(gyro, marker)))
    assert errors[0] < 0.3 * min(camera, alone)
    assert errors[1] < 0.8 * errors[0]


@pytest.mark.parametrize(("make", "slack"), [(noisy_readings, 1.0), (corner_readings, 1.35)])
def test_the_last_attitude_is_as_sure_as_it_says(make, slack, seeds):
    """ANEES of the last node of independent runs; corners' posteriors are not quite Gaussian."""
    values = []
    for seed in seeds[: len(seeds) if make is noisy_readings else len(seeds) // 2]:
        motion, gyro, _ = turning(np.random.default_rng(seed), seconds=5.0)
        run = fused(FILTER, gyro, make(motion, np.random.default_rng(1000 + seed)))
        values.append(squared(run, off(motion, run.t, run.mean[:, :4]))[-1])
    low, high = chi2_band(3, len(values), 0.999)
    assert low / slack < np.mean(values) < high * slack


def test_a_graph_smooths_as_the_smoother_does(rng):
    motion, gyro, _ = turning(rng, seconds=8.0)
    marker = noisy_readings(motion, rng)
    smoothed = fused(sq.IteratedSmoother(tolerance=1e-9, max_iterations=100), gyro, marker)
    graph = fused(BatchGraph(), gyro, marker)
    apart = np.abs(smoothed.manifold.local(smoothed.mean, graph.mean)) / graph.sigmas()
    assert apart.max() < 1e-3
    np.testing.assert_allclose(smoothed.sigmas(), graph.sigmas(), rtol=1e-3)


def test_beginning_on_the_mirror_image_is_found_out(rng):
    """The first sighting swears by the wrong mode; the run from the other one is likelier."""
    motion, gyro, _ = turning(rng, seconds=8.0)
    marker = noisy_readings(motion, rng, flipped=0.02)
    context, values = marker.context.copy(), marker.values.copy()
    truth = motion.attitude(np.zeros(1))[0][0]
    both = sorted((context[0, :4], context[0, 4:8]), key=lambda q: -np.linalg.norm(ROTATIONS.local(q, truth)))
    context[0, :8] = np.concatenate(both)
    values[0] = both[0]
    turned = sq.Stream(marker.t, values, context, noise_cov=marker.noise_cov)
    run = fused(FILTER, gyro, turned)
    assert rms_deg(off(motion, run.t, run.mean[:, :4])) < 3.0


def test_how_the_marker_is_glued_on_is_learnt(rng):
    motion, gyro, _ = turning(rng)
    mount = quaternion_exp(np.radians([6.0, -8.0, 4.0]))
    body = noisy_readings(motion, rng, sigma=0.01, flipped=0.05)
    context = body.context.copy()
    for where in (slice(0, 4), slice(4, 8)):
        context[:, where] = ROTATIONS.normalize(quaternion_multiply(context[:, where], mount))
    marker = sq.Stream(body.t, context[:, :4], context, noise_cov=body.noise_cov)
    run = fused(SMOOTHER, gyro, marker, mount_sigma=0.3)
    error = ROTATIONS.local(run.part("mount")[-1], mount)
    sigma = run.sigmas()[-1, 6:]
    assert np.degrees(np.linalg.norm(error)) < 2.0
    assert (np.abs(error) < 4.0 * sigma).all()
    rigid = fused(SMOOTHER, gyro, marker)
    errors = [rms_deg(off(motion, one.t, one.mean[:, :4])) for one in (run, rigid)]
    assert errors[0] < 0.5 * errors[1]


def test_hypotheses_may_be_held_side_by_side(rng):
    """An interacting multiple model over both modes comes to where the likelier reading leads."""
    motion, gyro, _ = turning(rng, seconds=8.0)
    marker = noisy_readings(motion, rng, flipped=0.2)
    rates = sq.Stream(gyro.t[:-1], 0.5 * (gyro.values[1:] + gyro.values[:-1]))
    log = sq.SensorLog({"gyro": rates, "marker": marker})
    start = np.append(motion.attitude(np.zeros(1))[0][0], np.zeros(3))
    prior = sq.Gaussian(start, sq.diagonal([*[0.05] * 3, *[BIAS_SIGMA] * 3]))
    models = [
        sq.StateSpace(
            sq.attitude_state(), prior, sq.GyroAttitude(NOISE),
            {"marker": sq.TwoModeOrientation(1e-3, mode=mode)}, "gyro", start=0,
        )
        for mode in (0, 1, None)
    ]  # fmt: skip
    chances = np.array([[0.8, 0.2], [0.8, 0.2]])
    mixed = sq.run(sq.InteractingMultipleModel(models[:2], transition=chances), models[0], log)
    picked = sq.run(FILTER, models[2], log)
    errors = [rms_deg(off(motion, run.t, run.mean[:, :4])) for run in (mixed, picked)]
    assert max(errors) < 2.0
    assert abs(errors[0] - errors[1]) < 0.5


def test_readings_of_poses():
    corners = CAMERA.project(marker_corners(SIZE_M) + np.array([0.0, 0.0, 0.5]))
    pose = marker_pose(CAMERA, corners, SIZE_M, 0.3)
    stream = attitude_readings([0.0, 0.1, 0.2], [pose, None, pose])
    assert stream.t.tolist() == [0, 200_000_000]
    np.testing.assert_allclose(stream.context[0, :4], ROTATIONS.normalize(pose.camera_T_marker[:4]))
    np.testing.assert_allclose(stream.noise_cov[1], pose.cov[:3, :3])
    assert bool(stream.context[0, 4:8].any()) == (len(pose.modes) == 2)
    with pytest.raises(DataError, match="none of the frames"):
        attitude_readings([0.0], [None])
    with pytest.raises(ShapeError, match="2 poses need as many times"):
        attitude_readings([0.0], [pose, pose])


def test_recordings_that_do_not_overlap_are_refused(rng):
    motion, gyro, _ = turning(rng, seconds=4.0)
    marker = noisy_readings(motion, rng)
    late = sq.Stream(marker.t + 10**11, marker.values, marker.context, noise_cov=marker.noise_cov)
    with pytest.raises(DataError, match=r"gyro covers from 0\.000 .* marker from 100\.000 .* 0 sightings"):
        fused(FILTER, gyro, late)
    with pytest.raises(ShapeError, match="attitude_readings"):
        fused(FILTER, gyro, gyro)
    early = sq.Stream(marker.t - 10**9, marker.values, marker.context, noise_cov=marker.noise_cov)
    run = fused(FILTER, gyro, early)
    assert run.t[0] >= 0  # sightings before the gyro ran are left out
