"""Views of a board whose truth is known: corners projected exactly, then noise added."""

from dataclasses import dataclass

import numpy as np

from sequential.manifold import SE3
from sequential.manifold.quaternion import quaternion_exp, quaternion_from_matrix, rotate
from vision3d.camera import Camera
from vision3d.views import View

SIZE = (640, 480)
CAMERAS = {
    "pinhole": Camera("pinhole", (533.0, 531.0, 342.0, 234.0), (), SIZE),
    "brown1": Camera("brown1", (533.0, 531.0, 342.0, 234.0), (-0.2,), SIZE),
    "brown2": Camera("brown2", (533.0, 531.0, 342.0, 234.0), (-0.28, 0.09), SIZE),
    "brown4": Camera("brown4", (533.0, 531.0, 342.0, 234.0), (-0.28, 0.09, 0.0012, -0.0006), SIZE),
    "brown5": Camera("brown5", (533.0, 531.0, 342.0, 234.0), (-0.28, 0.02, 0.0012, -0.0006, 0.16), SIZE),
    "rational8": Camera(
        "rational8", (533.0, 531.0, 342.0, 234.0), (0.3, 0.1, 0.001, -0.0005, 0.01, 0.6, 0.2, 0.02), SIZE
    ),
    "thin12": Camera(
        "thin12",
        (533.0, 531.0, 342.0, 234.0),
        (0.3, 0.1, 0.001, -0.0005, 0.01, 0.6, 0.2, 0.02, 0.002, -0.001, 0.001, 0.0005),
        SIZE,
    ),
    "fisheye4": Camera("fisheye4", (240.0, 239.0, 322.0, 236.0), (-0.02, 0.01, -0.004, 0.0005), SIZE),
}


def board(columns=9, rows=6, square_m=0.025):
    """Inner corners of a checkerboard, (columns * rows, 3)."""
    at = np.zeros((columns * rows, 3))
    at[:, :2] = np.mgrid[0:columns, 0:rows].T.reshape(-1, 2) * square_m
    return at


def poses_in_view(camera, points, n, rng, tilt_rad=0.45, margin_px=5.0):
    """Random poses at which the camera sees the whole board."""
    found, middle = [], points.mean(axis=0)
    reach = np.linalg.norm(points - middle, axis=1).max()
    focal = camera.intrinsics[0]
    while len(found) < n:
        turn = quaternion_exp(rng.normal(0.0, tilt_rad, 3))
        depth = reach * focal / camera.size[1] * rng.uniform(1.3, 3.5)
        if camera.lens == "fisheye4":
            # anywhere in a field of view of 180°, turned to face the camera
            axis = rng.normal(0.0, 1.0, 2)
            towards = quaternion_exp(np.array([*axis, 0.0]) * rng.uniform(0.0, 1.2) / np.linalg.norm(axis))
            centre = rotate(towards, np.array([0.0, 0.0, 2.5 * reach * rng.uniform(0.7, 1.6)]))
            matrix = np.stack([rotate(towards, rotate(turn, e)) for e in np.eye(3)], axis=-1)
            turn = quaternion_from_matrix(matrix)
        else:
            pixel = rng.uniform((0.0, 0.0), camera.size)
            ray = (pixel - camera.intrinsics[2:]) / camera.intrinsics[:2]
            centre = depth * np.array([*ray, 1.0])
        pose = np.concatenate([turn, centre - rotate(turn, middle)])
        pixels = camera.project(rotate(pose[:4], points) + pose[4:])
        low, high = margin_px, np.array(camera.size) - 1 - margin_px
        if np.isfinite(pixels).all() and (pixels > low).all() and (pixels < high).all():
            found.append(pose)
    return SE3().normalize(np.array(found))


@dataclass
class World:
    """A camera, poses of a board, and the exact corners (V, N, 2)."""

    camera: Camera
    points: np.ndarray
    poses: np.ndarray
    exact: np.ndarray

    def views(self, rng, sigma_px=0.2, stated_px=None):
        """Views with Gaussian noise."""
        stated = sigma_px if stated_px is None else stated_px
        return tuple(
            View(
                f"view {v}",
                self.camera.size,
                self.points,
                pixels + sigma_px * rng.standard_normal(pixels.shape),
                np.arange(len(self.points)),
                max(stated, 1e-3),
            )
            for v, pixels in enumerate(self.exact)
        )


def world(lens="brown5", n=13, seed=3, points=None, camera=None, warp=(0.0, 0.0), **options):
    """Make one."""
    rng = np.random.default_rng(seed)
    camera = CAMERAS[lens] if camera is None else camera
    points = board() if points is None else points
    poses = poses_in_view(camera, points, n, rng, **options)
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    rise = 1.0 - ((points[:, :2] - 0.5 * (low + high)) / (0.5 * (high - low))) ** 2
    bent = points + np.column_stack([np.zeros((len(points), 2)), rise @ np.asarray(warp)])
    exact = np.array([camera.project(rotate(pose[:4], bent) + pose[4:]) for pose in poses])
    return World(camera, points, poses, exact)
