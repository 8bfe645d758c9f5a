"""A finder of checkerboard grids of any size, whole or in part.

Saddles of the light are candidates; a ring of light around each says whether four quadrants meet there and
where its edges go; a lattice is grown from the clearest candidate by predicting each next corner from those
before it.  In spirit of Geiger et al. 2012, "Automatic camera and range sensor calibration using a single
shot", and of the ChESS response of Bennett and Lasenby 2014.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision3d.calibrate.detection.lattice_growth import STEPS, Cell, Grid, grid_of_cells, grow, near

__all__ = ["find_grids"]

Array = NDArray[np.float64]

CANDIDATES, TRIES, GRIDS = 1500, 80, 8
RING, RADIUS_PX = 32, 5.0
SYMMETRY = 0.35
"""Share of the ring's light that may differ between opposite points."""
LEAST = 0.06
"""Response of a candidate relative to the strongest."""
SMALLEST = 9
ALIKE = 0.6
"""Cosine of how far a phase may be from that of its neighbours."""


@dataclass(frozen=True, slots=True)
class Candidates:
    """Places where four quadrants meet: pixels (N, 2), edge directions (N, 2, 2) unit, strength (N,).

    `phase` (N,) is the second harmonic of the light around, whose argument is twice the direction of the
    light quadrants: the next corner of a board has the opposite one.
    """

    pixels: Array
    edges: Array
    strength: Array
    phase: NDArray[np.complex128]


def find_grids(grey: NDArray[np.uint8], blur_px: float = 1.5) -> list[Grid]:
    """Find lattices of checkerboard corners, the largest first.

    Parameters
    ----------
    grey : (h, w)
    blur_px : standard deviation of the smoothing before the search; corners must be at least about
        5 blur_px apart
    """
    candidates = _candidates(grey, blur_px)
    free = np.ones(len(candidates.pixels), dtype=np.bool_)
    grids: list[Grid] = []
    for seed in np.argsort(-candidates.strength)[:TRIES]:
        if not free[seed] or len(grids) >= GRIDS:
            continue
        cells = _grow(candidates, int(seed), free)
        if len(cells) >= SMALLEST:
            free[list(cells.values())] = False
            grids.append(grid_of_cells(candidates.pixels, cells))
    return sorted(grids, key=lambda grid: -len(grid.cells))


def _candidates(grey: NDArray[np.uint8], blur_px: float) -> Candidates:
    import cv2

    smooth = np.asarray(cv2.GaussianBlur(grey.astype(np.float32), (0, 0), blur_px), dtype=np.float32)
    xx, yy, xy = (
        np.asarray(cv2.Sobel(smooth, cv2.CV_32F, a, b, ksize=3), dtype=np.float32)
        for a, b in ((2, 0), (0, 2), (1, 1))
    )
    xy *= 2.0
    saddle = np.maximum(xy * xy - xx * yy, 0.0)
    width = 2 * max(1, round(1.5 * blur_px)) + 1
    peak = (saddle == cv2.dilate(saddle, np.ones((width, width)))) & (saddle > LEAST**2 * saddle.max())
    border = int(np.ceil(RADIUS_PX * blur_px / 1.5)) + 1
    peak[:border] = peak[-border:] = peak[:, :border] = peak[:, -border:] = False
    y, x = np.nonzero(peak)
    order = np.argsort(-saddle[y, x])[:CANDIDATES]
    pixels = np.stack([x[order], y[order]], axis=1).astype(np.float64)
    pixels += _subpixel(xx, yy, xy, smooth, pixels)
    keep, edges, phase = _rings(smooth, pixels, RADIUS_PX * blur_px / 1.5)
    return Candidates(pixels[keep], edges, np.sqrt(saddle[y, x][order][keep].astype(np.float64)), phase)


def _subpixel(xx: NDArray[np.float32], yy: NDArray[np.float32], xy: NDArray[np.float32],
              smooth: NDArray[np.float32], pixels: Array) -> Array:  # fmt: skip
    """One Newton step towards the point where the gradient vanishes, at most a pixel."""
    x, y = pixels.astype(np.int64).T
    gx, gy = (smooth[y, x + 1] - smooth[y, x - 1]) * 4.0, (smooth[y + 1, x] - smooth[y - 1, x]) * 4.0
    # Sobel's second derivatives weigh a unit step by 4, its first by 8: bring the first to the second's scale
    a, b, c = xx[y, x], xy[y, x] / 2.0, yy[y, x]
    det = a * c - b * b
    det = np.where(np.abs(det) < 1e-9, -1e-9, det)
    step = -np.stack([c * gx / 2.0 - b * gy / 2.0, a * gy / 2.0 - b * gx / 2.0], axis=1) / det[:, None]
    return np.clip(np.nan_to_num(step.astype(np.float64)), -1.0, 1.0)


