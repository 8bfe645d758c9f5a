"""Rendered pairs of scenes: matched as a user would, triangulated, and compared with the surfaces shown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vision3d.camera import Camera
from vision3d.features import detect_features, match_features, refine_matches
from vision3d.render import SCENES, orbit_poses, render_journey, sideways_poses, surface_points
from vision3d.triangulate import Triangulation, triangulate
from vision3d.variance_factor import variance_factor

CAMERA = Camera("brown4", (560.0, 560.0, 319.5, 239.5), (-0.1, 0.02, 0.0, 0.0), (640, 480))
RADIUS_PX = 5  # of the patches: small, for surfaces end and bend
GATE = 6.63  # 99 % of a residual across the epipolar line
JUMP, NEAR_PX = 0.04, 10  # depths of neighbours that differ by this share; how near such a place is an edge


@dataclass(frozen=True)
class Measured:
    """Points of one pair.

    nees : (n,) normalised estimation error squared over 3, as declared, of points that passed the gates
    edge : (n,) whether a jump of depth is within `NEAR_PX` of the feature
    factor : of the variance of the noise, as the residuals across the epipolar lines tell it
    found : everything that was triangulated
    """

    nees: np.ndarray
    edge: np.ndarray
    factor: float
    found: Triangulation


def measured_pair(name: str, rng: np.random.Generator, kind: str = "sift", **settings: float) -> Measured:
    """Render two photographs of a scene, find and match features, refine, triangulate, judge.

    A match says what a pixel of the first image shows.  Half of its covariance goes to each image, so that
    the noise of both is counted once; truth is where the ray of the first pixel meets the surface.
    """
    scene = SCENES[name](rng)
    poses = (
        sideways_poses(2, 0.15)
        if name in ("corridor", "ground")
        else orbit_poses((0, 0.1, 1.6), 1.6, 2, arc_rad=0.12)
    )
    a, b = render_journey(CAMERA, poses, scene, rng=rng, **settings)
    first, second = detect_features(a.image, kind), detect_features(b.image, kind)
    matches = match_features(first, second)
    pixels, start = matches.points(first, second)
    warps = matches.warps(first, second)
    there, cov, ok = refine_matches(a.image, b.image, pixels, start, warps=warps, radius_px=RADIUS_PX)
    pixels, there, half = pixels[ok], there[ok], 0.5 * cov[ok]
    found = triangulate(CAMERA, poses, np.stack([pixels, there]), sigma_px=np.stack([half, half]))
    factor = variance_factor(found.chi2[found.ok], found.dof[found.ok])
    truth, _ = surface_points(CAMERA, poses[0], scene, pixels)
    kept = found.ok & (found.chi2 < GATE) & np.isfinite(truth).all(axis=1)
    error = (found.points - truth)[kept]
    nees = np.einsum("ni,nij,nj->n", error, np.linalg.inv(found.covs[kept]), error) / 3
    return Measured(nees, near_edges(a.depth, pixels[kept]), factor, found)


def near_edges(depth: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """Whether the depth (h, w) jumps near pixels (N, 2)."""
    import cv2

    filled = np.nan_to_num(depth, nan=1e3).astype(np.float32)
    small = np.ones((3, 3), np.uint8)
    jumps = cv2.dilate(filled, small) - cv2.erode(filled, small) > JUMP * filled
    wide = np.ones((2 * NEAR_PX + 1, 2 * NEAR_PX + 1), np.uint8)
    near = cv2.dilate(jumps.astype(np.uint8), wide) > 0
    x, y = np.rint(pixels).astype(int).T
    return near[y, x]
