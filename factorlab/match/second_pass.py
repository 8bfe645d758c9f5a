"""The second pass: more matches under the model, each aligned to a fraction of a pixel, and the last fit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from factorlab.match.fitting import Geometry, fit_essential_pair, fit_model, slopes
from vision3d.features import Matches, guided_matches, refine_matches

if TYPE_CHECKING:
    from factorlab.match.job import Matched

__all__ = ["Sharper", "again"]

Array = NDArray[np.float64]
WINDOW_PX = 6.4  # distance over which errors of aligned windows are correlated: √2 times their Gaussian's
ALIKE, LONGER = 0.95, 1.1  # new matches keep below that quantile of the inliers' distances, and a little


@dataclass(frozen=True, slots=True, eq=False)
class Sharper:
    """The geometry, the pixels (M, 2) it is of, the sigma (M,) of the second, and the features they join."""

    geometry: Geometry
    pixels_a: Array
    pixels_b: Array
    sigma_px: Array
    matches: Matches


def again(first: Geometry, done: Matched) -> Sharper:
    """Match under the first geometry, align, and fit once more; the first again where that loses matches."""
    a, b, settings = done.a, done.b, done.settings
    rng = np.random.default_rng(settings.seed)
    matches, warps = done.matches, done.matches.warps(a.features, b.features)
    if first.kind != "essential":
        most = LONGER * float(np.quantile(done.matches.distance[first.inliers], ALIKE))
        matches = guided_matches(
            a.features, b.features, first.matrix, first.kind,  # type: ignore[arg-type]
            within_px=settings.threshold_px, most=most,
        )  # fmt: skip
        warps = matches.warps(a.features, b.features)
    own, theirs = matches.sigma_px(a.features, b.features)
    pixels_a, start = matches.points(a.features, b.features)
    if first.kind == "homography":
        warps = slopes(first.matrix, pixels_a)
    pixels_b, cov, ok = refine_matches(a.image, b.image, pixels_a, start, warps=warps)
    sigma = np.where(ok, np.sqrt(0.5 * np.trace(cov, axis1=1, axis2=2)), np.hypot(own, theirs))
    if first.kind == "essential" and a.camera is not None and b.camera is not None:
        found: Geometry | None = fit_essential_pair(
            (a.camera, b.camera), pixels_a, pixels_b, settings, sigma=sigma, rng=rng
        )
    else:
        found = fit_model(first.kind, pixels_a, pixels_b, settings, sigma=sigma, rng=rng)
    if found is None or found.count < first.count // 2:
        return Sharper(first, done.pixels_a, done.pixels_b, done.sigma_px, done.matches)
    return Sharper(_honest(found, sigma, pixels_a), pixels_a, pixels_b, sigma, matches)


def _honest(found: Geometry, sigma: Array, pixels_a: Array) -> Geometry:
    """The covariance raised for errors beyond the sigmas (no plane, a bent lens), and for shared windows."""
    if found.cov is None or found.count < 10:
        return found
    dims = 2 if found.kind == "homography" else 1
    at = found.inliers
    squares = np.sort((found.errors_px[at] / sigma[at]) ** 2 / dims)
    # the middle of chi squared with one or two degrees of freedom over its mean
    typical = float(np.median(squares)) / (0.693 if dims == 2 else 0.455)
    return replace(found, cov=found.cov * max(1.0, typical) * _shared(pixels_a[at]))


def _shared(points: Array) -> float:
    """How many times the same light was counted: windows of near matches overlap, and so do their errors."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(points).query_pairs(3.0 * WINDOW_PX, output_type="ndarray")
    away = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    return 1.0 + 2.0 * float(np.exp(-0.5 * (away / WINDOW_PX) ** 2).sum()) / len(points)
