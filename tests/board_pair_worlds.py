"""Pairs of views whose truth is known: a board seen by both cameras of a rig, corners exact or noisy."""

from dataclasses import dataclass

import numpy as np
from calibration_worlds import board, poses_in_view
from rig_worlds import SIDE_BY_SIDE

from vision3d.rigid import compose, transform
from vision3d.stereo import StereoRig
from vision3d.stereo.view_pairs import ViewPair, pairs_of_views
from vision3d.views import View


@dataclass
class StereoWorld:
    """A rig, poses of a board in its left camera (V, 7), and the exact corners of both images (V, N, 2)."""

    rig: StereoRig
    points: np.ndarray
    poses: np.ndarray
    left: np.ndarray
    right: np.ndarray

    def pairs(self, rng, sigma_px=(0.1, 0.1), stated_px=None) -> tuple[ViewPair, ...]:
        """Pairs of views with Gaussian noise, of its own for each camera."""
        stated = sigma_px if stated_px is None else stated_px
        sides = []
        for name, exact, camera, sigma, said in zip(
            ("left", "right"),
            (self.left, self.right),
            (self.rig.left, self.rig.right),
            sigma_px,
            stated,
            strict=True,
        ):
            noisy = exact + sigma * rng.standard_normal(exact.shape)
            sides.append([self.view(f"{name}{v:02d}", camera, one, said) for v, one in enumerate(noisy)])
        return pairs_of_views(*sides)

    def view(self, name, camera, pixels, sigma_px):
        """A view of the whole board."""
        return View(name, camera.size, self.points, pixels, np.arange(len(self.points)), max(sigma_px, 1e-3))


def stereo_world(rig=SIDE_BY_SIDE, n=12, seed=5, columns=9, rows=6):
    """A world of n pairs in which both cameras see the whole board."""
    rng, points = np.random.default_rng(seed), board(columns, rows)
    found = []
    while len(found) < n:
        pose = poses_in_view(rig.left, points, 1, rng)[0]
        right = rig.right.project(transform(compose(rig.right_T_left, pose), points))
        inside = (right > 5.0).all() and (right < np.array(rig.right.size) - 6.0).all()
        if np.isfinite(right).all() and inside:
            found.append(pose)
    poses = np.array(found)
    both = [rig.project(transform(pose, points)) for pose in poses]
    return StereoWorld(rig, points, poses, *(np.array([one[k] for one in both]) for k in (0, 1)))
