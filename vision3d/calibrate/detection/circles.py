"""Grids of circles in one image: found, put in order, fitted as ellipses, their bias taken out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from vision3d.boards import CircleGrid
from vision3d.calibrate.detection.circle_lattices import find_lattices
from vision3d.calibrate.detection.conics import circle_images
from vision3d.calibrate.detection.found import Found, NotFound
from vision3d.calibrate.detection.lattice import Array, Ids
from vision3d.calibrate.detection.ordering import Cells, turned_towards
from vision3d.calibrate.detection.refine import FLOOR_PX, LOOSE, Refined
from vision3d.calibrate.detection.search import enlarged, scales
from vision3d.calibrate.detection.smooth import fit_smooth

__all__ = ["find_circle_grid"]

Grey = NDArray[np.uint8]

TOLD_PX = 0.5
"""Perspective bias from which on its correction is said."""
FILLED = 0.7
STIFF, DOUBT = 0.2, 0.5
"""A lens that hardly bends, and what share of the difference that it makes to the bias counts as its sigma:
at the rim of a tilted grid, the grid alone does not tell how much the lens bends."""
BORDER_PX, BORDER_BLURS = 3.5, 3.5
"""How far from a circle's border pixels are looked at: at least, and in standard deviations of the blur."""
OUTER = 1.7
"""How far out a circle's pixels are looked at, in radii, and never past the middle between two circles."""


def find_circle_grid(grey: Grey, board: CircleGrid) -> Found | NotFound:
    """Find the centres of the circles of a grid, dark on light or light on dark.

    The points are images of centres, not centres of images: the difference, which perspective makes, is
    computed from the grid itself and taken out.
    """
    seen = (0, 0)
    for image, scale in scales(grey):
        for dark in (True, False):
            for lattice in find_lattices(image, board, dark=dark):
                if not lattice.ways:
                    seen = max(seen, lattice.size, key=lambda size: size[0] * size[1])
                    continue
                way = turned_towards(lattice.ways)
                if len(way.cells) >= FILLED * board.count:
                    way = Cells(enlarged(way.pixels, scale), way.cells, way.shape)
                    found = _settled(grey, way, board, "dark circles" if dark else "light circles")
                    if found is not None:
                        return found
        if seen[0] * seen[1] >= 0.5 * board.count:
            break
    return NotFound(seen if min(seen) >= 2 else None)


def _settled(grey: Grey, way: Cells, board: CircleGrid, finder: str) -> Found | None:
    """Fit every circle, twice: the second time where the corrected grid puts it."""
    size = (grey.shape[1], grey.shape[0])
    if (smooth := fit_smooth(board.points[way.ids], way.pixels, size)) is None:
        return None
    # places that the growing did not reach are tried as well: the fit decides
    ids, starts = np.arange(board.count), smooth.at(board.points[:, :2])
    starts[way.ids] = way.pixels
    refined, bias = _fitted(grey, starts, ids, board)
    good = np.isfinite(refined.sigma_px)
    if good.sum() < FILLED * len(ids):
        return None
    notes: tuple[str, ...] = ()
    if (largest := float(np.linalg.norm(bias[good], axis=1).max())) > TOLD_PX:
        told = "the centre of an ellipse is not the image of the centre of the circle"
        notes = (f"centres were moved by up to {largest:.2f} px, because {told}",)
    lost = tuple(int(i) for i in ids[~good])
    return Found(ids[good], refined.rows(good), finder, lost, notes=notes)


def _fitted(grey: Grey, starts: Array, ids: Ids, board: CircleGrid) -> tuple[Refined, Array]:
    """Images of the centres with what the noise makes of them, and the bias that was taken out, (N, 2) px."""
    from vision3d.kernels.discs import fit_discs

    image = np.ascontiguousarray(grey, dtype=np.float32)
    plane, radius = board.points[ids, :2], 0.5 * board.diameter_m
    outer = min(OUTER, 0.9 * board.pitch_m / board.diameter_m)
    n = len(ids)
    centres, covs, facts = np.empty((n, 2)), np.empty((n, 3)), np.empty((n, 8))
    at, bias = np.array(starts, dtype=np.float64), np.zeros((n, 2))
    doubt = np.zeros(n)
    good, border = np.zeros(n, dtype=np.bool_), 1.5 * BORDER_PX
    for _ in range(2):
        smooth = fit_smooth(board.points[ids], at, (grey.shape[1], grey.shape[0]))
        if smooth is None:
            raise ModelError(f"a grid of circles has at least four, got {n}")
        bias, shapes = circle_images(smooth.at, plane, radius)
        if (stiff := fit_smooth(board.points[ids], at, (grey.shape[1], grey.shape[0]), STIFF)) is not None:
            doubt = DOUBT * np.linalg.norm(circle_images(stiff.at, plane, radius)[0] - bias, axis=1)
        fit_discs(image, np.ascontiguousarray(at + bias), shapes, outer, border, centres, covs, facts)
        good = _believable(facts, shapes)
        if good.any():
            border = max(BORDER_PX, BORDER_BLURS * float(np.median(facts[good, 2])))
        at = np.where(good[:, None], centres - bias, at)
    sigma = np.sqrt(0.5 * (covs[:, 0] + covs[:, 2]) + FLOOR_PX**2 + doubt**2)
    at[~good], sigma[~good] = np.nan, np.nan
    det = np.maximum(facts[:, 5] * facts[:, 7] - facts[:, 6] ** 2, 1e-12)
    reach = (outer - 1.0) / np.sqrt(np.sqrt(det))
    return Refined(at, sigma, np.abs(facts[:, 1]), facts[:, 2].copy(), reach), bias


def _believable(facts: Array, shapes: Array) -> NDArray[np.bool_]:
    """Fits with the contrast of the others, about the expected ellipse, that did not wander off."""
    contrast = np.abs(facts[:, 1])
    fitted = np.isfinite(contrast)
    if not fitted.any():
        return fitted
    det = [one[..., 0] * one[..., 2] - one[..., 1] ** 2 for one in (facts[:, 5:], shapes)]
    with np.errstate(invalid="ignore"):
        larger = np.sqrt(det[1] / np.maximum(det[0], 1e-12))
        good: NDArray[np.bool_] = (
            fitted
            & (facts[:, 0] <= LOOSE * contrast)
            & (contrast > 0.4 * np.median(contrast[fitted]))
            & (np.abs(np.log(np.maximum(larger, 1e-6))) < LOOSE)
            & (facts[:, 4] < 0.5 / np.sqrt(np.sqrt(det[1])))
        )
    return good
