"""Worlds in front of two cameras, projected exactly and then made noisy: what tests of two views ask for."""

from dataclasses import dataclass

import numpy as np

from sequential.manifold.quaternion import quaternion_exp, rotation_matrix
from vision3d.camera import Camera
from vision3d.rigid import transform
from vision3d.two_view.motion import motion

__all__ = ["PINHOLE", "TwoViewWorld", "distorted", "random_motion", "world"]

PINHOLE = Camera("pinhole", (520.0, 525.0, 321.0, 238.0), (), (640, 480))
distorted = Camera("brown5", (533.0, 534.0, 342.0, 234.0), (-0.28, 0.03, 0.0012, -0.0001, 0.16), (640, 480))


@dataclass(frozen=True)
class TwoViewWorld:
    camera: Camera
    b_T_a: np.ndarray  # (7,), translation of length one where it moved
    points_a: np.ndarray
    pixels_a: np.ndarray
    pixels_b: np.ndarray
    right: np.ndarray  # (N,) bool


def random_motion(rng, turn=0.2):
    t = rng.standard_normal(3) * [1.0, 1.0, 0.5]
    return motion(rotation_matrix(quaternion_exp(turn * rng.standard_normal(3))), t)


def world(
    rng, *, shape="space", count=200, wrong=0.0, sigma_px=0.3, camera=PINHOLE, baseline=0.15, still=False
):
    """Points 1 to 3 units ahead; `shape` is "space", "plane", or "turn" for a camera that only turns."""
    b_T_a = random_motion(rng, 0.08)
    if shape == "turn":
        b_T_a[4:] = 0.0
    if still:
        b_T_a = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    true = b_T_a.copy()
    true[4:] *= baseline
    found = np.empty((0, 3))
    while len(found) < count:
        pixels = rng.uniform([20, 20], [620, 460], (4 * count, 2))
        rays = camera.unproject(pixels)
        depth = rng.uniform(1.0, 3.0, len(rays))
        if shape == "plane":
            depth = 2.0 / (rays @ np.array([0.25, -0.15, 1.0]))
        points = rays * depth[:, None]
        seen = camera.project(transform(true, points))
        inside = np.isfinite(seen).all(axis=1) & (np.abs(seen - [320, 240]) < [310, 230]).all(axis=1)
        found = np.vstack([found, points[inside]])
    points = found[:count]
    a = camera.project(points) + sigma_px * rng.standard_normal((count, 2))
    b = camera.project(transform(true, points)) + sigma_px * rng.standard_normal((count, 2))
    right = rng.random(count) >= wrong
    b[~right] = rng.uniform([0, 0], [640, 480], (int((~right).sum()), 2))
    return TwoViewWorld(camera, b_T_a, points / baseline, a, b, right)
