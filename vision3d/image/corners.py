"""Harris' corners: where a window changes whichever way it is moved.

Moved by (u, v), a window around a pixel changes by (u, v) M (u, v)ᵀ with M = Σ [dx² dxdy; dxdy dy²].  Both
eigenvalues large: a corner; one: an edge; none: a plain ground.  Harris and Stephens (1988) tell them apart
by R = det M - k (trace M)², without eigenvalues.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError
from vision3d.image.borders import Border, cv2_border, pad
from vision3d.image.filters import box_sums
from vision3d.image.gradients import sobel
from vision3d.image.morphology import dilate
from vision3d.image.pixels import Backend, as_grey, as_mask, checked_backend

__all__ = ["corners", "harris"]

Score: TypeAlias = Literal["harris", "shi-tomasi"]


def harris(
    image: ArrayLike,
    block: int = 2,
    *,
    k: float = 0.04,
    size: Literal[3, 5, 7] = 3,
    score: Score = "harris",
    border: Border = "reflect101",
    backend: Backend = "compiled",
) -> NDArray[np.float32]:
    """The corner score of every pixel (OpenCV: `cornerHarris`, `cornerMinEigenVal`).

    Parameters
    ----------
    image : (h, w); bytes count as 0 to 1, so that scores do not depend on the scale of levels
    block : side of the window that M is summed over
    k : weight of the trace, 0.04 to 0.06; larger ones take fewer edges for corners
    size : of Sobel's window
    score : "harris", or "shi-tomasi", the smaller eigenvalue itself (1994)

    Returns
    -------
    (h, w) float32
    """
    pixels = as_grey(image)
    if score not in ("harris", "shi-tomasi"):
        raise DataError(f"harris: no score {score!r}; known are harris and shi-tomasi")
    if pixels.dtype not in (np.uint8, np.float32):
        pixels = pixels.astype(np.float32)
    if checked_backend(backend) == "opencv":
        import cv2

        kind = cv2_border(border)
        if score == "harris":
            return np.asarray(cv2.cornerHarris(pixels, block, size, k, borderType=kind), np.float32)
        return np.asarray(cv2.cornerMinEigenVal(pixels, block, ksize=size, borderType=kind), np.float32)
    scale = 1.0 / (2 ** (size - 1) * block * (255 if pixels.dtype == np.uint8 else 1))
    dx, dy = (
        sobel(pixels, 1 - axis, axis, size=size, dtype=np.float32, border=border, backend=backend)
        * np.float32(scale)
        for axis in (0, 1)
    )
    if backend != "numpy":
        return _compiled(dx, dy, block, k, score, border)
    xx, xy, yy = (
        box_sums(product, block, border=border, backend=backend).astype(np.float32)
        for product in (dx * dx, dx * dy, dy * dy)
    )
    if score == "harris":
        return np.asarray(xx * yy - xy * xy - np.float32(k) * (xx + yy) ** 2, np.float32)
    half = (xx - yy) / 2
    return np.asarray((xx + yy) / 2 - np.sqrt(half * half + xy * xy), np.float32)


def _compiled(
    dx: NDArray[np.float32], dy: NDArray[np.float32], block: int, k: float, score: Score, border: Border
) -> NDArray[np.float32]:
    """The same from one loop; derivatives padded have the products that products padded would have."""
    from vision3d.kernels import image_corners

    around = (block // 2, block - 1 - block // 2) * 2
    out = np.empty(dx.shape, np.float32)
    wide = [pad(np.asarray(one), *around, border) for one in (dx, dy)]
    image_corners.scores(wide[0], wide[1], block, k, score == "shi-tomasi", out)
    return out


def corners(
    image: ArrayLike,
    most: int = 0,
    *,
    quality: float = 0.01,
    min_distance_px: float = 10.0,
    mask: ArrayLike | None = None,
    block: int = 3,
    k: float = 0.04,
    score: Score = "harris",
    backend: Backend = "compiled",
) -> NDArray[np.float64]:
    """Corners from the best down, none near a better one (OpenCV: `goodFeaturesToTrack`).

    Parameters
    ----------
    image : (h, w)
    most : how many at most; 0 for all
    quality : scores below this share of the best one are none
    min_distance_px : between any two
    mask : (h, w), set where corners may be

    Returns
    -------
    (n, 2) pixels, x and y
    """
    pixels = as_grey(image)
    if not 0 < quality < 1 or min_distance_px < 0:
        raise DataError(
            f"corners: quality {quality}, min_distance_px {min_distance_px}; expected 0 to 1, and no"
            " distance below zero"
        )
    scores = harris(pixels, block, k=k, score=score, backend=backend)
    allowed = np.ones(pixels.shape, bool) if mask is None else as_mask(mask).astype(bool)
    best = float(scores[allowed].max()) if allowed.any() else 0.0
    kept = np.where(scores > best * quality, scores, np.float32(0.0))
    crest = (kept != 0) & (kept == dilate(kept, 3, backend=backend)) & allowed
    crest[[0, -1], :] = crest[:, [0, -1]] = False  # half of their window is made up
    y, x = np.nonzero(crest)
    order = np.argsort(kept[y, x], kind="stable")[
        ::-1
    ]  # of equal ones the last in the image, as OpenCV has it
    found = np.column_stack([x, y])[order].astype(np.float64)
    return _apart(found, min_distance_px, most or len(found))


def _apart(points: NDArray[np.float64], distance: float, most: int) -> NDArray[np.float64]:
    """The first points, none closer than `distance` to one before; cells of that size hold those taken."""
    cell = max(distance, 1.0)
    taken: dict[tuple[int, int], list[NDArray[np.float64]]] = {}
    out: list[NDArray[np.float64]] = []
    for point in points:
        if len(out) == most:
            break
        column, row = (int(c) for c in point // cell)
        near = (q for j in (-1, 0, 1) for i in (-1, 0, 1) for q in taken.get((column + i, row + j), ()))
        if all((point[0] - q[0]) ** 2 + (point[1] - q[1]) ** 2 >= distance**2 for q in near):
            taken.setdefault((column, row), []).append(point)
            out.append(point)
    return np.array(out).reshape(-1, 2)
