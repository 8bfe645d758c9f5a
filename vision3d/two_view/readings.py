"""Every reading of matched pairs: the best essential matrix, homography and rotation, and what they cost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vision3d.camera import Array
from vision3d.two_view.motion import decompose_essential, motion
from vision3d.two_view.noise import fit_noise
from vision3d.two_view.planes import PlaneMotion, decompose_homography
from vision3d.two_view.refinement import (
    refine_motion,
    sampson_distances,
)
from vision3d.two_view.search import search_rays
from vision3d.two_view.selection import Criterion, choose_model

__all__ = ["Readings", "read_pairs", "robust_sigma", "settled"]

CHI2_MEDIAN = {1: 0.4549364, 2: 1.3862944}
ENOUGH = 10.0
ROUNDS, FEWEST = 4, 6
SEARCHES = 5
"""For an essential matrix: where a plane holds most pairs, a search may end in a motion that fits it only."""
AHEAD = np.array([0.0, 0.0, 1.0])
SIGMA_LEAST = 1e-6
PLANE_FEWEST = 6


@dataclass(frozen=True, slots=True)
class Readings:
    """What pairs of rays may mean.

    Parameters
    ----------
    rows : (N, 18) pairs
    threshold : distance up to which a pair agrees, in the unit of the rows
    motion : (7,) the best, in front of the cameras or not
    H, R : (3, 3) homography and rotation of rays
    planes : motions that the homography stands for
    motion_squared, homography_squared, rotation_squared : (N,) squared distances
    criterion : Torr's
    trials : samples drawn in all
    stopped : why the search for the essential matrix ended
    """

    rows: Array
    threshold: float
    motion: Array
    H: Array
    R: Array
    planes: tuple[PlaneMotion, ...]
    motion_squared: Array
    homography_squared: Array
    rotation_squared: Array
    criterion: Criterion
    trials: int
    stopped: str


def robust_sigma(squared: Array, parameters: int, dims: int = 1) -> float:
    """Noise of a coordinate from squared distances of pairs that agree, by their median; inf from too few."""
    spare = len(squared) - parameters / dims
    if spare < ENOUGH:
        return np.inf
    median = float(np.median(squared)) / CHI2_MEDIAN[dims]
    return max(SIGMA_LEAST, float(np.sqrt(median * len(squared) / spare)))


def read_pairs(rows: Array, threshold: float, size: tuple[int, int], rng: np.random.Generator) -> Readings:
    """Search for every model, and refine each motion that one of them stands for.

    `size` is the width and height of picture b, px: what chance has to choose from.
    """
    homography, rotation = (search_rays(rows, kind, threshold, rng) for kind in ("homography", "rotation"))
    essentials = [
        found
        for _ in range(SEARCHES)
        if (found := search_rays(rows, "essential", threshold, rng)) is not None
    ]
    never = np.full(len(rows), np.inf)
    planes: tuple[PlaneMotion, ...] = ()
    H, flat = np.eye(3), never
    if homography is not None:
        H, flat = homography.model.reshape(3, 3), homography.errors2
        on_plane = flat < 2.0 * threshold**2
        if on_plane.sum() >= PLANE_FEWEST:
            planes = decompose_homography(H, rows[on_plane, :3], rows[on_plane, 3:6])
    R, turned = (np.eye(3), never) if rotation is None else (rotation.model.reshape(3, 3), rotation.errors2)
    starts = [motion(one.R, one.t) for one in planes if np.linalg.norm(one.t) > 0.0]
    starts += [decompose_essential(found.model.reshape(3, 3))[0] for found in essentials]
    b_T_a, squared = _best_motion(rows, threshold, starts) if starts else (motion(R, AHEAD), never)
    sigma = min(
        robust_sigma(squared[squared < threshold**2], 5), robust_sigma(flat[flat < 2.0 * threshold**2], 8, 2)
    )
    told = [found for found in (*essentials, homography, rotation) if found is not None]
    distances = {"general": squared, "planar": flat, "pure rotation": turned}
    return Readings(
        rows, threshold, b_T_a, H, R, planes, squared, flat, turned,
        choose_model(distances, sigma, threshold, size),
        sum(found.iterations for found in told), told[0].stopped if told else "nothing to search",
    )  # fmt: skip


def _best_motion(rows: Array, threshold: float, starts: list[Array]) -> tuple[Array, Array]:
    """The most likely of the motions that the essential matrices or a plane lead to, and its distances."""
    ends = [settled(rows, one, threshold) for one in starts]
    lead = min(ends, key=lambda end: float(np.minimum(end[1], threshold**2).sum()))
    noise = fit_noise(lead[1][lead[1] < threshold**2])
    return min(ends, key=lambda end: noise.cost(end[1], threshold**2))


def settled(rows: Array, b_T_a: Array, threshold: float) -> tuple[Array, Array]:
    """A motion after rounds of weighted least squares on the pairs that agree, and its distances."""
    squared = sampson_distances(rows, b_T_a)
    for _ in range(ROUNDS):
        agree = squared < threshold**2
        if agree.sum() < FEWEST:
            break
        scale = fit_noise(squared[agree]).cauchy
        b_T_a = refine_motion(rows[agree], b_T_a, loss="cauchy", scale=scale).parameters
        squared = sampson_distances(rows, b_T_a)
    return b_T_a, squared
