"""Pose of an object from one picture: exact data, OpenCV, an honest covariance, and the rival of a plane."""

import cv2
import numpy as np
import pytest
from lens_family import EVERY_CAMERA, camera_of

from sequential.errors import DataError, NotFiniteError, ShapeError, UnderConstrainedError
from sequential.manifold import SE3
from vision3d.camera import Camera
from vision3d.pose import estimate_pose, estimate_poses, project_object, transform_points
from vision3d.pose_start import frontal_pose

every_camera = pytest.mark.parametrize("camera", EVERY_CAMERA, ids=lambda camera: camera.lens)
BOARD = 0.025 * np.array([[x, y, 0.0] for y in range(6) for x in range(9)])
SQUARE = 0.03 * np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
BOX = 0.05 * np.array([[x, y, z] for z in range(3) for y in range(2) for x in range(2)], dtype=float)
OBJECTS = {
    "board": BOARD,
    "square": SQUARE,
    "box": BOX,
    "tilted board": BOARD[:, [2, 0, 1]] + [1.0, 2.0, -3.0],
}


def random_pose(rng, points, distance=(0.35, 0.9), tilt=(0.25, 0.9)):
    """A pose (7,) whose object is seen near the middle of the image, its plane tilted by an angle, rad."""
    centre = points.mean(axis=0)
    normal = np.linalg.svd(points - centre)[2][2]
    # bring the normal to +z, tilt it about an axis of the image, turn it about the line of sight
    frame = np.linalg.svd(normal[None])[2][[1, 2, 0]]
    frame *= np.linalg.det(frame)
    axis_angle, spin, amount = *rng.uniform(0.0, 2.0 * np.pi, 2), rng.uniform(*tilt)
    axis = np.array([np.cos(axis_angle), np.sin(axis_angle), 0.0])
    R = cv2.Rodrigues(amount * axis)[0] @ cv2.Rodrigues(np.array([0.0, 0.0, spin]))[0] @ frame
    place = np.array([*rng.uniform(-0.06, 0.06, 2), rng.uniform(*distance)])
    return np.concatenate([quaternion(R), place - R @ centre])


def quaternion(R):
    from sequential.manifold.so3 import quaternion_from_matrix

    return quaternion_from_matrix(R)


@every_camera
@pytest.mark.parametrize("name", OBJECTS)
def test_exact_pixels_give_the_pose_back(camera, name, rng):
    points = OBJECTS[name]
    for _ in range(10):
        truth = random_pose(rng, points)
        estimate = estimate_pose(camera, points, project_object(camera, truth, points), sigma_px=1.0)
        error = SE3().local(truth, estimate.camera_T_object)
        assert np.abs(error[:3]).max() < 1e-7
        assert np.abs(project_object(camera, estimate.camera_T_object, points)).max() < 1e4
        assert estimate.rms_px < 1e-6
        assert estimate.dof == 2 * len(points) - 6


@pytest.mark.parametrize("lens", ["pinhole", "brown5", "thin12"])
def test_noisy_pixels_give_opencv_s_minimum(lens, rng):
    camera = camera_of(lens)
    for points in (BOARD, BOX):
        truth = random_pose(rng, points)
        pixels = project_object(camera, truth, points) + 0.3 * rng.standard_normal((len(points), 2))
        estimate = estimate_pose(camera, points, pixels)
        start = [cv2.Rodrigues(rotation_of(truth))[0], truth[4:].reshape(3, 1)]
        K, d = camera.matrix, camera.distortion_opencv
        criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-16)
        turn, shift = cv2.solvePnPRefineLM(points, pixels, K, d, *start, criteria)
        np.testing.assert_allclose(shift.ravel(), estimate.camera_T_object[4:], rtol=1e-6)
        np.testing.assert_allclose(
            cv2.Rodrigues(turn)[0], rotation_matrix_of(estimate.camera_T_object), rtol=0, atol=1e-6
        )


def rotation_matrix_of(pose):
    return np.column_stack([transform_points(pose, e) - pose[4:] for e in np.eye(3)])


rotation_of = rotation_matrix_of


