"""Calibration from corners: exact on exact corners, equal to OpenCV's, honest about what it cannot know."""

import cv2
import numpy as np
import pytest
from calibration_worlds import CAMERAS, SIZE, board, world

from sequential.errors import DataError, ModelError, UnderConstrainedError
from sequential.manifold import SE3
from vision3d.calibrate import calibrate
from vision3d.views import View

CORNERS = np.array([0, 8, 45, 53])
OPENCV_FLAGS = {
    "pinhole": cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
    "brown1": cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
    "brown2": cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
    "brown4": cv2.CALIB_FIX_K3,
    "brown5": 0,
}


@pytest.mark.parametrize("lens", CAMERAS)
def test_exact_corners_give_the_camera_back(lens):
    scene = world(lens, n=16, seed=1)
    found = calibrate(scene.views(np.random.default_rng(0), sigma_px=0.0, stated_px=0.1), lens)
    assert found.report.converged
    # the bound on the coefficients of a rational lens is not exact
    assert found.rms_px < (1e-4 if lens in {"rational8", "thin12"} else 1e-6)
    probe = np.stack(np.meshgrid(np.linspace(60, 580, 9), np.linspace(60, 420, 7)), axis=-1).reshape(-1, 2)
    # coefficients of the rational lens trade places, projections do not
    np.testing.assert_allclose(found.camera.project(scene.camera.unproject(probe)), probe, atol=1e-3)
    assert np.abs(SE3().local(found.poses, scene.poses)).max() < 1e-5


@pytest.mark.parametrize("lens", OPENCV_FLAGS)
def test_same_minimum_and_standard_deviations_as_opencv(lens):
    views = world(lens, n=10, seed=2).views(np.random.default_rng(1))
    found = calibrate(views, lens, robust=False)
    corners = [view.pixels.astype(np.float32) for view in views]
    points = [view.points.astype(np.float32) for view in views]
    rms, matrix, distortion, _, _, std, _, per_view = cv2.calibrateCameraExtended(
        points, corners, SIZE, None, None, flags=OPENCV_FLAGS[lens], criteria=(3, 200, 1e-14)
    )
    k = len(found.camera.distortion)
    theirs = np.array([matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *np.ravel(distortion)[:k]])
    assert found.rms_px == pytest.approx(rms, rel=1e-5)
    np.testing.assert_allclose(found.view_rms, np.ravel(per_view), rtol=1e-3)
    assert np.all(np.abs(found.camera.parameters - theirs) < 0.02 * found.std)
    # OpenCV divides the squares by 2M - q as if poses cost nothing... and by M: its factor is told apart here
    ratio = np.ravel(std)[: 4 + k] / found.std
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-3)
    assert 0.9 < ratio[0] < 1.1


def test_covariance_of_everything_is_the_inverse_of_the_dense_information():
    scene = world(n=4, seed=5)
    found = calibrate(scene.views(np.random.default_rng(2)))
    full = found.cov_full()
    p = found.camera.count
    assert full.shape == (p + 2 + 24, p + 2 + 24)
    np.testing.assert_allclose(full[:p, :p], found.cov)
    for v in range(4):
        rows = slice(p + 2 + 6 * v, p + 8 + 6 * v)
        np.testing.assert_allclose(full[rows, rows], found.pose_covs[v])
    # a dense Jacobian by central differences knows nothing of arrows and complements
    jacobian = dense_jacobian(found)
    keep = np.r_[0:p, p + 2 : p + 26]
    inverse = np.linalg.inv(jacobian.T @ jacobian) * (found.sigma_scale * 0.2) ** 2
    sizes = np.sqrt(np.diag(inverse))
    np.testing.assert_allclose(
        full[np.ix_(keep, keep)] / sizes / sizes[:, None], inverse / sizes / sizes[:, None], atol=1e-4
    )


