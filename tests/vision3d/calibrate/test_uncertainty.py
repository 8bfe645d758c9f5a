"""The uncertainty of projections meets Monte Carlo, and is honest on real images where the views disagree."""

import numpy as np
import pytest
from calibration_worlds import world

from sequential.errors import ModelError
from sequential.manifold.quaternion import quaternion_exp, rotate
from vision3d.calibrate import calibrate
from vision3d.calibrate.uncertainty import pixel_grid, projection_uncertainty, ray_jacobians, turn_freed

RUNS = 150


@pytest.fixture(scope="module")
def trials():
    """Calibrations of one world under many noises: the cameras, and the first calibration."""
    scene = world(seed=3)
    rng = np.random.default_rng(0)
    first = calibrate(scene.views(rng), robust=False)
    found = [calibrate(scene.views(rng), robust=False, start=first) for _ in range(RUNS)]
    return scene, found


def spread(errors):
    """Root mean square distances (N,) of errors (runs, N, 2) from their mean."""
    return np.sqrt(np.sum(np.var(errors, axis=0), axis=-1))


def assert_meets(predicted, scattered):
    # 150 runs tell a deviation of two coordinates to 4-6 %
    ratio = predicted / scattered
    assert np.mean((ratio > 0.85) & (ratio < 1.15)) >= 0.9
    assert 0.93 < np.median(ratio) < 1.07


def test_predicted_meets_scattered_over_the_image(trials):
    scene, found = trials
    pixels = pixel_grid(scene.camera.size, (10, 10))
    rays = scene.camera.unproject(pixels)
    errors = np.array([one.camera.project(rays) - pixels for one in found])
    predicted = np.median([projection_uncertainty(one, pixels).std_px for one in found[:20]], axis=0)
    assert_meets(predicted, spread(errors))


def test_predicted_meets_scattered_with_the_turn_freed(trials):
    scene, found = trials
    pixels = pixel_grid(scene.camera.size, (10, 10))
    rays = scene.camera.unproject(pixels)
    over = pixel_grid(scene.camera.size, (20, 15))
    directions = scene.camera.unproject(over)
    errors = []
    for one in found:
        # the turn that aligns best over the image, by least squares on the residuals themselves
        turn = np.zeros(3)
        for _ in range(3):
            turned = rotate(quaternion_exp(turn), directions)
            by_turn = ray_jacobians(one.camera, turned)[0].reshape(-1, 3)
            turn += np.linalg.lstsq(by_turn, (over - one.camera.project(turned)).ravel(), rcond=None)[0]
        errors.append(one.camera.project(rotate(quaternion_exp(turn), rays)) - pixels)
    predicted = np.median(
        [projection_uncertainty(one, pixels, freed_rotation=True).std_px for one in found[:20]], axis=0
    )
    assert_meets(predicted, spread(np.array(errors)))


def test_predicted_meets_scattered_for_points_among_the_boards(trials):
    scene, found = trials
    pixels, distance = pixel_grid(scene.camera.size, (6, 6)), 0.6
    points = distance * scene.camera.unproject(pixels)
    own = [rotate(pose[:4] * [1, -1, -1, -1], points - pose[4:]) for pose in scene.poses]
    errors = []
    for one in found:
        carried = [rotate(pose[:4], X) + pose[4:] for pose, X in zip(one.poses, own, strict=True)]
        errors.append(one.camera.project(np.mean(carried, axis=0)) - pixels)
    predicted = np.median(
        [projection_uncertainty(one, pixels, distance_m=distance).std_px for one in found[:20]], axis=0
    )
    assert_meets(predicted, spread(np.array(errors)))


def test_intrinsics_are_as_far_from_the_truth_as_they_say(trials):
    scene, found = trials
    z = np.array([(one.camera.parameters - scene.camera.parameters) / one.std for one in found])
    rms = np.sqrt(np.mean(z**2, axis=0))
    assert np.all((rms > 0.8) & (rms < 1.2))
    # pose after pose in the chart of SE3, with the camera's share
    from sequential.manifold import SE3

    steps = np.array([SE3().local(one.poses, scene.poses) for one in found])
    nees = [
        np.einsum("vi,vij,vj->v", s, np.linalg.inv(one.pose_covs), s) / 6
        for s, one in zip(steps, found, strict=True)
    ]
    assert 0.9 < np.mean(nees) < 1.1


