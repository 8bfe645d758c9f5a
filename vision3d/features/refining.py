"""Sub-pixel matches: the patch about a point of one image, aligned with the other image.

A detector finds a point in each image by itself, and errs in each; a match asks only where the same light
lies.  Aligning patches leaves one error instead of two, and a much smaller one, with a covariance from what
the fit leaves.  The first point stays; the second moves.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, ShapeError
from vision3d.features.features import Array

__all__ = ["refine_matches"]

BLUR_PX = 0.7  # interpolation is exact only for what is smooth
ITERATIONS = 30
LEFT_OUT = 1.15  # times the variance, on light that is known: interpolation, and steps that are not linear
FLOOR_PX = 0.01  # what photographs leave that were sampled twice
DISAGREE = 16.0  # of chi squared with two degrees of freedom: one in three thousand
WORST_PX = 0.3  # beyond, the fit is no longer linear, and its covariance means nothing
Image = NDArray[np.float32]
ENOUGH, SAMPLE = 30, 300  # patches that tell the correlation of the residuals
_STEPS = np.arange(-3.0, 4.0)
SMOOTHED = np.exp(-(_STEPS[:, None] ** 2 + _STEPS**2) / (4.0 * BLUR_PX**2))


def refine_matches(
    image_a: ArrayLike,
    image_b: ArrayLike,
    pixels_a: ArrayLike,
    pixels_b: ArrayLike,
    *,
    warps: ArrayLike | None = None,
    affine: bool = True,
    radius_px: int = 9,
    levels: int = 2,
    reach_px: float = 3.0,
    min_correlation: float = 0.8,
    confirm: bool = True,
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Move the second point of every match to where the patch about the first lies.

    Parameters
    ----------
    image_a, image_b : (h, w) grey levels or (h, w, 3) BGR, uint8; sizes and lights may differ
    pixels_a, pixels_b : (M, 2) px
    warps : (M, 2, 2) d pixels_b / d pixels_a near each match, such as `matches.warps(a, b)`, or the Jacobian
        of a homography; None: neither turned nor scaled
    affine : refine the warp as well; otherwise only shift, gain and offset of the light
    radius_px : half the side of the window, px of the coarser of both images
    levels : of the pyramid, coarsest first; what fails on one is tried on the next
    reach_px : farthest that a point may move on the coarsest level, px of it
    min_correlation : of both patches after the fit, 0 to 1
    confirm : fit windows of about half the size as well, and refuse where they disagree: on the edge of
        something near, one window has two motions in it

    Returns
    -------
    pixels_b : (M, 2) px; as given where it failed
    cov : (M, 2, 2) px², of the second point given the first; NaN where it failed
    ok : (M,) whether the patch was found: inside both images, near, alike, and with light and shade in both
        directions

    Raises
    ------
    ShapeError
        where the arrays do not belong together.
    ModelError
        where a setting has no meaning.
    """
    from vision3d.features.detection import grey_bytes

    if radius_px < 2 or levels < 1 or reach_px <= 0 or not 0.0 <= min_correlation < 1.0:
        raise ModelError(
            "expected radius_px >= 2, levels >= 1, reach_px > 0 and min_correlation from 0 to 1; got "
            f"{radius_px}, {levels}, {reach_px}, {min_correlation}"
        )
    a, b = (_points(one, name) for one, name in ((pixels_a, "pixels_a"), (pixels_b, "pixels_b")))
    if len(a) != len(b):
        raise ShapeError(
            f"matches are pairs; got {len(a)} points of the first image and {len(b)} of the second"
        )
    given = np.broadcast_to(np.eye(2), (len(a), 2, 2)) if warps is None else np.asarray(warps, np.float64)
    if given.shape != (len(a), 2, 2):
        raise ShapeError(f"warps of {len(a)} matches are ({len(a)}, 2, 2), got {given.shape}")
    given = given.copy()
    found = _Found(a, b.copy(), given, np.full((len(a), 2, 2), np.nan), np.zeros(len(a), np.bool_), b)
    window = _Window(radius_px, affine, reach_px, min_correlation)
    first, second = _Pyramid(grey_bytes(image_a)), _Pyramid(grey_bytes(image_b))
    for level in range(levels - 1, -1, -1):
        _level(first, second, level, found, window)
    if confirm:
        _confirm(first, second, found, window)
    return found.b, found.cov, found.ok


@dataclass(slots=True)
class _Found:
    """What is known of every match so far; levels write into it where they succeed."""

    a: Array
    b: Array
    warp: Array
    cov: Array
    ok: NDArray[np.bool_]
    given: Array


@dataclass(frozen=True, slots=True)
class _Window:
    """How patches are compared."""

    radius: int
    affine: bool
    reach: float
    least: float
    worst: float = WORST_PX


