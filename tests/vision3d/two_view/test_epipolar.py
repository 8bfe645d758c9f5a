"""Epipolar lines and curves beside OpenCV, and focal lengths where two pictures tell them."""

import cv2
import numpy as np
import pytest
from two_view_worlds import PINHOLE, distorted, world

from sequential.errors import ModelError, ShapeError
from sequential.manifold.quaternion import quaternion_exp, rotation_matrix
from vision3d.camera import Camera
from vision3d.robust import RansacSettings, fit_fundamental
from vision3d.two_view.epipolar import (
    epipolar_curve,
    epipolar_lines,
    epipoles,
    fundamental_matrix,
    line_distances,
    sampson_px,
)
from vision3d.two_view.motion import motion
from vision3d.two_view.uncalibrated import (
    cameras_from_fundamental,
    common_focal,
    focal_lengths,
    projective_cameras,
)


def test_lines_and_distances_are_opencvs(rng):
    it = world(rng)
    F = fundamental_matrix(it.b_T_a, PINHOLE, PINHOLE)
    for side, pixels, other in (("a", it.pixels_a, it.pixels_b), ("b", it.pixels_b, it.pixels_a)):
        lines = epipolar_lines(F, pixels, of=side)
        theirs = cv2.computeCorrespondEpilines(pixels.reshape(-1, 1, 2), 1 if side == "a" else 2, F).reshape(
            -1, 3
        )
        np.testing.assert_allclose(lines * np.sign(lines[:, :1] * theirs[:, :1]), theirs, atol=1e-8)
        assert np.std(line_distances(lines, other)) < 1.0
    theirs = [
        cv2.sampsonDistance(np.append(a, 1.0), np.append(b, 1.0), F)
        for a, b in zip(it.pixels_a, it.pixels_b, strict=True)
    ]
    np.testing.assert_allclose(sampson_px(F, it.pixels_a, it.pixels_b) ** 2, theirs, rtol=1e-9)


def test_lines_meet_in_the_epipoles(rng):
    it = world(rng, sigma_px=0.0)
    F = fundamental_matrix(it.b_T_a, PINHOLE, PINHOLE)
    in_a, in_b = epipoles(F)
    np.testing.assert_allclose(F @ in_a, 0.0, atol=1e-12)
    np.testing.assert_allclose(F.T @ in_b, 0.0, atol=1e-12)
    place = PINHOLE.matrix @ it.b_T_a[4:]  # camera a's centre in b
    np.testing.assert_allclose(np.cross(in_b, place / np.linalg.norm(place)), 0.0, atol=1e-9)


@pytest.mark.parametrize("camera", [PINHOLE, distorted], ids=lambda camera: camera.lens)
def test_curves_pass_through_the_matches(rng, camera):
    it = world(rng, camera=camera, sigma_px=0.0, count=40)
    for a, b in zip(it.pixels_a, it.pixels_b, strict=True):
        curve = epipolar_curve(camera, camera, it.b_T_a, a, count=4000)
        assert np.linalg.norm(curve - b, axis=1).min() < 1.0


def test_projective_cameras_have_the_matrix(rng):
    F = fundamental_matrix(world(rng).b_T_a, PINHOLE, PINHOLE)
    first, second = projective_cameras(F)
    points = np.column_stack([rng.standard_normal((20, 3)), np.ones(20)])
    a, b = points @ first.T, points @ second.T
    np.testing.assert_allclose(np.sum((a @ F.T) * b, axis=1), 0.0, atol=1e-10)


def converging(rng, *, skewed=True):
    """Two pictures of different places whose axes pass each other (skewed) or meet."""
    turn = quaternion_exp(np.array([0.12 if skewed else 0.0, -0.35, 0.06 if skewed else 0.0]))
    return motion(rotation_matrix(turn), np.array([1.0, 0.35 if skewed else 0.0, 0.2]))


def test_focal_lengths_of_exact_matrices(rng):
    a = Camera("pinhole", (500.0, 500.0, 320.0, 240.0), (), (640, 480))
    b = Camera("pinhole", (700.0, 700.0, 310.0, 250.0), (), (640, 480))
    b_T_a = converging(rng)
    centres = a.intrinsics[2:], b.intrinsics[2:]
    first, second = focal_lengths(fundamental_matrix(b_T_a, a, b), *centres)
    assert (first.focal_px, second.focal_px) == pytest.approx((500.0, 700.0), rel=1e-6)
    same = fundamental_matrix(b_T_a, a, a)
    assert common_focal(same, centres[0], centres[0], longest_px=640.0).focal_px == pytest.approx(
        500.0, rel=1e-4
    )


def test_parallel_axes_do_not_tell_a_focal_length(rng):
    camera = Camera("pinhole", (500.0, 500.0, 319.5, 239.5), (), (640, 480))
    points = np.column_stack([rng.uniform(-1, 1, (300, 2)), rng.uniform(2, 4, 300)])
    guesses = []
    for b_T_a in (converging(rng), motion(np.eye(3), np.array([1.0, 0.02, 0.01]))):
        moved = points @ rotation_matrix(b_T_a[:4]).T + b_T_a[4:]
        a, b = (camera.project(one) + 0.2 * rng.standard_normal((300, 2)) for one in (points, moved))
        fitted = fit_fundamental(a, b, RansacSettings(1.0), rng=rng)
        guesses.append(cameras_from_fundamental(fitted.model, camera.size, camera.size, fitted.cov))
    (found, _, told), (fallback, _, untold) = guesses
    assert told.observable
    assert abs(told.focal_px - 500.0) < 4.0 * told.sigma_px + 5.0
    assert found.intrinsics[0] == told.focal_px
    assert not untold.observable
    assert fallback.intrinsics[0] == 768.0


def test_bad_input_is_told(rng):
    it = world(rng, camera=distorted)
    with pytest.raises(ModelError, match="undistort"):
        fundamental_matrix(it.b_T_a, distorted, PINHOLE)
    with pytest.raises(ModelError, match="'a' or 'b'"):
        epipolar_lines(np.eye(3), it.pixels_a, of="left")
    with pytest.raises(ShapeError, match="pixels"):
        sampson_px(np.eye(3), it.points_a, it.pixels_b)