def _rings(
    smooth: NDArray[np.float32], pixels: Array, radius: float
) -> tuple[NDArray[np.bool_], Array, NDArray[np.complex128]]:
    """Which candidates have four alternating quadrants, the directions of their two edges, and their phase.

    The second harmonic of the light on a ring around a corner outweighs the others; where the light crosses
    its mean there is an edge, and opposite crossings lie on one line.
    """
    angle = 2.0 * np.pi * np.arange(RING) / RING
    ring = pixels[:, None, :] + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    light = _sample(smooth, ring)
    light = light - light.mean(axis=1, keepdims=True)
    folded = 0.5 * (light[:, : RING // 2] + light[:, RING // 2 :])
    uneven = np.mean(np.abs(light[:, : RING // 2] - light[:, RING // 2 :]), axis=1) / 2.0
    size = np.mean(np.abs(folded), axis=1)
    after = np.concatenate([folded[:, 1:], folded[:, :1]], axis=1)
    crossing = (folded > 0.0) != (after > 0.0)
    keep = (crossing.sum(axis=1) == 2) & (uneven < SYMMETRY * np.maximum(size, 1e-6)) & (size > 2.0)
    where = np.argsort(~crossing[keep], axis=1, kind="stable")[:, :2]
    take = np.take_along_axis
    before, beyond = take(folded[keep], where, axis=1), take(after[keep], where, axis=1)
    at = (where + before / (before - beyond)) * (2.0 * np.pi / RING)
    phase = folded[keep] @ np.exp(2.0j * angle[: RING // 2]) / (RING // 4)
    return keep, np.stack([np.cos(at), np.sin(at)], axis=2), phase


def _sample(image: NDArray[np.float32], places: Array) -> Array:
    """Light at places (..., 2), linear between pixels."""
    h, w = image.shape
    x, y = np.clip(places[..., 0], 0, w - 1.001), np.clip(places[..., 1], 0, h - 1.001)
    i, j = x.astype(np.int64), y.astype(np.int64)
    u, v = x - i, y - j
    top = image[j, i] * (1 - u) + image[j, i + 1] * u
    bottom = image[j + 1, i] * (1 - u) + image[j + 1, i + 1] * u
    mixed: Array = (top * (1 - v) + bottom * v).astype(np.float64)
    return mixed


def _grow(c: Candidates, seed: int, free: NDArray[np.bool_]) -> dict[Cell, int]:
    """Cells of the lattice that grows from a candidate: cell to candidate."""
    cells = {(0, 0): seed}
    for step, direction in zip(STEPS, (*c.edges[seed], *-c.edges[seed]), strict=True):
        found = _first(c, seed, direction, free)
        if found >= 0 and found not in cells.values():
            cells[step] = found
    if len(cells) < 3:
        return {}

    def agrees(candidate: int, cell: Cell, so_far: dict[Cell, int]) -> bool:
        return bool(_agrees(c, np.array([candidate]), _expected(c, so_far, cell))[0])

    return grow(c.pixels, cells, free, agrees)


def _expected(c: Candidates, cells: dict[Cell, int], cell: Cell) -> complex:
    """Phase of a cell by the cells around it, each turned as often as it is away."""
    i, j = cell
    signed = [(-1) ** (i - a + j - b) * c.phase[cells[a, b]] for a, b in near(cells, cell)]
    return complex(np.mean(signed))


def _agrees(c: Candidates, which: NDArray[np.int64], expected: complex) -> NDArray[np.bool_]:
    """Whether candidates have the phase of a neighbour, and not much less or more contrast."""
    phase = c.phase[which]
    size = np.abs(phase) * abs(expected)
    alike = np.real(phase * np.conj(expected)) > ALIKE * size
    agreed: NDArray[np.bool_] = (
        alike & (np.abs(phase) > 0.2 * abs(expected)) & (np.abs(phase) < 5.0 * abs(expected))
    )
    return agreed


def _first(c: Candidates, seed: int, direction: Array, free: NDArray[np.bool_]) -> int:
    """The nearest candidate along an edge of the seed with an edge of the same direction; -1 for none."""
    offset = c.pixels - c.pixels[seed]
    along = offset @ direction
    across = np.abs(offset[:, 0] * direction[1] - offset[:, 1] * direction[0])
    parallel = np.max(np.abs(c.edges @ direction), axis=1)
    good = free & (along > 4.0) & (across < 0.18 * along + 0.5) & (parallel > 0.9)
    good &= _agrees(c, np.arange(len(offset)), -c.phase[seed])
    if not good.any():
        return -1
    return int(np.flatnonzero(good)[np.argmin(along[good])])