@pytest.mark.slow
@pytest.mark.parametrize("lens", ["brown5", "fisheye4"])
@pytest.mark.parametrize(("name", "given"), [("board", True), ("box", True), ("board", False)])
def test_the_covariance_is_honest(lens, name, given, rng, seeds):
    """Normalised estimation errors squared have the mean of their degrees of freedom."""
    camera, points, sigma = camera_of(lens), OBJECTS[name], 0.25
    nees = []
    for _ in range(10 * len(seeds)):
        truth = random_pose(rng, points)
        pixels = project_object(camera, truth, points) + sigma * rng.standard_normal((len(points), 2))
        estimate = estimate_pose(camera, points, pixels, sigma if given else None)
        error = SE3().local(estimate.camera_T_object, truth)
        nees.append(error @ np.linalg.solve(estimate.cov, error))
    # the mean of N chi-squares of 6 degrees of freedom deviates by sqrt(12 / N)
    assert np.mean(nees) == pytest.approx(6.0, abs=4.0 * np.sqrt(12.0 / len(nees)) + (0.0 if given else 0.2))


def test_sigma_of_each_pixel_counts(rng):
    camera, truth = camera_of("brown5"), random_pose(rng, BOARD)
    sigma = np.where(np.arange(len(BOARD)) % 2, 0.05, 5.0)
    pixels = project_object(camera, truth, BOARD) + sigma[:, None] * rng.standard_normal((len(BOARD), 2))
    good = sigma < 1.0
    weighted = estimate_pose(camera, BOARD, pixels, sigma)
    alone = estimate_pose(camera, BOARD[good], pixels[good], 0.05)
    plain = estimate_pose(camera, BOARD, pixels)
    far = [np.linalg.norm(SE3().local(truth, one.camera_T_object)) for one in (weighted, plain)]
    assert far[0] < 0.2 * far[1]
    assert np.trace(weighted.cov) < np.trace(alone.cov)
    assert weighted.chi2 == pytest.approx(weighted.dof, rel=0.5)


def test_an_outlier_costs_a_robust_pose_little(rng):
    camera, truth = camera_of("brown5"), random_pose(rng, BOARD)
    pixels = project_object(camera, truth, BOARD) + 0.1 * rng.standard_normal((len(BOARD), 2))
    pixels[7] += 40.0
    found = [estimate_pose(camera, BOARD, pixels, 0.1, robust=robust) for robust in (False, True)]
    errors = [np.linalg.norm(SE3().local(truth, one.camera_T_object)) for one in found]
    assert errors[1] < 0.2 * errors[0]


def test_a_small_square_has_two_poses(rng):
    """Both are minima, tilted to opposite sides; with exact pixels the better one is the truth."""
    camera = camera_of("brown5")
    for _ in range(30):
        truth = random_pose(rng, SQUARE, distance=(0.8, 1.2), tilt=(0.3, 0.9))
        pixels = project_object(camera, truth, SQUARE)
        found = estimate_poses(camera, SQUARE, pixels, 0.1)
        assert len(found) == 2
        assert np.linalg.norm(SE3().local(truth, found[0].camera_T_object)) < 1e-6
        assert found[0].chi2 < 1e-6 < found[1].chi2
        sight = truth[4:] / np.linalg.norm(truth[4:])
        normals = [rotation_matrix_of(one.camera_T_object)[:, 2] for one in found]
        # as much away from the line of sight, to the other side
        tilts = [np.arccos(np.clip(normal @ sight, -1.0, 1.0)) for normal in normals]
        assert tilts[0] == pytest.approx(tilts[1], abs=0.15)
        assert (normals[0] - normals[0] @ sight * sight) @ (normals[1] - normals[1] @ sight * sight) < 0.0


def test_both_poses_are_opencv_s(rng):
    camera = camera_of("pinhole")
    corners = SQUARE[[3, 2, 1, 0]]  # IPPE_SQUARE wants y up, first corner top left
    for _ in range(20):
        truth = random_pose(rng, SQUARE, tilt=(0.4, 0.9))
        pixels = project_object(camera, truth, SQUARE) + 0.05 * rng.standard_normal((4, 2))
        found = estimate_poses(camera, SQUARE, pixels, 0.05)
        oracle = cv2.solvePnPGeneric(
            corners, pixels[[3, 2, 1, 0]], camera.matrix, np.zeros(4), flags=cv2.SOLVEPNP_IPPE_SQUARE
        )
        for turn, shift, one in zip(oracle[1], oracle[2], found, strict=True):
            assert np.linalg.norm(shift.ravel() - one.camera_T_object[4:]) < 0.02 * np.linalg.norm(shift)
            angle = cv2.Rodrigues(rotation_matrix_of(one.camera_T_object).T @ cv2.Rodrigues(turn)[0])[0]
            assert np.linalg.norm(angle) < 0.1


