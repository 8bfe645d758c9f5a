"""Every reading of matched pairs: the best essential matrix, homography and rotation, and what they cost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vision3d.camera import Array
from vision3d.robust.search import Found
from vision3d.two_view.motion import decompose_essential, motion
from vision3d.two_view.noise import fit_noise
from vision3d.two_view.planes import PlaneMotion, decompose_homography
from vision3d.two_view.refinement import (
    refine_motion,
    sampson_distances,
)
from vision3d.two_view.search import samples_for, search_rays
from vision3d.two_view.selection import Criterion, choose_model

__all__ = ["Readings", "read_pairs", "robust_sigma", "settled"]

CHI2 = {1: (0.4549364, 9.0, 0.9733), 2: (1.3862944, 11.83, 0.9840)}
"""Of chi² with one or two degrees of freedom: median, what 99.7 % are below, and their mean over all."""
CLIPPINGS, HARDLY_MORE = 5, 1.2
ROUNDS, FEWEST, AGAIN = 6, 6, 250
WORTH = 0.5
"""Share of the pairs in space that a plane or a turn must hold to be worth a name."""
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
    """Noise of a coordinate, from squared distances of pairs that agree: root mean square within 3 sigmas.

    `dims` is how many coordinates a distance has; infinite from too few pairs.
    """
    spare = len(squared) - parameters / dims
    if spare < 1.0:
        return np.inf
    median, within, clipped = CHI2[dims]
    variance = float(np.median(squared)) / median
    for _ in range(CLIPPINGS):
        variance = float(np.mean(squared[squared <= within * variance])) / (dims * clipped)
    return max(SIGMA_LEAST, float(np.sqrt(variance * len(squared) / spare)))


def _common_sigma(squared: Array, flat: Array, turned: Array, threshold: float) -> float:
    """The noise of the motion, or that of a simpler model which needs hardly more.

    A motion's errors are across its lines only and follow what they can; where a turn or a plane leaves
    nearly as little in both directions, that is the noise, and its tails are no parallax.
    """
    limit = threshold**2
    least = robust_sigma(squared[squared < limit], 5)
    simpler = (robust_sigma(flat[flat < 2.0 * limit], 8, 2), robust_sigma(turned[turned < 2.0 * limit], 3, 2))
    near = [one for one in simpler if one < HARDLY_MORE * least]
    return max([least, *near]) if np.isfinite(least) else SIGMA_LEAST


def read_pairs(
    rows: Array,
    threshold: float,
    size: tuple[int, int],
    rng: np.random.Generator,
    *,
    budget: int,
    best_first: bool = False,
) -> Readings:
    """Search for every model, and refine each motion that one of them stands for.

    `size` is the width and height of picture b, px: what chance has to choose from.
    """
    essentials = _essentials(rows, threshold, rng, budget=budget, best_first=best_first)
    share = max((float(np.mean(one.errors2 < threshold**2)) for one in essentials), default=1.0)
    homography, rotation = (
        search_rays(rows, kind, threshold, rng, budget=samples_for(WORTH * share, kind, budget))
        for kind in ("homography", "rotation")
    )
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
    sigma = _common_sigma(squared, flat, turned, threshold)
    told = [found for found in (*essentials, homography, rotation) if found is not None]
    distances = {"general": squared, "planar": flat, "pure rotation": turned}
    return Readings(
        rows, threshold, b_T_a, H, R, planes, squared, flat, turned,
        choose_model(distances, sigma, threshold, size),
        sum(found.iterations for found in told), told[0].stopped if told else "nothing to search",
    )  # fmt: skip


def _essentials(
    rows: Array, threshold: float, rng: np.random.Generator, *, budget: int, best_first: bool
) -> list[Found]:
    """Essential matrices of several searches, where the first one ended early."""
    found: list[Found] = []
    for _ in range(SEARCHES):
        one = search_rays(rows, "essential", threshold, rng, budget=budget, best_first=best_first)
        if one is not None:
            found.append(one)
        if one is None or one.stopped == "budget spent":
            break
        budget = min(budget, 4 * max(one.iterations, AGAIN))
    return found


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
