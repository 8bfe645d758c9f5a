"""Stripes of an image, darker or lighter than what lies beside them, followed from the bottom up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision3d.lines.settings import LineSettings

__all__ = ["Stripe", "find_stripes"]

Array = NDArray[np.float64]
Bright = NDArray[np.float32]
START_ROWS = 5  # rows, evenly over the lowest quarter, in which stripes may begin
GAP = 0.2  # of the rows: a dash and its gap
GROWTH = 1.3  # a row wider than this by 2 px more is a junction
POLARITIES = {"auto": (True, False), "dark": (True,), "light": (False,)}  # which are dark
NARROWER = 0.4
LOWER = 0.25  # height of the wide window over its width
DARKNESS = 16.0  # grey levels: below it differences are noise more than contrast
WEAK = 0.2  # Sobel's answer in logarithms, below which an edge is noise
MOST = 24  # stripes of one polarity; more are texture, and not followed


@dataclass(frozen=True, slots=True, eq=False)
class Stripe:
    """One stripe in the lower part of a small image.

    Attributes
    ----------
    left, right : (rows,) x of its edges, NaN where it was not seen
    dark : darker than the ground
    width : at the bottom, px
    contrast : of the logarithm of brightness with the ground, on the side where it differs less
    share_of_edges : how much of all strong edges in the image are its own
    cut_off : (rows,) whether an edge is that of the image
    columns : of the small image
    """

    left: Array
    right: Array
    dark: bool
    width: float
    contrast: float
    share_of_edges: float
    cut_off: NDArray[np.bool_]
    columns: int

    @property
    def salience(self) -> float:
        """What makes it stand out beside others: contrast, and width."""
        return self.contrast * float(np.sqrt(max(self.width, 1.0)))

    @property
    def rows(self) -> int:
        """How many rows the part of the image has."""
        return len(self.left)


def find_stripes(small: NDArray[np.uint8], own: LineSettings) -> list[Stripe]:
    """Every stripe that begins in the lowest quarter of the rows.

    Brightness is compared by its logarithm, so that a line keeps its contrast in a shadow; the ground is
    taken from a wide and low window, which follows light that changes from the bottom up, and once more from
    a narrower square one, which follows the upright edge of a shadow.
    """
    bright = log_brightness(small)
    otsu = own.threshold == "otsu"
    windows = ((own.window, LOWER), (NARROWER * own.window, 1.0))
    grounds = [_otsu(small)] if otsu else [_ground(small, *window) for window in windows]
    found: list[Stripe] = []
    for dark in POLARITIES[own.polarity]:
        for ground in grounds:
            difference = _difference(bright, ground, own, dark=dark)
            found += _from(bright, difference, own, dark=dark, least=0.0 if otsu else own.contrast)
    return found


def log_brightness(small: NDArray[np.uint8]) -> Bright:
    """The logarithm of grey levels above the sensor's noise, a little smoothed."""
    import cv2

    smooth = cv2.GaussianBlur(small.astype(np.float32), (0, 0), 1.0)
    return np.asarray(np.log(smooth + np.float32(DARKNESS)), dtype=np.float32)


def _from(bright: Bright, difference: Bright, own: LineSettings, *, dark: bool, least: float) -> list[Stripe]:
    """Stripes in which a difference from the ground exceeds `least`."""
    from vision3d.kernels.stripes import trace

    rows, columns = difference.shape
    found: list[Stripe] = []
    for start in np.linspace(rows - 1, 0.75 * rows, START_ROWS).astype(int):
        for begin, end in _runs(difference[start] > least):
            # half-way between ground and line the edge stands where it is, however blurred
            level = 0.5 * float(np.median(difference[start, begin:end])) if least else 0.0
            centre, wide = 0.5 * (begin + end - 1), float(end - begin)
            if not own.width[0] * columns <= wide <= own.width[1] * columns:
                continue
            if any(_holds(stripe, int(start), centre) for stripe in found):
                continue
            left, right = np.empty(rows), np.empty(rows)
            seen = trace(difference, level, int(start), centre, wide, int(GAP * rows), GROWTH, left, right)
            if seen >= 0.3 * rows:
                found.append(_stripe(bright, left, right, dark=dark))
            if len(found) >= MOST:
                return found
    return found


def _difference(bright: Bright, ground: Bright, own: LineSettings, *, dark: bool) -> Bright:
    """How far each pixel is from the ground towards the line; what is narrow is opened away, and closed."""
    import cv2

    difference = ground - bright if dark else bright - ground
    element = np.ones((own.opening_px, own.opening_px), np.uint8)
    opened = cv2.morphologyEx(difference, cv2.MORPH_OPEN, element)
    return np.ascontiguousarray(cv2.morphologyEx(opened, cv2.MORPH_CLOSE, element), dtype=np.float32)