def test_a_start_that_noise_cannot_spoil(rng):
    """The frontal pose leads to the same minimum, from either side of a plane, however its axes lie."""
    for camera in (camera_of("brown5"), camera_of("fisheye4")):
        for name, points in OBJECTS.items():
            for behind in (False, True):
                truth = random_pose(rng, points, tilt=(0.1, 0.5))
                if behind:  # about the middle of the object
                    R, centre = rotation_matrix_of(truth) @ np.diag([1.0, -1.0, -1.0]), points.mean(axis=0)
                    truth = np.concatenate([quaternion(R), transform_points(truth, centre) - R @ centre])
                pixels = project_object(camera, truth, points)
                start = frontal_pose(camera, points, pixels)
                near = transform_points(start, points.mean(axis=0))
                assert np.linalg.norm(near - transform_points(truth, points.mean(axis=0))) < 0.3, name
                found = estimate_poses(camera, points, pixels, 0.1, start=start)[0]
                assert found.rms_px < 4.0, name


def test_a_dozen_pixels_of_noise_have_a_pose(rng):
    camera = camera_of("brown5")
    for _ in range(300):
        truth = random_pose(rng, SQUARE, distance=(1.8, 2.5), tilt=(0.0, 1.4))
        pixels = project_object(camera, truth, SQUARE) + 1.5 * rng.standard_normal((4, 2))
        estimate = estimate_pose(camera, SQUARE, pixels, 1.5)
        assert (transform_points(estimate.camera_T_object, SQUARE)[:, 2] > 0.0).all()


def test_a_fisheye_sees_an_object_beside_itself(rng):
    """Rays of more than 90 degrees have no x/z."""
    camera = Camera("fisheye4", (300.0, 300.0, 500.0, 500.0), (0.01, 0.001, 0.0, 0.0), (1000, 1000))
    R = cv2.Rodrigues(np.array([0.0, 1.6, 0.0]))[0]
    truth = np.concatenate([quaternion(R), R @ np.array([-0.1, -0.06, 0.3])])
    pixels = project_object(camera, truth, BOARD)
    assert (transform_points(truth, BOARD)[:, 2] < 0.0).any()
    estimate = estimate_pose(camera, BOARD, pixels, 0.1)
    assert np.linalg.norm(SE3().local(truth, estimate.camera_T_object)) < 1e-7


def test_what_gives_no_pose_is_a_sentence(rng):
    camera = camera_of("brown5")
    truth = random_pose(rng, BOARD)
    pixels = project_object(camera, truth, BOARD)
    with pytest.raises(UnderConstrainedError, match="four points or more, got 3"):
        estimate_pose(camera, BOARD[:3], pixels[:3])
    with pytest.raises(UnderConstrainedError, match="on a line"):
        estimate_pose(camera, BOARD[:9], pixels[:9])
    with pytest.raises(ShapeError, match=r"\(54, 3\) and \(53, 2\)"):
        estimate_pose(camera, BOARD, pixels[1:])
    with pytest.raises(NotFiniteError, match="leave out"):
        estimate_pose(camera, BOARD, np.where(np.arange(54)[:, None] == 3, np.nan, pixels))
    with pytest.raises(NotFiniteError, match="sigma_px"):
        estimate_pose(camera, BOARD, pixels, 0.0)
    folding = Camera("brown1", camera.intrinsics, (-2.0,))
    with pytest.raises(DataError, match="pixels have a ray"):
        estimate_pose(folding, BOARD, pixels + 5000.0)


def test_every_left_view_is_posed_as_opencv_does(data_dir):
    """Real corners: both minimise the same sum."""
    from vision3d import cv
    from vision3d.camera_files.opencv_vector import lens_of_vector
    from vision3d.images import read_images

    assert lens_of_vector(np.zeros(5))[0] == "brown5"
    camera = Camera(
        "brown5", (532.827, 532.946, 342.487, 233.856), (-0.2809, 0.0252, 0.0012, -0.0001, 0.1635)
    )
    for _, image in read_images(str(data_dir / "vision" / "opencv" / "left*.jpg")):
        found, corners = cv.find_chessboard(image, 9, 6)
        assert found
        pixels = cv.refine_corners(image, corners, 4)
        ours = estimate_pose(camera, BOARD, pixels)
        K, d = camera.matrix, camera.distortion_opencv
        _, turn, shift = cv2.solvePnP(BOARD, pixels, K, d)
        theirs = cv2.projectPoints(BOARD, turn, shift, K, d)[0].reshape(-1, 2)
        rms = np.sqrt(np.mean(np.sum((pixels - theirs) ** 2, axis=1)))
        assert ours.rms_px <= rms * (1.0 + 1e-6)
        assert ours.rms_px < 0.4