def dense_jacobian(found):
    """Corners of all views by (parameters, poses), differenced."""

    def corners(step):
        camera = found.camera.with_parameters(found.camera.parameters + step[: found.camera.count] * scale)
        poses = SE3().retract(found.poses, step[found.camera.count :].reshape(-1, 6))
        from sequential.manifold.quaternion import rotate

        return np.concatenate([
            camera.project(rotate(pose[:4], view.points) + pose[4:]).ravel()
            for pose, view in zip(poses, found.views, strict=True)
        ])  # fmt: skip

    scale = np.maximum(np.abs(found.camera.parameters), 1e-2)
    count, h = found.camera.count + 6 * len(found.poses), 1e-6
    columns = [(corners(h * e) - corners(-h * e)) / (2 * h) for e in np.eye(count)]
    jacobian = np.stack(columns, axis=-1)
    jacobian[:, : found.camera.count] /= scale
    return jacobian


@pytest.mark.parametrize("lens", ["rational8", "thin12"])
def test_the_bound_on_rational_coefficients_costs_no_honesty_and_keeps_poles_out(lens):
    z, folded, largest = [], 0, []
    for seed in range(6):
        scene = world(lens, n=10, seed=70 + seed)
        found = calibrate(scene.views(np.random.default_rng(seed)), lens)
        z.append((found.camera.parameters - scene.camera.parameters) / found.std)
        largest.append(np.abs(found.camera.distortion).max())
        folded += np.isnan(found.camera.project(scene.camera.unproject(scene.exact.reshape(-1, 2)))).any()
    assert 0.4 < np.sqrt(np.mean(np.square(z))) < 1.3
    assert max(largest) < 15.0
    assert not folded


def test_wrong_corners_are_named_and_do_no_harm(rng):
    scene = world(seed=7)
    clean = scene.views(np.random.default_rng(3))
    wrong = {(2, 11): (9.0, -4.0), (5, 0): (-3.0, 2.5), (5, 53): (30.0, 0.0), (12, 27): (0.0, 1.8)}
    spoilt = list(clean)
    for (v, corner), shift in wrong.items():
        pixels = spoilt[v].pixels.copy()
        pixels[corner] += shift
        spoilt[v] = View(clean[v].name, SIZE, clean[v].points, pixels, clean[v].ids, 0.2)
    found, reference = calibrate(spoilt), calibrate(clean)
    assert set(found.outliers) == set(wrong)
    assert np.all(np.abs(found.camera.parameters - reference.camera.parameters) < 0.2 * reference.std)
    assert any("view 5" in finding and "0, 53" in finding for finding in found.report.findings)


def test_a_view_whose_corners_are_off_as_a_whole_is_named_and_counts_little():
    scene = world(seed=8)
    clean = scene.views(np.random.default_rng(4))
    noise = np.random.default_rng(5).normal(0.0, 3.0, (54, 2))
    spoilt = [
        *clean[:6],
        View("shaken", SIZE, clean[6].points, clean[6].pixels + noise, clean[6].ids, 0.2),
        *clean[7:],
    ]
    found = calibrate(spoilt)
    assert found.outlier_views == (6,)
    assert any("shaken fits" in finding for finding in found.report.findings)
    without = calibrate([*clean[:6], *clean[7:]])
    assert np.all(np.abs(found.camera.parameters - without.camera.parameters) < 0.5 * without.std)


def test_a_view_with_its_corners_in_the_wrong_order_is_named():
    scene = world(seed=9)
    views = list(scene.views(np.random.default_rng(6)))
    views[3] = View("rolled", SIZE, views[3].points, np.roll(views[3].pixels, 5, axis=0), views[3].ids, 0.2)
    found = calibrate(views)
    assert found.outlier_views == (3,)
    assert abs(found.camera.parameters[0] - scene.camera.parameters[0]) < 4.0 * found.std[0]


def test_a_mirrored_view_fits_and_is_told():
    scene = world(seed=9)
    views = list(scene.views(np.random.default_rng(6)))
    mirrored = views[3].pixels.reshape(6, 9, 2)[:, ::-1].reshape(-1, 2)
    views[3] = View("mirrored", SIZE, views[3].points, mirrored, views[3].ids, 0.2)
    found = calibrate(views)
    assert any("mirrored shows the board from behind" in finding for finding in found.report.findings)
    assert found.view_rms[3] < 0.4