def _level(first: _Pyramid, second: _Pyramid, level: int, found: _Found, window: _Window) -> None:
    """One level of the pyramids; patches of like scales together."""
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.log2(np.sqrt(np.abs(np.linalg.det(found.warp))))
    octaves = np.where(np.isfinite(scale), np.clip(np.rint(scale), -8, 8), 0).astype(int)
    finite = np.isfinite(found.a).all(axis=1) & np.isfinite(found.b).all(axis=1) & np.isfinite(scale)
    for octave in np.unique(octaves):
        image_a, image_b = first.at(level + max(0, -octave)), second.at(level + max(0, octave))
        if image_a is None or image_b is None:
            continue
        rows = np.flatnonzero((octaves == octave) & finite)
        own_a, own_b = 2.0 ** (level + max(0, -octave)), 2.0 ** (level + max(0, octave))
        place, turned, covs, facts = _aligned(
            image_a, image_b, found.a[rows] / own_a, found.b[rows] / own_b,
            found.warp[rows] * (own_a / own_b), window,
        )  # fmt: skip
        with np.errstate(invalid="ignore"):
            sure = (covs[:, [0, 2]] >= 0.0).all(axis=1) & (covs[:, 0] + covs[:, 2] < 2.0 * window.worst**2)
        good = (facts[:, 0] >= window.least) & sure
        done = rows[good]
        found.b[done], found.warp[done] = place[good] * own_b, turned[good] * (own_b / own_a)
        found.cov[done] = own_b**2 * (
            LEFT_OUT * covs[good][:, [0, 1, 1, 2]].reshape(-1, 2, 2) + FLOOR_PX**2 * np.eye(2)
        )
        found.ok[done] = True


def _confirm(first: _Pyramid, second: _Pyramid, found: _Found, window: _Window) -> None:
    """Refuse matches whose smaller windows lie elsewhere, by more than both covariances together allow."""
    rows = np.flatnonzero(found.ok)
    again = _Found(
        found.a[rows], found.b[rows].copy(), found.warp[rows].copy(), found.cov[rows].copy(),
        np.zeros(len(rows), np.bool_), found.b[rows],
    )  # fmt: skip
    # a small window may know little; what it knows counts
    smaller = replace(window, radius=max(3, (window.radius + 1) // 2), least=0.5, worst=1.0)
    _level(first, second, 0, again, smaller)
    apart = again.b - found.b[rows]
    squares = np.einsum("ni,nij,nj->n", apart, np.linalg.inv(again.cov + found.cov[rows]), apart)
    wrong = rows[~again.ok | (squares > DISAGREE)]
    found.ok[wrong] = False
    found.b[wrong], found.cov[wrong] = found.given[wrong], np.nan


def _aligned(
    first: Image, second: Image, a: Array, b: Array, warp: Array, window: _Window
) -> tuple[Array, Array, Array, Array]:
    """Places, warps, covariances and facts; a sample of the patches tells first what residuals are like."""
    from vision3d.kernels.patch_alignment import align

    rho = SMOOTHED
    some: slice | NDArray[np.int64]
    sample = np.arange(0, len(a), max(1, len(a) // SAMPLE))
    place, turned, covs, facts = b, warp, np.empty((0, 3)), np.empty((0, 4))
    for some in (sample, slice(None)):
        points, place, turned = (np.array(one[some], order="C") for one in (a, b, warp))
        covs, facts, lags = np.empty((len(points), 3)), np.empty((len(points), 4)), np.zeros_like(rho)
        align(
            first, second, points, place, turned, window.radius, window.affine, ITERATIONS, window.reach,
            rho, covs, facts, lags,
        )  # fmt: skip
        rho = _correlation(lags)
    return place, turned, covs, facts


def _correlation(lags: Array) -> Array:
    """Sums of lags as a correlation; that of the smoothing where there was no patch to measure it on."""
    most = lags[lags.shape[0] // 2, lags.shape[1] // 2]
    if most < ENOUGH:
        return SMOOTHED
    both = 0.5 * (lags + lags[::-1, ::-1])
    return np.ascontiguousarray(np.maximum(both / most, SMOOTHED))


class _Pyramid:
    """Halved again and again; pixel (x, y) of the image is (x, y) / 2^k of level k."""

    def __init__(self, image: NDArray[np.uint8]) -> None:
        import cv2

        smooth = cv2.GaussianBlur(image.astype(np.float32), (0, 0), BLUR_PX)
        self._levels = [np.asarray(smooth, np.float32)]

    def at(self, level: int) -> Image | None:
        """A level; None where it would be too small to hold a patch."""
        import cv2

        while len(self._levels) <= level:
            if min(self._levels[-1].shape) < 2:
                return None
            self._levels.append(np.ascontiguousarray(cv2.pyrDown(self._levels[-1])))
        return self._levels[level]


def _points(values: ArrayLike, name: str) -> Array:
    points = np.asarray(values, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 2:
        raise ShapeError(f"{name} are (M, 2), got shape {points.shape}")
    return points
