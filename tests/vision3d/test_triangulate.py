"""Triangulated points: exact without noise, equal to independent algorithms, and as sure as they say."""

import cv2
import numpy as np
import pytest
from scipy.optimize import least_squares

from sequential.errors import DataError, ModelError, NotPositiveDefiniteError, ShapeError
from sequential.manifold import SE3
from sequential.manifold.quaternion import rotation_matrix
from vision3d.camera import Camera
from vision3d.render import forward_poses, orbit_poses, sideways_poses, turning_poses
from vision3d.rigid import compose, inverse, transform
from vision3d.triangulate import pose_share, triangulate

LENSES = {
    "pinhole": Camera("pinhole", (560, 565, 319.5, 239.5), (), (640, 480)),
    "brown5": Camera("brown5", (533, 533, 342, 234), (-0.28, 0.05, 0.0012, -0.0001, 0.05), (640, 480)),
    "rational8": Camera("rational8", (500, 501, 320, 240), (0.2, 0.1, 0, 0, 0.01, 0.4, 0.2, 0), (640, 480)),
    "fisheye4": Camera("fisheye4", (230, 230, 320, 240), (0.02, -0.01, 0.003, 0.0), (640, 480)),
}
PINHOLE = LENSES["pinhole"]
ORBIT = orbit_poses((0, 0.1, 1.6), 1.6, 4, arc_rad=0.5)


def points_seen(rng, count):
    return rng.uniform((-0.45, -0.3, 1.2), (0.45, 0.35, 2.2), (count, 3))


def project(camera, poses, points):
    return np.stack([camera.project(transform(pose, points)) for pose in poses])


def normalised_errors(found, truth):
    error = found.points - truth
    return np.einsum("ni,nij,nj->n", error, np.linalg.inv(found.covs), error) / 3


@pytest.mark.parametrize("method", ["optimal", "linear"])
@pytest.mark.parametrize("camera", LENSES.values(), ids=LENSES)
def test_exact_pixels_give_exact_points(camera, method, rng):
    points = points_seen(rng, 300)
    pixels = project(camera, ORBIT, points)
    pixels[rng.uniform(size=pixels.shape[:2]) < 0.3] = np.nan
    seen = np.isfinite(pixels[:, :, 0]).sum(axis=0)
    found = triangulate(camera, ORBIT, pixels, method=method)
    twice = seen >= 2
    assert twice.any()
    assert not twice.all()
    np.testing.assert_array_equal(found.views, seen)
    np.testing.assert_allclose(found.points[twice], points[twice], atol=1e-9)
    assert np.isnan(found.points[~twice]).all()
    assert not found.ok[~twice].any()
    assert found.in_front[twice].all()
    assert np.nanmax(found.rms_px) < 1e-7


def test_each_view_has_its_own_camera(rng):
    points = points_seen(rng, 50)
    cameras = list(LENSES.values())
    pixels = np.stack([c.project(transform(pose, points)) for c, pose in zip(cameras, ORBIT, strict=True)])
    np.testing.assert_allclose(triangulate(cameras, ORBIT, pixels).points, points, atol=1e-9)


def test_the_linear_point_is_opencv_s(rng):
    pixels = project(PINHOLE, ORBIT[:2], points_seen(rng, 200)) + rng.normal(0, 0.8, (2, 200, 2))
    found = triangulate(PINHOLE, ORBIT[:2], pixels, method="linear")
    matrices = [np.column_stack([rotation_matrix(pose[:4]), pose[4:]]) for pose in ORBIT[:2]]
    rows = [PINHOLE.undistort_points(row).T for row in pixels]
    homogeneous = cv2.triangulatePoints(*matrices, *rows)
    np.testing.assert_allclose(found.points, (homogeneous[:3] / homogeneous[3]).T, rtol=1e-9)


