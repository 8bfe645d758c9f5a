"""Blobs of an image that form a grid of circles, symmetric or asymmetric."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from vision3d.boards import CircleGrid
from vision3d.calibrate.detection.lattice import Ids
from vision3d.calibrate.detection.lattice_growth import Cell, grow
from vision3d.calibrate.detection.ordering import Cells
from vision3d.calibrate.detection.search import believable

__all__ = ["Lattice", "find_lattices"]

Array = NDArray[np.float64]
Grey = NDArray[np.uint8]

AREA_PX = 20.0
ROUND = 0.12
"""How far the area of a blob may be from that of the ellipse with its moments."""
FLAT, CORNERED = 6.0, 5.2
"""Longest to shortest axis at most; and the largest squared distance from the middle, in standard deviations:
4 for an ellipse, 6 for a parallelogram."""
MOST, THIN = 0.05, 0.25
"""Share of the image that a circle takes at most, and share of its upright box at least."""
ALIKE = 2.5
"""Ratio of the areas of neighbours."""
SEEDS, SMALLEST = 6, 6
NEARLY_ALL = 0.95
"""Share of its points that a lattice keeps when it is laid out as it is: sheared, it loses its ends."""
BLOCKS = (6, 12)
"""Widths of the windows of the adaptive thresholds, as parts of the image."""
LEAST = 0.5
CHANGES = [
    change
    for entries in product((0, 1, -1), repeat=4)
    if round(np.linalg.det(change := np.array(entries).reshape(2, 2))) == 1
]
"""Changes of the basis of a lattice: the nearest neighbours of a blob may lie along its diagonals."""


@dataclass(frozen=True, slots=True)
class Blobs:
    """Round blobs: centres (N, 2) px and areas (N,) px²."""

    centres: Array
    areas: Array


@dataclass(frozen=True, slots=True)
class Lattice:
    """Ways to number a grid of blobs as the board does, and its columns and rows where there is none."""

    ways: tuple[Cells, ...]
    size: tuple[int, int]


def find_lattices(grey: Grey, board: CircleGrid, *, dark: bool) -> Iterator[Lattice]:
    """Grids of blobs, the largest first."""
    for mask in _masks(grey, dark=dark):
        blobs = _round_blobs(mask)
        free = np.ones(len(blobs.areas), dtype=np.bool_)
        grids: list[dict[Cell, int]] = []
        for seed in np.argsort(-blobs.areas, kind="stable")[: 20 * SEEDS]:
            if not free[seed] or len(grids) >= SEEDS:
                continue
            cells = _grown(blobs, int(seed), free)
            if len(cells) >= SMALLEST:
                free[list(cells.values())] = False
                grids.append(cells)
        for cells in sorted(grids, key=lambda one: -len(one)):
            yield _numbered(blobs.centres, cells, board, (grey.shape[1], grey.shape[0]))


def _masks(grey: Grey, *, dark: bool) -> Iterator[Grey]:
    """What may be a circle: Otsu's threshold first, then thresholds that follow the light."""
    import cv2

    kind = cv2.THRESH_BINARY_INV if dark else cv2.THRESH_BINARY
    yield np.asarray(cv2.threshold(grey, 0, 255, kind | cv2.THRESH_OTSU)[1], dtype=np.uint8)
    for part in BLOCKS:
        width = max(3, max(grey.shape) // part | 1)
        offset = 5.0 if dark else -5.0
        adaptive = cv2.adaptiveThreshold(grey, 255, cv2.ADAPTIVE_THRESH_MEAN_C, kind, width, offset)
        yield np.asarray(adaptive, dtype=np.uint8)


def _round_blobs(mask: Grey) -> Blobs:
    """Connected components that are filled ellipses, by their moments."""
    import cv2

    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=4, ltype=cv2.CV_32S)
    box = stats[:, cv2.CC_STAT_WIDTH] * stats[:, cv2.CC_STAT_HEIGHT]
    counted = stats[:, cv2.CC_STAT_AREA]
    likely = (counted >= AREA_PX) & (counted < MOST * mask.size) & (counted > THIN * box)
    likely[0] = False
    renumbered = np.cumsum(likely) * likely
    label = renumbered[labels]
    y, x = np.nonzero(label)
    label = label[y, x] - 1
    count = int(likely.sum())
    area = np.maximum(np.bincount(label, minlength=count).astype(np.float64), 1e-9)

    def mean(values: Array) -> Array:
        total: Array = np.bincount(label, values, minlength=count) / area
        return total

    mx, my = mean(x.astype(np.float64)), mean(y.astype(np.float64))
    # a pixel is a square: its own second moment belongs to the ellipse
    xx = mean((x - mx[label]) ** 2) + 1.0 / 12.0
    yy = mean((y - my[label]) ** 2) + 1.0 / 12.0
    xy = mean((x - mx[label]) * (y - my[label]))
    det = np.maximum(xx * yy - xy * xy, 1e-12)
    flat = (0.5 * (xx + yy) + np.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)) ** 2 / det
    full = np.abs(area / (4.0 * np.pi * np.sqrt(det)) - 1.0) < ROUND
    u, v = x - mx[label], y - my[label]
    reach = np.zeros(count)
    np.maximum.at(
        reach, label, (yy[label] * u * u - 2.0 * xy[label] * u * v + xx[label] * v * v) / det[label]
    )
    good = full & (flat < FLAT**2) & (reach < CORNERED)
    return Blobs(np.stack([mx, my], axis=1)[good], area[good])


