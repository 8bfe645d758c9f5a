"""The focal length of pictures that do not say: the one under which pairs of pictures have a rigid motion.

A fundamental matrix needs no focal length; the essential matrix that it stands for exists only where rays are
the right ones.  So for the pairs with most matches the first is found once, and for a range of focal lengths
the motion nearest to it is refined: the cost is least at the right one.  Seven values, and a parabola through
the best three.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FactorlabError
from vision3d.camera import Camera
from vision3d.ray_pairs import ray_pairs
from vision3d.robust import RansacSettings
from vision3d.robust.fundamental import fit_fundamental
from vision3d.sfm.growth import Scene
from vision3d.two_view import recover_pose
from vision3d.two_view.refinement import refine_motion

__all__ = ["sweep_focal"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

SHARES = np.geomspace(0.5, 2.0, 7)
"""Of the longer side: 90° to 28° across."""
PAIRS, LEAST = 8, 30
FITS, DOUBTS = RansacSettings(threshold=2.0), 2.0


def sweep_focal(
    scene: Scene, matches: Mapping[tuple[int, int], Integers], unknown: NDArray[np.bool_]
) -> tuple[Camera, ...]:
    """The cameras, those with an unknown focal length at the share of their longer side that fits best.

    Parameters
    ----------
    scene : images, features and cameras
    matches : tentative, for pairs of images
    unknown : (C,) cameras whose focal length is a guess
    """
    if not unknown.any():
        return scene.cameras
    able = [pair for pair in matches if len(matches[pair]) >= LEAST]
    costs = np.zeros(len(SHARES))
    for pair in sorted(able, key=lambda pair: -len(matches[pair]))[:PAIRS]:
        costs += _costs(scene, unknown, pair, matches[pair])
    best = int(np.argmin(costs))
    if costs.min() == costs.max():
        return scene.cameras
    share = SHARES[best] * np.exp(_vertex(costs, best) * np.log(SHARES[1] / SHARES[0]))
    return _with_share(scene, unknown, float(share))


def _with_share(scene: Scene, unknown: NDArray[np.bool_], share: float) -> tuple[Camera, ...]:
    cameras = []
    for camera, guess in zip(scene.cameras, unknown, strict=True):
        focal = share * max(camera.size)
        own = np.concatenate([[focal, focal], camera.parameters[2:]])
        cameras.append(camera.with_parameters(own) if guess else camera)
    return tuple(cameras)


def _costs(scene: Scene, unknown: NDArray[np.bool_], pair: tuple[int, int], rows: Integers) -> Array:
    """The robust cost of a pair's best motion at every focal length; zeros where there is none."""
    (a, b), none = pair, np.zeros(len(SHARES))
    pixels_a, pixels_b = scene.pixels[a][rows[:, 0]], scene.pixels[b][rows[:, 1]]
    try:
        found = fit_fundamental(pixels_a, pixels_b, FITS)
    except FactorlabError:
        return none
    if found.count < LEAST:
        return none
    agree, costs = found.inliers, []
    for share in SHARES:
        cameras = _with_share(scene, unknown, float(share))
        ours, theirs = cameras[scene.camera_of[a]], cameras[scene.camera_of[b]]
        costs.append(_cost(ours, theirs, pixels_a[agree], pixels_b[agree], found.model))
    return np.array(costs) if np.isfinite(costs).all() else none


def _cost(camera_a: Camera, camera_b: Camera, pixels_a: Array, pixels_b: Array, F: Array) -> float:
    """The robust cost of the motion nearest to a fundamental matrix; inf where there is none."""
    rows, seen = ray_pairs(camera_a, camera_b, pixels_a, pixels_b, 1.0)
    rows = np.ascontiguousarray(rows[seen])
    try:
        start = recover_pose(camera_b.matrix.T @ F @ camera_a.matrix, rows[:, :3], rows[:, 3:6]).b_T_a
    except FactorlabError:
        return np.inf
    return float(refine_motion(rows, start, loss="cauchy", scale=DOUBTS).cost)


def _vertex(costs: Array, best: int) -> float:
    """Where the parabola through the least cost and its neighbours has its bottom, in steps from there."""
    if best in (0, len(costs) - 1):
        return 0.0
    before, least, after = costs[best - 1 : best + 2]
    bend = before - 2.0 * least + after
    return float(0.5 * (before - after) / bend) if bend > 0.0 else 0.0