@pytest.mark.parametrize("name", ["brown5", "fisheye4"])
def test_the_optimum_is_the_least_squares_one(name, rng):
    """Against SciPy, through a real lens, with a covariance for each pixel."""
    camera = LENSES[name]
    pixels = project(camera, ORBIT, points_seen(rng, 12)) + rng.normal(0, 1.0, (4, 12, 2))
    roots = rng.normal(0, 0.4, (4, 12, 2, 2)) + np.eye(2)
    covs = roots @ roots.transpose(0, 1, 3, 2)
    found = triangulate(camera, ORBIT, pixels, sigma_px=covs)
    for n in range(12):
        whiten = np.linalg.inv(np.linalg.cholesky(covs[:, n]))

        def residuals(point, n=n, whiten=whiten):
            error = pixels[:, n] - project(camera, ORBIT, point[None])[:, 0]
            return np.einsum("vij,vj->vi", whiten, error).ravel()

        best = least_squares(residuals, found.points[n] + 0.01, xtol=1e-15, ftol=1e-15, gtol=1e-15)
        np.testing.assert_allclose(found.points[n], best.x, atol=2e-7)
        assert found.chi2[n] == pytest.approx(2 * best.cost, rel=1e-9)
        np.testing.assert_allclose(found.covs[n], np.linalg.inv(best.jac.T @ best.jac), rtol=1e-3, atol=1e-9)


def test_the_optimum_is_no_worse_than_the_linear_point(rng):
    pixels = project(PINHOLE, ORBIT[:3], points_seen(rng, 500)) + rng.normal(0, 2.0, (3, 500, 2))
    best = triangulate(PINHOLE, ORBIT[:3], pixels)
    linear = triangulate(PINHOLE, ORBIT[:3], pixels, method="linear")
    assert (best.chi2 <= linear.chi2 * (1 + 1e-12)).all()
    assert (best.chi2 < linear.chi2).mean() > 0.9


@pytest.mark.parametrize("views", [2, 3, 4])
@pytest.mark.parametrize("name", ["pinhole", "brown5", "fisheye4"])
def test_covariances_are_honest(views, name, rng):
    camera, n = LENSES[name], 4000
    points = points_seen(rng, n)
    sigmas = rng.uniform(0.2, 0.8, (views, n))
    exact = project(camera, ORBIT[:views], points)
    found = triangulate(
        camera, ORBIT[:views], exact + sigmas[..., None] * rng.normal(size=exact.shape), sigma_px=sigmas
    )
    assert found.ok.all()
    # a mean of n numbers of variance 2/3
    assert normalised_errors(found, points).mean() == pytest.approx(1.0, abs=4 * np.sqrt(2 / 3 / n) + 0.01)
    assert (found.chi2 / found.dof).mean() == pytest.approx(1.0, abs=4 * np.sqrt(2 / n))
    share = np.mean(normalised_errors(found, points) * 3 < 7.815)
    assert share == pytest.approx(0.95, abs=0.015), "the 95 % ellipsoid holds 95 %"


def test_covariances_with_uncertain_poses_are_honest(rng):
    """Poses disturbed within their covariance, jointly: what stereo's calibration leaves behind."""
    points, views, manifold = points_seen(rng, 30), 3, SE3()
    root = np.diag(np.tile([2e-3, 2e-3, 2e-3, 3e-3, 3e-3, 3e-3], views))
    root = root @ (np.eye(6 * views) + 0.3 * rng.normal(size=(6 * views, 6 * views)))
    exact = project(PINHOLE, ORBIT[:views], points)
    values = []
    for _ in range(150):
        shifts = (root @ rng.normal(size=6 * views)).reshape(views, 6)
        poses = np.array([manifold.retract(p, s) for p, s in zip(ORBIT[:views], shifts, strict=True)])
        noisy = exact + rng.normal(0, 0.3, exact.shape)
        found = triangulate(PINHOLE, poses, noisy, sigma_px=0.3, pose_covs=root @ root.T)
        values.append(normalised_errors(found, points))
    assert np.mean(values) == pytest.approx(1.0, abs=0.12)
    alone = triangulate(PINHOLE, ORBIT[:views], exact, sigma_px=0.3)
    assert (np.trace(found.covs, axis1=1, axis2=2) > np.trace(alone.covs, axis1=1, axis2=2)).all()


