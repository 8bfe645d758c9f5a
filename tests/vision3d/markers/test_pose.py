"""The pose of one marker: exact on exact corners, equal to OpenCV's minima, honest about noise."""

import cv2
import numpy as np
import pytest
from marker_worlds import PINHOLE, SIZE_M, corners_of, tilted

from sequential.errors import DataError, ModelError, NotPositiveDefiniteError, ShapeError
from sequential.manifold import SE3
from sequential.manifold.quaternion import rotation_matrix
from vision3d.camera import Camera
from vision3d.markers import marker_corners, marker_pose

SE = SE3()
CAMERAS = {
    "pinhole": PINHOLE,
    "brown5": Camera("brown5", (530, 531, 342, 234), (-0.28, 0.08, 1e-3, -2e-4, 0.02), (640, 480)),
    "rational8": Camera(
        "rational8", (530, 531, 342, 234), (0.1, -0.05, 1e-3, -2e-4, 0.01, 0.3, -0.02, 0.005), (640, 480)
    ),
    "fisheye4": Camera("fisheye4", (300, 301, 342, 234), (-0.01, 0.003, -0.001, 0.0), (640, 480)),
}


def angle(a, b):
    return np.linalg.norm(SE.local(a, b)[:3])


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("tilt", [0, 15, 45, 70])
def test_exact_corners_give_the_exact_pose(name, tilt, rng):
    camera = CAMERAS[name]
    truth = tilted(80.0, tilt, rng, camera, at=rng.uniform(-0.25, 0.25, 2))
    found = marker_pose(camera, corners_of(camera, truth), SIZE_M, 0.1)
    step = SE.local(found.modes[0].minimum, truth)
    assert np.abs(step).max() < 1e-6
    assert found.modes[0].rms_px < 1e-4


def test_a_fisheye_sees_markers_beyond_a_right_angle(rng):
    camera = Camera("fisheye4", (300, 301, 600, 600), (0.0, 0.0, 0.0, 0.0), (1200, 1200))
    truth = tilted(60.0, 20, rng, camera, at=(8.0, 1.0))  # 83° from the axis
    found = marker_pose(camera, corners_of(camera, truth), SIZE_M, 0.05)
    assert angle(found.modes[0].minimum, truth) < 1e-6


@pytest.mark.parametrize("tilt", [25, 40, 60])
def test_minima_are_those_that_opencv_refines_to(tilt, rng):
    camera = CAMERAS["pinhole"]
    points = marker_corners(SIZE_M)
    for _ in range(5):
        corners = corners_of(camera, tilted(60.0, tilt, rng)) + rng.normal(0.0, 0.2, (4, 2))
        ours = [mode.minimum for mode in marker_pose(camera, corners, SIZE_M, 0.2).modes]
        _, turns, places, _ = cv2.solvePnPGeneric(
            points, corners, camera.matrix, None, flags=cv2.SOLVEPNP_IPPE
        )
        for turn, place in zip(turns, places, strict=True):
            refined = cv2.solvePnPRefineLM(points, corners, camera.matrix, None, turn, place)
            R, t = cv2.Rodrigues(refined[0])[0], refined[1].ravel()
            near = min(np.abs(rotation_matrix(one[:4]) - R).max() + np.abs(one[4:] - t).max() for one in ours)
            assert near < 1e-3


def test_the_covariance_is_the_inverse_information_where_the_pose_is_sharp(rng):
    truth = tilted(200.0, 45, rng)
    found = marker_pose(PINHOLE, corners_of(PINHOLE, truth), SIZE_M, 0.1)
    J = np.empty((8, 6))
    for k in range(6):
        step = np.zeros(6)
        step[k] = 1e-6
        ahead, behind = (corners_of(PINHOLE, SE.retract(truth, sign * step)) for sign in (1.0, -1.0))
        J[:, k] = (ahead - behind).ravel() / 2e-6
    expected = np.linalg.inv(J.T @ J) * 0.1**2
    scale = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(
        found.cov / np.outer(scale, scale), expected / np.outer(scale, scale), atol=2e-3
    )


def test_a_diagonal_covariance_says_the_same_as_sigmas(rng):
    corners = corners_of(PINHOLE, tilted(40.0, 20, rng)) + rng.normal(0.0, 0.2, (4, 2))
    sigmas = np.array([0.1, 0.2, 0.3, 0.2])
    a = marker_pose(PINHOLE, corners, SIZE_M, sigmas)
    b = marker_pose(PINHOLE, corners, SIZE_M, np.diag(np.repeat(sigmas**2, 2)))
    np.testing.assert_allclose(a.cov, b.cov, rtol=1e-9)
    assert a.odds == pytest.approx(b.odds, rel=1e-9)


def test_turning_the_marker_in_its_plane_turns_the_pose_only(rng):
    corners = corners_of(PINHOLE, tilted(40.0, 20, rng)) + rng.normal(0.0, 0.2, (4, 2))
    a = marker_pose(PINHOLE, corners, SIZE_M, 0.2)
    b = marker_pose(PINHOLE, np.roll(corners, 1, axis=0), SIZE_M, 0.2)
    quarter = np.array([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5), 0.0, 0.0, 0.0])
    from sequential.manifold.quaternion import quaternion_multiply

    turned = np.concatenate([quaternion_multiply(b.camera_T_marker[:4], quarter[:4]), b.camera_T_marker[4:]])
    assert angle(turned, a.camera_T_marker) < 0.01 or angle(turned, a.camera_T_marker) > 1.5
    assert a.odds == pytest.approx(b.odds, rel=0.02)


def test_corners_that_fit_no_square_as_well_as_they_claim_are_worth_less(rng):
    corners = corners_of(PINHOLE, tilted(100.0, 30, rng))
    corners[0] += 3.0
    found = marker_pose(PINHOLE, corners, SIZE_M, 0.1)
    assert found.scale > 10.0
    alone = marker_pose(PINHOLE, corners, SIZE_M, 0.1 * np.sqrt(found.scale))
    np.testing.assert_allclose(found.cov, alone.cov, rtol=0.1)


def test_what_cannot_be_a_marker_is_said(rng):
    corners = corners_of(PINHOLE, tilted(100.0, 30, rng))
    with pytest.raises(ShapeError, match=r"\(4, 2\)"):
        marker_pose(PINHOLE, corners[:3], SIZE_M)
    with pytest.raises(ModelError, match="size of a marker"):
        marker_pose(PINHOLE, corners, -0.1)
    with pytest.raises(DataError, match="positive number of pixels"):
        marker_pose(PINHOLE, corners, SIZE_M, 0.0)
    with pytest.raises(NotPositiveDefiniteError):
        marker_pose(PINHOLE, corners, SIZE_M, np.zeros((8, 8)))
    with pytest.raises(DataError, match=r"fit no pose|on one line"):
        marker_pose(PINHOLE, np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0]]), SIZE_M)