def test_freeing_the_turn_takes_away_what_a_turn_explains():
    found = calibrate(world(seed=3).views(np.random.default_rng(0)))
    pixels = pixel_grid(found.camera.size, (20, 15))
    by_turn, by_parameters = ray_jacobians(found.camera, found.camera.unproject(pixels))
    left = by_parameters + -by_turn @ turn_freed(found.camera)
    np.testing.assert_allclose(
        np.einsum("nij,nik->jk", by_turn, left), 0.0, atol=1e-6 * np.abs(left).max() * 300
    )
    held, freed = projection_uncertainty(found), projection_uncertainty(found, freed_rotation=True)
    assert freed.mean_px < held.mean_px


def test_a_ray_turns_with_its_image():
    camera = world("fisheye4").camera
    rays, step = camera.unproject(pixel_grid(camera.size, (5, 4))), 1e-6
    by_turn, _ = ray_jacobians(camera, rays)
    for axis in np.eye(3):
        ahead, behind = (camera.project(rotate(quaternion_exp(s * step * axis), rays)) for s in (1, -1))
        np.testing.assert_allclose(by_turn @ axis, (ahead - behind) / (2 * step), atol=1e-4)


def test_a_grid_makes_a_map_and_pixels_do_not():
    found = calibrate(world(seed=3).views(np.random.default_rng(0)))
    over = projection_uncertainty(found, grid=(8, 6))
    assert over.map_px.shape == (6, 8)
    assert over.map_px[0, 0] > over.map_px[3, 4]
    assert np.all(over.worst_px <= over.std_px + 1e-12)
    with pytest.raises(ModelError, match="only a grid makes a map"):
        _ = projection_uncertainty(found, np.array([[3.0, 4.0]])).map_px


def test_where_the_lens_has_no_ray_there_is_no_uncertainty():
    scene = world("brown1", seed=3)
    found = calibrate(scene.views(np.random.default_rng(0)), "brown1")
    folding = found.camera.with_parameters(np.r_[found.camera.parameters[:4], -0.5])
    from dataclasses import replace

    at = projection_uncertainty(replace(found, camera=folding), np.array([[320.0, 240.0], [0.0, 0.0]]))
    assert np.isfinite(at.std_px[0])
    assert np.isnan(at.std_px[1])


def test_independent_corners_leave_the_information_matrix_alone():
    scenes = [world(seed=100 + s, n=(6, 13, 25)[s % 3]) for s in range(15)]
    inflated = [calibrate(scene.views(np.random.default_rng(s))).inflation for s, scene in enumerate(scenes)]
    assert np.sum(np.array(inflated) > 1.0) <= 1


def test_corners_that_err_together_are_found_out_and_the_deviations_stay_honest():
    """A board bent anew in every view: its corners err together, view by view."""
    rng = np.random.default_rng(8)
    z, independent, inflation = [], [], []
    for seed in range(12):
        scene = world(seed=200 + seed, n=16)
        low, high = scene.points.min(axis=0)[:2], scene.points.max(axis=0)[:2]
        rise = 1.0 - ((scene.points[:, :2] - 0.5 * (low + high)) / (0.5 * (high - low))) ** 2
        exact = []
        for pose in scene.poses:
            bent = scene.points + np.c_[np.zeros((54, 2)), rise @ rng.normal(0.0, 0.0004, 2)]
            exact.append(scene.camera.project(rotate(pose[:4], bent) + pose[4:]))
        scene.exact = np.array(exact)
        found = calibrate(scene.views(rng, sigma_px=0.05))
        off = found.camera.parameters - scene.camera.parameters
        z.append(off / found.std)
        independent.append(off / np.sqrt(np.diag(found.cov_independent)))
        inflation.append(found.inflation)
    assert np.median(inflation) > 1.5
    assert np.sqrt(np.mean(np.square(independent))) > 1.6
    assert 0.7 < np.sqrt(np.mean(np.square(z))) < 1.35