def test_how_points_follow_poses_meets_differences(rng):
    camera, step = LENSES["brown5"], 1e-5
    poses = ORBIT[:3]
    # the share of the poses is exact where the residuals are zero
    pixels = project(camera, poses, points_seen(rng, 5))
    found = triangulate(camera, poses, pixels)
    share = pose_share(found, [camera] * 3, poses, pixels, np.broadcast_to(np.eye(2), (3, 5, 2, 2)))
    for v in range(3):
        for k in range(6):
            ends = []
            for sign in (1.0, -1.0):
                moved = poses.copy()
                moved[v] = SE3().retract(poses[v], sign * step * np.eye(6)[k])
                ends.append(triangulate(camera, moved, pixels).points)
            slope = (ends[0] - ends[1]) / (2 * step)
            np.testing.assert_allclose(share[:, :, v, k], slope, atol=1e-6)


def test_stars_are_told_from_points(rng):
    """At infinity the inverse distance is zero within its own standard deviation; nearer it is not."""
    n = 3000
    poses = sideways_poses(3, 0.1)
    rays = np.column_stack([rng.uniform(-0.4, 0.4, (n, 2)), np.ones(n)])
    stars = np.tile(PINHOLE.project(rays), (3, 1, 1))
    found = triangulate(PINHOLE, poses, stars + rng.normal(0, 0.5, stars.shape), sigma_px=0.5)
    z = found.inverse_m / found.inverse_std_m
    assert z.std() == pytest.approx(1.0, abs=0.06)
    assert z.mean() == pytest.approx(0.0, abs=0.08)
    assert found.at_infinity.mean() > 0.995
    assert (found.inverse_m < 0).mean() == pytest.approx(0.5, abs=0.05), "half of them lie beyond"
    assert np.isnan(found.points[found.inverse_m < 0]).all()
    off = np.cross(found.directions, rays / np.linalg.norm(rays, axis=1)[:, None])
    assert np.abs(off).max() < 5 * 0.5 / 560, "their directions are known"
    near = project(PINHOLE, poses, 3.0 * rays)
    found = triangulate(PINHOLE, poses, near + rng.normal(0, 0.5, near.shape), sigma_px=0.5)
    assert found.ok.all()


def test_without_a_baseline_nothing_is_told(rng):
    poses = turning_poses(3, 0.05)
    pixels = project(PINHOLE, poses, points_seen(rng, 40)) + rng.normal(0, 0.3, (3, 40, 2))
    found = triangulate(PINHOLE, poses, pixels, sigma_px=0.3)
    assert found.at_infinity.all()
    assert not found.ok.any()
    assert np.nanmax(found.angles_rad) < 1e-9


def test_a_point_behind_the_cameras_is_said(rng):
    """Matches whose rays meet behind: the sign of every disparity is wrong."""
    pixels = project(PINHOLE, sideways_poses(2, 0.2), points_seen(rng, 30))[::-1]
    found = triangulate(PINHOLE, sideways_poses(2, 0.2), pixels)
    assert not found.in_front.any()
    assert not found.ok.any()


def test_angles_are_between_rays():
    poses = sideways_poses(3, 0.25)
    pixels = project(PINHOLE, poses, np.array([[0.25, 0.0, 0.5], [0.25, 0.0, 2.0]]))
    found = triangulate(PINHOLE, poses, pixels)
    np.testing.assert_allclose(found.angles_rad, 2 * np.arctan2(0.25, [0.5, 2.0]), rtol=1e-9)


def test_the_world_may_lie_anywhere(rng):
    """Another frame moves the points along, and turns their covariances."""
    pixels = project(PINHOLE, ORBIT, points_seen(rng, 30)) + rng.normal(0, 0.5, (4, 30, 2))
    here = triangulate(PINHOLE, ORBIT, pixels)
    there_T_here = np.array([0.8, 0.2, -0.5, 0.26, 1000.0, -500.0, 200.0])
    there_T_here[:4] /= np.linalg.norm(there_T_here[:4])
    there = triangulate(PINHOLE, compose(ORBIT, inverse(there_T_here)), pixels)
    np.testing.assert_allclose(there.points, transform(there_T_here, here.points), atol=1e-7)
    turn = rotation_matrix(there_T_here[:4])
    np.testing.assert_allclose(there.covs, turn @ here.covs @ turn.T, rtol=1e-4, atol=1e-11)