def _otsu(small: NDArray[np.uint8]) -> Bright:
    """One level for the whole image."""
    import cv2

    level, _ = cv2.threshold(small, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    return np.full(small.shape, np.log(level + 0.5 + DARKNESS), dtype=np.float32)


def _ground(small: NDArray[np.uint8], window: float, lower: float) -> Bright:
    """The ground's brightness: the median round each pixel, which a line does not pull as it pulls a mean.

    `window` is its width as a share of the image's; it is `lower` times as high.
    """
    import cv2

    rows, columns = small.shape
    tall = max(8, round(0.25 * rows / lower))  # OpenCV's median is square
    coarse = cv2.resize(small, (max(8, columns // 4), tall), interpolation=cv2.INTER_AREA)
    half = max(1, min(int(0.5 * window * coarse.shape[1]), 120))
    beyond = cv2.copyMakeBorder(coarse, half, half, half, half, cv2.BORDER_REFLECT)
    level = cv2.medianBlur(beyond, 2 * half + 1)[half:-half, half:-half]
    smooth = cv2.GaussianBlur(level.astype(np.float32), (0, 0), max(0.25 * half, 0.5))
    whole = cv2.resize(smooth, (columns, rows), interpolation=cv2.INTER_LINEAR)
    return np.asarray(np.log(whole + np.float32(DARKNESS)), dtype=np.float32)


def _runs(row: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Beginnings and ends (one past the last) of what is True."""
    steps = np.diff(np.concatenate([[0], row.astype(np.int8), [0]]))
    return list(zip(np.flatnonzero(steps == 1).tolist(), np.flatnonzero(steps == -1).tolist(), strict=True))


def _holds(stripe: Stripe, row: int, x: float) -> bool:
    """Whether a point belongs to a stripe."""
    return bool(stripe.left[row] - 1 <= x <= stripe.right[row] + 1)


def _stripe(bright: Bright, left: Array, right: Array, *, dark: bool) -> Stripe:
    rows, columns = bright.shape
    y = np.flatnonzero(np.isfinite(left))
    lowest = y[-max(3, len(y) // 6) :]
    width = float(np.median(right[lowest] - left[lowest]))
    cut = np.zeros(rows, dtype=np.bool_)
    cut[y] = (left[y] <= 0.5) | (right[y] >= columns - 1.5)
    contrast = _contrast(bright, left, right, y, dark=dark)
    share = _share(bright, left, right, y)
    return Stripe(left, right, dark, width, contrast, share, cut, columns)


def _contrast(bright: Bright, left: Array, right: Array, y: NDArray[np.int64], *, dark: bool) -> float:
    """Median over rows of the smaller of the differences to both sides."""
    columns = bright.shape[1]
    wide = right[y] - left[y]
    aside = 2.0 + 0.25 * wide
    middle = _at(bright, y, 0.5 * (left[y] + right[y]))
    sides = np.stack([_at(bright, y, left[y] - aside), _at(bright, y, right[y] + aside)])
    seen = np.stack([left[y] - aside >= 0, right[y] + aside <= columns - 1])
    differences = np.where(seen, (sides - middle) * (1.0 if dark else -1.0), np.inf)
    smaller = differences.min(axis=0)
    smaller = smaller[np.isfinite(smaller)]
    return float(np.median(smaller)) if len(smaller) else 0.0


def _at(bright: Bright, y: NDArray[np.int64], x: Array) -> Array:
    """Brightness at rounded places."""
    columns = np.clip(np.round(x).astype(int), 0, bright.shape[1] - 1)
    return np.asarray(bright[y, columns], dtype=np.float64)


def _share(bright: Bright, left: Array, right: Array, y: NDArray[np.int64]) -> float:
    """The share of strong edge pixels near the stripe's own edges; strong as half of its own are."""
    import cv2

    gx = cv2.Sobel(bright, cv2.CV_32F, 1, 0)
    gy = cv2.Sobel(bright, cv2.CV_32F, 0, 1)
    strength = np.abs(gx) + np.abs(gy)
    places = np.concatenate([left[y], right[y]])
    rows = np.concatenate([y, y])
    columns = np.clip(np.round(places).astype(int), 0, bright.shape[1] - 1)
    level = 0.5 * float(np.median(strength[rows, columns]))
    strong = strength > max(level, WEAK)
    near = np.zeros_like(strong)
    for shift in range(-3, 4):
        near[rows, np.clip(columns + shift, 0, bright.shape[1] - 1)] = True
    near = np.asarray(cv2.dilate(near.astype(np.uint8), np.ones((3, 1), np.uint8)), dtype=np.bool_)
    total = int(strong.sum())
    return float((strong & near).sum() / total) if total else 0.0