def test_gaussian_corners_are_kept():
    lost = sum(len(calibrate(world(seed=20 + s).views(np.random.default_rng(s))).outliers) for s in range(8))
    assert lost <= 2


def test_a_bent_board_is_measured():
    scene = world(seed=11, warp=(0.0004, -0.0003))
    views = scene.views(np.random.default_rng(7), sigma_px=0.05)
    flat, bent = calibrate(views), calibrate(views, board_warp=True)
    assert bent.rms_px < 0.8 * flat.rms_px
    assert np.all(np.abs(bent.warp - [0.0004, -0.0003]) < 4.0 * bent.warp_std)
    assert np.all(np.abs(bent.camera.parameters - scene.camera.parameters) < 4.5 * bent.std)
    assert any("a bent board explains" in finding for finding in flat.report.findings)
    assert not any("bent board" in finding for finding in bent.report.findings)
    assert not flat.warp.any()
    assert not flat.warp_std.any()


def test_a_solid_target_is_calibrated_too():
    rng = np.random.default_rng(12)
    points = np.column_stack([board()[:, :2], rng.uniform(0.0, 0.06, 54)])
    scene = world(seed=12, points=points)
    found = calibrate(scene.views(np.random.default_rng(8)))
    assert np.all(np.abs(found.camera.parameters - scene.camera.parameters) < 4.5 * found.std)


def test_begins_anew_from_another_calibration():
    views = world(seed=13).views(np.random.default_rng(9))
    once = calibrate(views, "brown2")
    again, fresh = calibrate(views, "brown5", start=once), calibrate(views, "brown5")
    assert np.all(np.abs(again.camera.parameters - fresh.camera.parameters) < 1e-3 * fresh.std)


def test_begins_from_a_calibration_of_fewer_views():
    views = world(seed=13, n=9).views(np.random.default_rng(9))
    once = calibrate(views[:6])
    again, fresh = calibrate(views, start=once), calibrate(views)
    assert np.all(np.abs(again.camera.parameters - fresh.camera.parameters) < 1e-2 * fresh.std)


def test_corners_only_partly_seen():
    scene, rng = world(seed=14), np.random.default_rng(10)
    views = [view.subset(rng.random(54) < 0.6) for view in scene.views(rng)]
    found = calibrate(views)
    assert [len(one) for one in found.residuals] == [len(view) for view in views]
    assert np.all(np.abs(found.camera.parameters - scene.camera.parameters) < 4.5 * found.std)


def test_views_parallel_to_the_image_leave_the_focal_length_free():
    scene = world(seed=15, tilt_rad=0.0)
    with pytest.raises(UnderConstrainedError, match="tilted by 30-45°"):
        calibrate(scene.views(np.random.default_rng(11)))


@pytest.mark.parametrize(
    ("spoil", "error", "text"),
    [
        (lambda views: views[:2], DataError, "at least 3 views of the board, got 2"),
        (lambda _: [], DataError, "at least 3 views of the board, got 0"),
        (lambda views: [*views[:5], views[5].subset(np.arange(3))], DataError, "view 5 shows 3 corners"),
        (
            lambda views: [view.subset(np.array([0, 8, 45, 53])) for view in views[:4]],
            DataError,
            "cannot determine",
        ),
    ],
)
def test_bad_input_is_a_sentence(spoil, error, text):
    with pytest.raises(error, match=text):
        calibrate(spoil(world().views(np.random.default_rng(0))))


def test_images_of_two_sizes_are_told_apart():
    views = list(world().views(np.random.default_rng(0)))
    other = View("other", (800, 600), views[0].points, views[0].pixels, views[0].ids, 0.2)
    with pytest.raises(DataError, match=r"view 0 is 640×480 and other is 800×600"):
        calibrate([*views[:4], other])


def test_unknown_lens():
    with pytest.raises(ModelError, match="no lens 'brown3'; known are pinhole"):
        calibrate(world().views(np.random.default_rng(0)), "brown3")


def test_results_are_read_only():
    found = calibrate(world().views(np.random.default_rng(0)))
    for array in (found.cov, found.poses, found.residuals[0], found.weights[0]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0