def _grown(blobs: Blobs, seed: int, free: NDArray[np.bool_]) -> dict[Cell, int]:
    """The lattice that grows from a blob and its nearest neighbours in two directions, each on both sides."""
    offset = blobs.centres - blobs.centres[seed]
    far = np.linalg.norm(offset, axis=1)
    ratio = blobs.areas / blobs.areas[seed]
    far[~free | (ratio > ALIKE) | (ratio * ALIKE < 1.0)] = np.inf
    far[seed] = np.inf
    around = [int(i) for i in np.argsort(far)[:10] if np.isfinite(far[i])]
    pairs = [
        (i, j) for k, i in enumerate(around) for j in around[k + 1 :]
        if np.linalg.norm(offset[i] + offset[j]) < 0.3 * min(far[i], far[j])
    ]  # fmt: skip
    pairs.sort(key=lambda pair: far[pair[0]] + far[pair[1]])
    for first, opposite in pairs[:3]:
        for second, across in pairs:
            turn = np.cross(np.append(offset[first], 0.0), np.append(offset[second], 0.0))[2]
            if abs(turn) < 0.4 * far[first] * far[second]:
                continue
            cells = {(0, 0): seed, (1, 0): first, (-1, 0): opposite, (0, 1): second, (0, -1): across}
            grown = grow(blobs.centres, cells, free, lambda i, _cell, so_far: _alike(blobs, i, so_far))
            if len(grown) >= SMALLEST:
                return grown
    return {}


def _alike(blobs: Blobs, candidate: int, so_far: dict[Cell, int]) -> bool:
    """Whether a blob has about the size of the lattice's blobs nearest to it."""
    members = list(so_far.values())
    far = np.linalg.norm(blobs.centres[members] - blobs.centres[candidate], axis=1)
    size = float(np.median(blobs.areas[np.array(members)[np.argsort(far)[:4]]]))
    return bool(size / ALIKE < blobs.areas[candidate] < size * ALIKE)


def _numbered(
    centres: Array, cells: dict[Cell, int], board: CircleGrid, image_size: tuple[int, int]
) -> Lattice:
    """Every way in which the lattice is the board seen from its front, and its size."""
    lattice, at = np.array(list(cells)), centres[list(cells.values())]
    x, y = (at - at.mean(axis=0)).T @ (lattice - lattice.mean(axis=0))
    if x[0] * y[1] - x[1] * y[0] < 0.0:
        lattice = lattice[:, ::-1]
    ways: dict[bytes, Cells] = {}
    size, best = (0, 0), 0.0
    for change in CHANGES:
        laid = lattice @ change.T
        if board.asymmetric:
            laid = np.stack([laid[:, 0] - laid[:, 1], laid.sum(axis=1)], axis=1)
        way, shape, kept = _on_board(laid, at, board)
        if way is not None:
            ways[way.ids.tobytes()] = way
            continue
        places = shape[0] * shape[1]
        full = float(kept.sum()) ** 2 / places if kept.sum() >= NEARLY_ALL * len(kept) else 0.0
        if full > best and believable(laid[kept], at[kept], places, image_size):
            size, best = shape, full
    # a sheared lattice may fit as well, without its rim
    most = max((len(way.cells) for way in ways.values()), default=0)
    return Lattice(tuple(way for way in ways.values() if len(way.cells) == most), size)


def _on_board(
    laid: Ids, at: Array, board: CircleGrid
) -> tuple[Cells | None, tuple[int, int], NDArray[np.bool_]]:
    """The lattice as cells of the board; its size, and which points are not on a rim that is hardly there."""
    kept = _without_sparse_rim(laid, 0.5 if board.asymmetric else 1.0)
    laid, at = laid[kept], at[kept]
    laid = laid - laid.min(axis=0)
    width, height = (laid.max(axis=0) + 1).tolist()
    if not board.asymmetric:
        whole = (width, height) == board.shape
        return (Cells(at, laid, board.shape) if whole else None), (width, height), kept
    odd = laid[:, 1] % 2
    fits = bool(np.all((laid[:, 0] - odd) % 2 == 0))
    columns = (width + 1) // 2
    whole = fits and (columns, height) == board.shape and width == 2 * columns
    cells = np.stack([(laid[:, 0] - odd) // 2, laid[:, 1]], axis=1)
    return (Cells(at, cells, board.shape) if whole else None), (columns, height), kept


def _without_sparse_rim(laid: Ids, density: float) -> NDArray[np.bool_]:
    """Cells that remain when rows and columns at the rim with less than half of their points are gone."""
    kept = np.ones(len(laid), dtype=np.bool_)
    while kept.sum() > 1:
        inside = laid[kept]
        low, high = inside.min(axis=0), inside.max(axis=0)
        ends = [(axis, int(end)) for axis in (0, 1) for end in (low[axis], high[axis])]
        spans = high - low + 1
        shares = [np.sum(inside[:, axis] == end) / (density * spans[1 - axis]) for axis, end in ends]
        worst = int(np.argmin(shares))
        if shares[worst] >= LEAST:
            break
        axis, end = ends[worst]
        kept &= laid[:, axis] != end
    return kept
