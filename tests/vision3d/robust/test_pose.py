"""Poses of three points and of many with wrong ones: exactness, OpenCV and PoseLib, honesty, sentences."""

import cv2
import numpy as np
import pytest
from two_view_worlds import PINHOLE, distorted

from sequential.errors import DataError, ModelError, NotFiniteError, ShapeError, UnderConstrainedError
from sequential.manifold import SE3
from sequential.manifold.quaternion import quaternion_exp, quaternion_normalize
from vision3d.camera import Camera
from vision3d.kernels.p3p import solve_p3p
from vision3d.pose import estimate_pose
from vision3d.rigid import inverse, transform
from vision3d.robust import RansacSettings, fit_pose

FISHEYE = Camera("fisheye4", (250.0, 251.0, 320.0, 240.0), (0.02, -0.01, 0.003, 0.0), (640, 480))
SAMPLE = np.arange(3)


def random_pose(rng):
    return np.concatenate(
        [quaternion_normalize(quaternion_exp(rng.standard_normal(3))), rng.standard_normal(3)]
    )


def triple(rng):
    camera_T_object = random_pose(rng)
    seen = np.column_stack([rng.uniform(-1.0, 1.0, (3, 2)), rng.uniform(1.0, 4.0, 3)])
    rays = seen / np.linalg.norm(seen, axis=1, keepdims=True)
    return camera_T_object, np.hstack([transform(inverse(camera_T_object), seen), rays])


def poses(rows):
    out = np.empty((4, 7))
    return out[: solve_p3p(rows, SAMPLE, out)]


def test_truth_is_among_the_poses_of_three_points(rng):
    for _ in range(1000):
        truth, rows = triple(rng)
        assert min(abs(pose - truth).max() for pose in poses(rows)) < 1e-8


def test_every_pose_explains_its_points_and_opencv_finds_no_more(rng):
    ours, theirs = 0, 0
    for _ in range(200):
        _, rows = triple(rng)
        found = poses(rows)
        for pose in found:
            seen = transform(pose, rows[:, :3])
            np.testing.assert_allclose(
                seen / np.linalg.norm(seen, axis=1, keepdims=True), rows[:, 3:], atol=1e-9
            )
        flat = np.ascontiguousarray(rows[:, 3:5] / rows[:, 5:])
        number, _, _ = cv2.solveP3P(rows[:, :3].copy(), flat, np.eye(3), None, flags=cv2.SOLVEPNP_P3P)
        ours, theirs = ours + len(found), theirs + number
    assert ours >= 0.99 * theirs


def test_points_on_a_line_have_no_pose(rng):
    _, rows = triple(rng)
    rows[2, :3] = 0.3 * rows[0, :3] + 0.7 * rows[1, :3]
    assert len(poses(rows)) == 0


def scene(rng, camera, *, count=150, wrong=0.5, sigma_px=0.5):
    camera_T_world = random_pose(rng)
    rays = camera.unproject(rng.uniform([10, 10], [630, 470], (count, 2)))
    points = rays * rng.uniform(1.0, 4.0, (count, 1))
    pixels = camera.project(points) + sigma_px * rng.standard_normal((count, 2))
    bad = rng.random(count) < wrong
    pixels[bad] = rng.uniform([0, 0], [640, 480], (int(bad.sum()), 2))
    return camera_T_world, transform(inverse(camera_T_world), points), pixels, ~bad


@pytest.mark.parametrize("camera", [PINHOLE, distorted, FISHEYE], ids=lambda camera: camera.lens)
def test_pose_among_wrong_matches_is_that_of_the_right_ones(rng, camera):
    truth, points, pixels, right = scene(rng, camera)
    fitted = fit_pose(camera, points, pixels, RansacSettings(2.5))
    assert fitted.inliers[right].mean() > 0.97
    assert fitted.sigma == pytest.approx(0.5, rel=0.2)
    known = estimate_pose(camera, points[right], pixels[right], 0.5)
    assert np.linalg.norm(SE3().local(fitted.model, known.camera_T_object)) < 2e-3
    assert np.linalg.norm(SE3().local(fitted.model, truth)) < 1e-2


@pytest.mark.slow
def test_pose_covariance_is_honest(seeds):
    nees = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        truth, points, pixels, _ = scene(rng, distorted, wrong=0.3)
        fitted = fit_pose(distorted, points, pixels, RansacSettings(2.5), rng=rng)
        error = SE3().local(fitted.model, truth)
        nees.append(error @ np.linalg.solve(fitted.cov, error) / 6.0)
    # a mean of n chi² of six over six has the standard deviation sqrt(2 / 6 n)
    assert (
        1.0 - 4.0 * np.sqrt(1.0 / (3.0 * len(nees)))
        < np.mean(nees)
        < 1.1 + 4.0 * np.sqrt(1.0 / (3.0 * len(nees)))
    )


@pytest.mark.parametrize(
    ("backend", "method"), [("opencv", "RANSAC"), ("opencv", "USAC_MAGSAC"), ("poselib", "RANSAC")]
)
def test_backends_find_the_same_pose(rng, backend, method):
    truth, points, pixels, _ = scene(rng, distorted)
    fitted = fit_pose(
        distorted, points, pixels, RansacSettings(2.5, backend=backend, opencv_method=method), rng=rng
    )
    assert np.linalg.norm(SE3().local(fitted.model, truth)) < 1e-2
    assert backend in fitted.backend


def test_prosac_order_and_reproducibility(rng):
    truth, points, pixels, right = scene(rng, PINHOLE, wrong=0.8)
    order = np.argsort(~right, kind="stable")
    fitted = fit_pose(PINHOLE, points[order], pixels[order], RansacSettings(2.5, order="prosac"))
    again = fit_pose(PINHOLE, points[order], pixels[order], RansacSettings(2.5, order="prosac"))
    np.testing.assert_array_equal(fitted.model, again.model)
    assert fitted.iterations < 50
    assert np.linalg.norm(SE3().local(fitted.model, truth)) < 2e-2


def test_bad_input_is_told(rng):
    _, points, pixels, _ = scene(rng, PINHOLE, count=20)
    with pytest.raises(ShapeError, match="points"):
        fit_pose(PINHOLE, points, pixels[:5])
    with pytest.raises(DataError, match="four matches"):
        fit_pose(PINHOLE, points[:3], pixels[:3])
    with pytest.raises(UnderConstrainedError, match="line"):
        fit_pose(PINHOLE, np.outer(np.arange(20.0), [1.0, 2.0, 3.0]), pixels)
    with pytest.raises(ModelError, match="LMEDS"):
        fit_pose(PINHOLE, points, pixels, RansacSettings(backend="opencv", opencv_method="LMEDS"))
    points[0, 0] = np.nan
    with pytest.raises(NotFiniteError, match="finite"):
        fit_pose(PINHOLE, points, pixels)
