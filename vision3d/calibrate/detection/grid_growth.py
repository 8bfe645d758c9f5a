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

__all__ = ["Grid", "find_grids"]

Array = NDArray[np.float64]

CANDIDATES, SEEDS = 1500, 12
RING, RADIUS_PX = 32, 5.0
SYMMETRY = 0.35
"""Share of the ring's light that may differ between opposite points."""
LEAST = 0.06
"""Response of a candidate relative to the strongest."""
CATCH = 0.25
"""How far from its prediction a corner is looked for, in spacings."""
SMALLEST = 9
ALIKE = 0.6
"""Cosine of how far a phase may be from that of its neighbours."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Corners on a lattice: pixels (N, 2), cells (N, 2) column and row counted from 0."""

    pixels: Array
    cells: NDArray[np.int64]

    @property
    def shape(self) -> tuple[int, int]:
        """Columns and rows that the corners span."""
        columns, rows = self.cells.max(axis=0) + 1
        return int(columns), int(rows)

    @property
    def whole(self) -> bool:
        """Whether no place is empty."""
        columns, rows = self.shape
        return len(self.cells) == columns * rows

    def trimmed(self, least: float = 0.5) -> Grid:
        """The grid without the rows and columns at its rim of which less than a share is there."""
        cells, pixels = self.cells, self.pixels
        while len(cells):
            low, high = cells.min(axis=0), cells.max(axis=0)
            ends = [(axis, int(end)) for axis in (0, 1) for end in (low[axis], high[axis])]
            shares = [
                np.sum(cells[:, axis] == end) / (high[1 - axis] - low[1 - axis] + 1.0) for axis, end in ends
            ]
            worst = int(np.argmin(shares))
            if shares[worst] >= least:
                break
            axis, end = ends[worst]
            keep = cells[:, axis] != end
            cells, pixels = cells[keep], pixels[keep]
        return Grid(pixels, cells - cells.min(axis=0)) if len(cells) else self


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
    for seed in np.argsort(-candidates.strength)[: 20 * SEEDS]:
        if not free[seed] or len(grids) >= SEEDS:
            continue
        cells = _grow(candidates, int(seed), free)
        free[seed] = False
        if len(cells) >= SMALLEST:
            free[list(cells.values())] = False
            grids.append(_grid(candidates, cells))
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


STEPS = ((1, 0), (0, 1), (-1, 0), (0, -1))


def _grow(c: Candidates, seed: int, free: NDArray[np.bool_]) -> dict[tuple[int, int], int]:
    """Cells of the lattice that grows from a candidate: cell to candidate."""
    cells = {(0, 0): seed}
    for step, direction in zip(STEPS, (*c.edges[seed], *-c.edges[seed]), strict=True):
        found = _first(c, seed, direction, free)
        if found >= 0 and found not in cells.values():
            cells[step] = found
    if len(cells) < 3:
        return {}
    taken = set(cells.values())
    refused: dict[tuple[int, int], int] = {}
    growing = True
    while growing:
        growing = False
        rim = {(i + a, j + b) for i, j in cells for a, b in STEPS} - cells.keys()
        for cell in sorted(rim, key=lambda one: (abs(one[0]) + abs(one[1]), one)):
            if refused.get(cell) == len(_near(cells, cell)):
                continue
            guess = _predict(c, cells, cell)
            hit = -1 if guess is None else _catch(c, guess[0], guess[1], free, taken)
            if hit >= 0 and _agrees(c, np.array([hit]), _expected(c, cells, cell))[0]:
                cells[cell] = hit
                taken.add(hit)
                growing = True
            else:
                refused[cell] = len(_near(cells, cell))
    return cells


def _expected(c: Candidates, cells: dict[tuple[int, int], int], cell: tuple[int, int]) -> complex:
    """Phase of a cell by the cells around it, each turned as often as it is away."""
    i, j = cell
    signed = [(-1) ** (i - a + j - b) * c.phase[cells[a, b]] for a, b in _near(cells, cell)]
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


def _near(cells: dict[tuple[int, int], int], cell: tuple[int, int]) -> list[tuple[int, int]]:
    """Known cells within two steps."""
    i, j = cell
    return [(i + a, j + b) for a in range(-2, 3) for b in range(-2, 3) if (i + a, j + b) in cells]


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


def _predict(
    c: Candidates, cells: dict[tuple[int, int], int], cell: tuple[int, int]
) -> tuple[Array, float] | None:
    """Where a cell should be by its neighbours, and the spacing there; None where they say nothing."""
    i, j = cell
    guesses, spacings = [], []
    at = c.pixels
    for a, b in STEPS:
        one, two, three = (i + a, j + b), (i + 2 * a, j + 2 * b), (i + 3 * a, j + 3 * b)
        if one in cells and two in cells:
            step = at[cells[one]] - at[cells[two]]
            if three in cells:
                before = at[cells[two]] - at[cells[three]]
                step = step * min(max(float(np.linalg.norm(step) / np.linalg.norm(before)), 0.7), 1.4)
            guesses.append(at[cells[one]] + step)
            spacings.append(float(np.linalg.norm(step)))
        for p, q in (((b, a)), ((-b, -a))):
            side, corner = (i + p, j + q), (i + a + p, j + b + q)
            if one in cells and side in cells and corner in cells:
                guesses.append(at[cells[one]] + at[cells[side]] - at[cells[corner]])
                spacings.append(
                    min(
                        float(np.linalg.norm(at[cells[one]] - at[cells[corner]])),
                        float(np.linalg.norm(at[cells[side]] - at[cells[corner]])),
                    )
                )
    if not guesses:
        return None
    return np.median(guesses, axis=0), min(spacings)


def _catch(c: Candidates, guess: Array, spacing: float, free: NDArray[np.bool_], taken: set[int]) -> int:
    """The candidate nearest to a prediction, if it is near enough and nobody's; -1 otherwise."""
    distance = np.linalg.norm(c.pixels - guess, axis=1)
    distance[~free] = np.inf
    best = int(np.argmin(distance))
    return best if distance[best] <= CATCH * spacing + 0.5 and best not in taken else -1


def _grid(c: Candidates, cells: dict[tuple[int, int], int]) -> Grid:
    places = np.array(list(cells), dtype=np.int64)
    pixels = c.pixels[list(cells.values())]
    return Grid(pixels, places - places.min(axis=0))
