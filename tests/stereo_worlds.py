"""Rendered pairs of textured planes, with the disparity and the occlusion that is true of every pixel."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from sequential.manifold.quaternion import quaternion_from_matrix, rotation_matrix
from vision3d.camera import Camera
from vision3d.render.scene import Plane, render_planes
from vision3d.render.texture import picture
from vision3d.rigid import compose

CAMERA = Camera("pinhole", (300.0, 300.0, 159.5, 119.5), (), (320, 240))
BASELINE_M = 0.12


@dataclass(frozen=True)
class StereoWorld:
    """A rectified pair; truth (h, w) in pixels of the left picture, NaN where it sees no plane."""

    left: np.ndarray
    right: np.ndarray
    disparity: np.ndarray
    occluded: np.ndarray
    planes: tuple[Plane, ...]
    camera: Camera = CAMERA
    baseline_m: float = BASELINE_M


def rough_texture(rng, size=512, finest=1.0):
    """Grey levels with as much to see at every scale; below `finest` px nothing."""
    levels = np.zeros((size, size))
    for octave in range(7):
        cells = 4 * 2**octave
        noise = rng.standard_normal((cells + 3, cells + 3)).astype(np.float32)
        levels += cv2.resize(noise, (size, size), interpolation=cv2.INTER_CUBIC)
    levels = cv2.GaussianBlur(levels, (0, 0), finest)
    levels = (levels - levels.min()) / np.ptp(levels)
    return (20 + 225 * levels).astype(np.uint8)


def facing(place, width_m, texture, turn_deg=(0.0, 0.0)):
    """A picture at a place (3,), m, turned about x and then about y."""
    a, b = np.radians(turn_deg)
    about_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    pose = np.concatenate([quaternion_from_matrix(about_y @ about_x), place])
    return Plane(pose, picture(texture, width_m))


def room(rng, *, noise=1.5, camera=CAMERA, baseline_m=BASELINE_M):
    """Ground, a slanted wall and two boards in front of it, by the left and the right camera."""
    planes = (
        facing((0.0, 0.0, 6.0), 20.0, rough_texture(rng, 1024), (0.0, 20.0)),
        facing((0.0, 0.8, 6.0), 16.0, rough_texture(rng, 1024), (-90.0, 0.0)),
        facing((-0.45, 0.1, 2.4), 0.8, rough_texture(rng), (0.0, -15.0)),
        facing((0.5, 0.2, 1.7), 0.55, rough_texture(rng), (0.0, 10.0)),
    )
    return photographed(planes, rng, noise=noise, camera=camera, baseline_m=baseline_m)


def photographed(planes, rng, *, noise=1.5, camera=CAMERA, baseline_m=BASELINE_M, right=None):
    """Both pictures of planes, those later in the list before those earlier, and the truth."""
    shift = np.array([1.0, 0, 0, 0, -baseline_m, 0, 0])
    right = camera if right is None else right
    moved = [Plane(compose(shift, one.camera_T_plane), one.texture) for one in planes]
    left_image = render_planes(camera, planes, rng=rng, noise=noise)
    right_image = render_planes(right, moved, rng=rng, noise=noise)
    depth, front = seen(camera, planes)
    disparity = camera.intrinsics[0] * baseline_m / depth - (right.intrinsics[2] - camera.intrinsics[2])
    return StereoWorld(
        left_image, right_image, disparity, _hidden(right, moved, disparity, front), tuple(planes),
        camera, baseline_m,
    )  # fmt: skip


def seen(camera, planes, pixels=None):
    """Depth (N,) along the rays of pixels, and which plane is seen; all pixels (h, w) by default."""
    if pixels is None:
        pixels = np.stack(np.meshgrid(*(np.arange(side, dtype=float) for side in camera.size)), axis=-1)
    rays = np.concatenate([camera.undistort_points(pixels), np.ones((*pixels.shape[:-1], 1))], axis=-1)
    depth = np.full(pixels.shape[:-1], np.nan)
    front = np.full(pixels.shape[:-1], -1)
    for k, plane in enumerate(planes):
        turn = rotation_matrix(plane.camera_T_plane[:4])
        place = plane.camera_T_plane[4:]
        with np.errstate(divide="ignore", invalid="ignore"):
            z = (place @ turn[:, 2]) / (rays @ turn[:, 2])
            at = (rays * z[..., None] - place) @ turn
        half_w, half_h = 0.5 * np.array(plane.texture.size_m)
        hit = (z > 0) & (np.abs(at[..., 0]) <= half_w) & (np.abs(at[..., 1]) <= half_h)
        depth[hit], front[hit] = z[hit], k
    return depth, front


def _hidden(right, moved, disparity, front):
    """Where the right camera sees another plane, or nothing, at the pixel's match."""
    rows, columns = np.indices(disparity.shape)
    at = columns - np.nan_to_num(disparity)
    _, there = seen(right, moved, np.stack([at, rows], axis=-1).astype(float))
    return (there != front) | (at < 0) | (at > right.size[0] - 1) | (front < 0)