def test_a_view_given_twice_counts_twice(rng):
    pixels = project(PINHOLE, ORBIT[:2], points_seen(rng, 20)) + rng.normal(0, 0.5, (2, 20, 2))
    twice = triangulate(PINHOLE, ORBIT[[0, 1, 1]], pixels[[0, 1, 1]], sigma_px=1.0)
    weighed = triangulate(
        PINHOLE, ORBIT[:2], pixels, sigma_px=np.array([[1.0], [np.sqrt(0.5)]]) * np.ones(20)
    )
    np.testing.assert_allclose(twice.points, weighed.points, atol=1e-8)
    np.testing.assert_allclose(twice.covs, weighed.covs, rtol=1e-5)


def test_driving_ahead_leaves_the_middle_of_the_image_unsure(rng):
    """At the focus of expansion two views of a forward drive say nothing of the distance."""
    poses = forward_poses(2, 0.3)
    points = np.array([[0.0, 0.0, 4.0], [1.2, 0.5, 4.0]])
    found = triangulate(PINHOLE, poses, project(PINHOLE, poses, points) + 1e-3, sigma_px=0.5)
    assert found.at_infinity.tolist() == [True, False]


def test_nothing_is_triangulated_of_nothing():
    found = triangulate(PINHOLE, ORBIT, np.empty((4, 0, 2)))
    assert found.points.shape == (0, 3)
    assert found.ok.shape == (0,)


def test_what_cannot_be_triangulated_is_refused(rng):
    pixels = project(PINHOLE, ORBIT[:2], points_seen(rng, 3))
    with pytest.raises(ShapeError, match="two poses"):
        triangulate(PINHOLE, ORBIT[:1], pixels[:1])
    with pytest.raises(ShapeError, match=r"pixels are \(2, N, 2\)"):
        triangulate(PINHOLE, ORBIT[:2], pixels[0])
    with pytest.raises(ShapeError, match="one a view"):
        triangulate([PINHOLE] * 3, ORBIT[:2], pixels)
    with pytest.raises(ModelError, match="no method"):
        triangulate(PINHOLE, ORBIT[:2], pixels, method="best")
    with pytest.raises(ModelError, match="positive"):
        triangulate(PINHOLE, ORBIT[:2], pixels, sigma_px=0.0)
    with pytest.raises(ShapeError, match="sigma_px"):
        triangulate(PINHOLE, ORBIT[:2], pixels, sigma_px=np.ones(3))
    with pytest.raises(NotPositiveDefiniteError, match="px²"):
        triangulate(PINHOLE, ORBIT[:2], pixels, sigma_px=np.zeros((2, 3, 2, 2)))
    with pytest.raises(ShapeError, match="pose_covs"):
        triangulate(PINHOLE, ORBIT[:2], pixels, pose_covs=np.eye(6))
    with pytest.raises(DataError, match="two finite numbers"):
        triangulate(PINHOLE, ORBIT[:2], np.where(np.arange(2) == 0, np.nan, pixels))
    folded = Camera("brown1", (560, 560, 320, 240), (-0.6,), (640, 480))
    with pytest.raises(DataError, match="no ray"):
        triangulate(folded, ORBIT[:2], pixels + 600.0)


def test_arrays_may_be_laid_out_in_any_way(rng):
    pixels = project(PINHOLE, ORBIT, points_seen(rng, 20))
    covs = np.tile(np.eye(2), (4, 20, 1, 1))
    plain = triangulate(PINHOLE, ORBIT, pixels, sigma_px=covs)
    odd = triangulate(
        PINHOLE, np.asfortranarray(ORBIT), np.asfortranarray(pixels), sigma_px=np.asfortranarray(covs)
    )
    np.testing.assert_array_equal(odd.points, plain.points)
    masked = triangulate(PINHOLE, ORBIT, pixels[:, np.arange(20) > 3], sigma_px=covs[:, np.arange(20) > 3])
    np.testing.assert_array_equal(masked.points, plain.points[4:])
