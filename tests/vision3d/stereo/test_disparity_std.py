"""The standard deviation of disparity and of depth, against rendered truth and the motorcycle's."""

import cv2
import numpy as np
import pytest
from stereo_worlds import facing, photographed, rough_texture

from sequential.manifold import SE3
from vision3d.camera import Camera
from vision3d.render import corridor, desk, ground, render_stereo, wall
from vision3d.stereo import StereoRig, compute_disparity, depth_of, rectify
from vision3d.stereo.calibration_error import with_calibration_error

CAMERA = Camera("pinhole", (300.0, 300.0, 179.5, 134.5), (), (360, 270))
APART = np.array([1.0, 0.0, 0.0, 0.0, -0.12, 0.0, 0.0])
SCENES = {"desk": desk, "corridor": corridor, "ground": ground, "wall": wall}


def spread(values):
    """Standard deviation, by the median: edges of surfaces are outliers to a window."""
    return float(np.median(np.abs(values)) / 0.6745)


@pytest.mark.parametrize("name", SCENES)
def test_errors_are_as_large_as_is_said(name, rng):
    view = render_stereo(CAMERA, CAMERA, APART, SCENES[name](rng), rng=rng)
    found = compute_disparity(view.left.image, view.right.image)
    known = found.valid & np.isfinite(view.disparity)
    error = (found.map_px - view.disparity)[known]
    z = error / found.std_px[known]
    assert 0.75 < spread(z) < 1.3
    assert abs(np.median(z)) < 0.3
    assert (np.abs(z) < 3.0).mean() > 0.85
    # it tells good pixels from bad ones, not only the right size on the whole
    ranked = np.argsort(found.std_px[known])
    third = len(ranked) // 3
    assert spread(error[ranked[-third:]]) > 1.5 * spread(error[ranked[:third]])


def test_more_noise_is_noticed(rng):
    planes = [facing((0.0, 0.0, 3.0), 8.0, rough_texture(rng, 1024), (0.0, 25.0))]
    stds = []
    for noise in (1.0, 2.5, 5.0):
        world = photographed(planes, rng, noise=noise)
        found = compute_disparity(world.left, world.right)
        known = found.valid & ~world.occluded
        stds.append(float(np.median(found.std_px[known])))
        assert 0.7 < spread(((found.map_px - world.disparity) / found.std_px)[known]) < 1.4
    assert stds[0] < stds[1] < stds[2]


def test_the_motorcycle_is_as_sure_as_is_said(data_dir):
    folder = data_dir / "vision" / "motorcycle"
    left, right = (cv2.imread(str(folder / f"motorcycle_{side}.png")) for side in ("left", "right"))
    with np.load(folder / "motorcycle_disp.npz") as held:
        truth = held[held.files[0]]
    found = compute_disparity(left, right)
    known = found.valid & np.isfinite(truth) & (truth > 0)
    assert 0.7 < spread(((found.map_px - truth) / found.std_px)[known]) < 1.4


def test_the_calibrations_part_meets_a_monte_carlo(rng):
    """Depth of fixed pixels while the rig varies as its covariance says."""
    left = Camera("brown5", (300.0, 301.0, 180.0, 133.0), (-0.1, 0.02, 1e-3, 0, 0), (360, 270))
    right = Camera("brown4", (302.0, 301.0, 178.0, 136.0), (-0.09, 0.02, 0, 1e-3), (360, 270))
    pose = SE3().retract(APART, np.array([0.01, -0.02, 0.005, 0.0, 0.002, -0.003]))
    sigma = np.concatenate(
        [
            [4e-4] * 3,
            [2e-4] * 3,
            [0.5] * 4,
            [1e-3, 1e-3, 1e-4, 1e-4, 1e-4],
            [0.5] * 4,
            [1e-3, 1e-3, 1e-4, 1e-4],
        ]
    )
    rig = StereoRig(left, right, pose, np.diag(sigma**2))
    pair = rectify(rig)
    disparity = rng.uniform(4.0, 40.0, (270, 360)).astype(np.float32)
    depth = with_calibration_error(depth_of(disparity, pair.focal_px, pair.baseline_m, pair.doffs_px), pair)
    pixels = np.column_stack([rng.integers(20, 340, 40), rng.integers(20, 250, 40)])
    z = depth.z_m[pixels[:, 1], pixels[:, 0]].astype(np.float64)
    rays = pair.left.unproject(pixels.astype(float))
    points = rays / rays[:, 2:] * z[:, None] @ pair.left_R_rectified.T
    seen = rig.project(points)
    drawn = []
    for _ in range(600):
        step = sigma * rng.standard_normal(len(sigma))
        moved = StereoRig(
            left.with_parameters(left.parameters + step[6:15]),
            right.with_parameters(right.parameters + step[15:]),
            SE3().retract(pose, step[:6]),
        )
        drawn.append(1.0 / (nearest_points(moved, *seen) @ pair.left_R_rectified)[:, 2])
    told = depth.systematic_m[pixels[:, 1], pixels[:, 0]] / z**2
    ratio = told / np.std(drawn, axis=0)
    assert 0.85 < ratio.min() < ratio.max() < 1.15


def nearest_points(rig, left, right):
    """Points (N, 3) nearest to both rays, by solving each pair by itself."""
    found = []
    for a, b in zip(rig.left.unproject(left), rig.right.unproject(right) @ rig.R, strict=True):
        s, t = np.linalg.lstsq(np.column_stack([a, -b]), rig.centre_of_right, rcond=None)[0]
        found.append(0.5 * (s * a + rig.centre_of_right + t * b))
    return np.array(found)


def test_a_rig_without_covariance_adds_nothing(rng):
    pair = rectify(StereoRig(CAMERA, CAMERA, APART))
    depth = depth_of(rng.uniform(1, 9, (270, 360)), pair.focal_px, pair.baseline_m)
    assert with_calibration_error(depth, pair).systematic_m is None
