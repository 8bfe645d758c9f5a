"""The small camera's compiled view of a line: the same photograph as the renderer of any plane takes."""

from itertools import pairwise

import numpy as np
import pytest

from sequential.errors import ModelError, ShapeError
from vision3d.camera import Camera
from vision3d.lines import CameraMount, GroundHomography, planar_pose
from vision3d.render import GroundLine, GroundView, random_line
from vision3d.render.scene import Plane, radiance_of

CAMERA = Camera("pinhole", (50.0, 50.0, 29.5, 19.5), (), (60, 40))
MOUNTS = {
    "level": CameraMount(0.15, 0.7, forward_m=0.05),
    "askew": CameraMount(0.2, 0.6, roll_rad=0.2, left_m=0.03, yaw_rad=-0.2),
}


def slow(mount, line, pose):
    """Radiance from the distance field that `render_ground` paints."""
    return radiance_of(CAMERA, [Plane(mount.world_pose(planar_pose(*pose)), line.texture)])


@pytest.mark.parametrize("mount", MOUNTS)
@pytest.mark.parametrize("width", [0.02, 0.05])
def test_agrees_with_the_renderer_of_planes(mount, width, rng):
    line = random_line(rng, width_m=width)
    view = GroundView(CAMERA, MOUNTS[mount])
    for s in (0.3, 1.1, 2.0):
        pose = line.at(s) + rng.normal(0.0, [0.0, 0.03, 0.2])
        off = np.abs(view.radiance(line, pose) - slow(MOUNTS[mount], line, pose))
        # of a difference of 0.58 between ink and floor; the other samples a field on a grid of a centimetre
        assert off.max() < 0.1
        assert off.mean() < 5e-4


def sampled(camera, mount, line, pose, fine=12):
    """Radiance from the distance of many points in each pixel to every segment of the line."""
    ground = GroundHomography.from_camera(camera, mount)
    inside = (np.arange(fine) + 0.5) / fine - 0.5
    v, u, dv, du = np.meshgrid(np.arange(40), np.arange(60), inside, inside, indexing="ij")
    local = ground.to_ground(np.column_stack([(u + du).ravel(), (v + dv).ravel()])).xy
    c, s = np.cos(pose[2]), np.sin(pose[2])
    places = pose[:2] + local @ np.array([[c, s], [-s, c]])
    near = line.points[np.linalg.norm(line.points - pose[:2], axis=1) < 0.8]
    nearest = np.full(len(places), np.inf)
    for start, end in pairwise(near):
        step = end - start
        t = np.clip((places - start) @ step / (step @ step), 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(places - start - t[:, None] * step, axis=1))
    dark = (nearest < 0.5 * line.width_m).reshape(40, 60, -1).mean(axis=2)
    return line.floor + dark * (line.ink - line.floor)


def test_agrees_with_sampling_every_pixel(rng):
    line = random_line(rng, width_m=0.02, length_m=2.0)
    pose = line.at(0.7) + np.array([0.0, 0.02, 0.2])
    mount = MOUNTS["level"]
    off = np.abs(GroundView(CAMERA, mount).radiance(line, pose) - sampled(CAMERA, mount, line, pose))
    assert off.max() < 0.03
    assert off.mean() < 5e-4


def test_a_straight_edge_is_exact():
    # looking straight down, a line along the image's columns, half a pixel off its grid and a pixel wide
    mount = CameraMount(0.5, np.pi / 2)
    view = GroundView(CAMERA, mount)
    pixel = 0.5 / 50.0
    line = GroundLine(np.array([[-2.0, 0.25 * pixel], [2.0, 0.25 * pixel]]), pixel, ink=0.0, floor=1.0)
    shares = 1.0 - view.radiance(line, np.zeros(3))
    np.testing.assert_allclose(shares[:, 29], 0.75, atol=1e-9)
    np.testing.assert_allclose(shares[:, 30], 0.25, atol=1e-9)
    np.testing.assert_allclose(np.delete(shares, [29, 30], axis=1), 0.0, atol=1e-9)


def test_ink_is_kept_as_the_robot_turns():
    # looking straight down, the stripe's area in the image is its width times the way across the disc
    mount = CameraMount(0.5, np.pi / 2)
    view = GroundView(CAMERA, mount)
    line = GroundLine(np.array([[-2.0, 0.0], [2.0, 0.0]]), 0.03, ink=0.0, floor=1.0)
    # a window of 40 by 40 px lies in the image; turned by an eighth it is crossed along its diagonal
    upright = (1.0 - view.radiance(line, np.array([0.0, 0.0, 0.0]))).sum()
    across = (1.0 - view.radiance(line, np.array([0.0, 0.0, np.pi / 2]))).sum()
    assert upright == pytest.approx(40 * 3.0, rel=1e-9)
    assert across == pytest.approx(60 * 3.0, rel=1e-9)


def test_blur_is_the_mean_over_the_shutter(rng):
    line, view = random_line(rng, width_m=0.02), GroundView(CAMERA, MOUNTS["level"])
    poses = line.at(np.linspace(1.0, 1.05, 7))
    each = np.mean([view.radiance(line, pose) for pose in poses], axis=0)
    np.testing.assert_allclose(view.radiance(line, poses), each, atol=1e-12)


def test_two_branches_are_both_seen():
    u = np.linspace(-0.3, 0.6, 60)
    loop = np.vstack([np.column_stack([u, 0.03 + 0 * u]), np.column_stack([u[::-1], -0.03 + 0 * u])])
    view = GroundView(CAMERA, MOUNTS["level"])
    dark = view.radiance(GroundLine(loop, 0.02), np.zeros(3))[30] < 0.4
    assert np.sum(np.diff(dark.astype(int)) == 1) == 2


def test_above_the_horizon_is_the_ground_s_level():
    view = GroundView(CAMERA, CameraMount(0.15, 0.1))
    assert np.isnan(view.centres[0]).all()
    image = view.radiance(GroundLine(np.array([[-1.0, 0.0], [50.0, 0.0]]), 0.05), np.zeros(3))
    np.testing.assert_array_equal(image[0], 0.7)
    assert image[-1].min() < 0.2


def test_noise_is_as_strong_as_said(rng):
    view = GroundView(CAMERA, MOUNTS["level"])
    far = GroundLine(np.array([[50.0, 0.0], [51.0, 0.0]]), ink=0.1, floor=0.5)
    image = view.image(far, np.zeros(3), rng=rng, noise=10.0).astype(float)
    assert image.std() == pytest.approx(10.0, rel=0.06)
    assert image.mean() == pytest.approx(0.5 * 235, abs=1.0)
    quiet = view.image(far, np.zeros(3), noise=10.0)
    assert (quiet == quiet[0, 0]).all(), "without a generator there is no noise"


@pytest.mark.parametrize("poses", [np.zeros(2), np.zeros((0, 3)), np.full(3, np.nan), np.zeros((2, 2, 3))])
def test_refuses_poses_that_are_none(poses):
    view, line = GroundView(CAMERA, MOUNTS["level"]), GroundLine(np.array([[0.0, 0.0], [1.0, 0.0]]))
    with pytest.raises(ShapeError, match="poses of a robot"):
        view.radiance(line, poses)


def test_refuses_a_noise_below_zero():
    view, line = GroundView(CAMERA, MOUNTS["level"]), GroundLine(np.array([[0.0, 0.0], [1.0, 0.0]]))
    with pytest.raises(ModelError, match="grey levels"):
        view.image(line, np.zeros(3), noise=-1.0)
