"""Corners to a hundredth of a pixel, each in a window that its own neighbours allow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision3d.calibrate.detection.lattice import Array, Ids, edge_bends, lattice_axes, spacing_px

__all__ = ["HALF", "Refined", "allowed_px", "refine_saddles"]

HALF = 0.35
"""Half-width of a window in spacings: beyond it the neighbouring corners pull (see docs/camera.md)."""
REACH_PX, SHARP_PX = 8.0, 1.6
"""Largest radius of a window, and the blur up to which it is enough."""
FLOOR_PX = 0.002
"""What is left of a corner where the pixels have no noise: 8 bits, edges that are not quite as modelled."""
LOOSE = 0.6
"""Residual of the fit, relative to the contrast, beyond which a place is no corner."""


@dataclass(frozen=True, slots=True)
class Refined:
    """Corners after the fit; rows of corners that could not be fitted are NaN.

    Attributes
    ----------
    pixels : (N, 2)
    sigma_px : (N,) standard deviation of a coordinate from the noise of the pixels around
    contrast : (N,) half the step from dark to light, grey levels, positive where the quadrants towards
        (+x, -y) and (-x, +y) of the board are light
    blur_px : (N,) standard deviation of the blur
    reach_px : (N,) half-width of the window where it is narrowest
    """

    pixels: Array
    sigma_px: Array
    contrast: Array
    blur_px: Array
    reach_px: Array

    def rows(self, keep: NDArray[np.int64] | NDArray[np.bool_]) -> Refined:
        """Some of the points: indices, or a mask (N,)."""
        return Refined(
            self.pixels[keep], self.sigma_px[keep], self.contrast[keep], self.blur_px[keep],
            self.reach_px[keep],
        )  # fmt: skip


def allowed_px(pixels: Array) -> Array:
    """Half-width of the largest window around each point that keeps its neighbours out, (N,) px."""
    return HALF * spacing_px(pixels)


def refine_saddles(
    grey: NDArray[np.uint8], pixels: Array, ids: Ids, shape: tuple[int, int], inset: float = 1.0
) -> Refined:
    """Fit a blurred saddle at every corner, twice: the first fit says how wide the second may look.

    Parameters
    ----------
    grey : (h, w)
    pixels : (N, 2) starts, good to a quarter of the spacing
    ids : (N,) their numbers on the lattice
    shape : (columns, rows) of the lattice
    inset : how far from the nearer edge of a square pixels are looked at, in spacings
    """
    from vision3d.kernels.saddles import fit_saddles

    image = np.ascontiguousarray(grey, dtype=np.float32)
    start = np.ascontiguousarray(pixels, dtype=np.float64)
    n = len(start)
    corners, covs, facts = np.empty((n, 2)), np.empty((n, 3)), np.empty((n, 5))
    axes, bends = lattice_axes(start, ids, shape), edge_bends(start, ids, shape)
    fit_saddles(image, start, axes, bends, HALF, inset, REACH_PX, corners, covs, facts)
    good = _believable(start, corners, facts, axes)
    reach = REACH_PX
    if good.any():
        start = np.where(good[:, None], corners, start)
        reach = max(REACH_PX, REACH_PX / SHARP_PX * float(np.median(facts[good, 2])))
        axes, bends = lattice_axes(start, ids, shape), edge_bends(start, ids, shape)
        fit_saddles(image, start, axes, bends, HALF, inset, reach, corners, covs, facts)
        good = _believable(np.asarray(pixels, dtype=np.float64), corners, facts, axes)
    sigma = np.sqrt(0.5 * (covs[:, 0] + covs[:, 2]) + FLOOR_PX**2)
    lost = ~good
    for array in (corners, sigma):
        array[lost] = np.nan
    window = np.minimum(reach, HALF * np.linalg.norm(axes, axis=2).min(axis=1))
    return Refined(corners, sigma, facts[:, 1].copy(), facts[:, 2].copy(), window)


def _believable(start: Array, corners: Array, facts: Array, axes: Array) -> NDArray[np.bool_]:
    """Fits that settled near where they began, on something with the contrast of a corner."""
    nearest = np.linalg.norm(axes, axis=2).min(axis=1)
    with np.errstate(invalid="ignore"):
        moved = np.linalg.norm(corners - start, axis=1)
        good: NDArray[np.bool_] = (
            np.isfinite(corners).all(axis=1)
            & (moved <= HALF * nearest)
            & (facts[:, 0] <= LOOSE * np.abs(facts[:, 1]))
            & (np.abs(facts[:, 1]) > 2.0)
        )
    return good
