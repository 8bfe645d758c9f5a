"""Fit the geometry that matches share, and choose between a homography and a fundamental matrix."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from factorlab.match.chance import chance_agreement, distinct_rows, log10_false_alarms
from factorlab.match.settings import MatchSettings
from sequential.errors import DataError, SolverError, UnderConstrainedError

if TYPE_CHECKING:
    from vision3d.camera import Camera
    from vision3d.two_view import TwoView

__all__ = ["FEWEST", "Geometry", "criterion", "fit_essential_pair", "fit_model", "slopes"]

Array = NDArray[np.float64]
FEWEST = {"homography": 6, "fundamental": 10, "essential": 8}
SAMPLE = {"homography": 4, "fundamental": 7}
SOLUTIONS = {"homography": 1, "fundamental": 3}
EPIPOLAR_SHARE = 0.5  # Sampson's distance of a match is about half its distance to the epipolar line


@dataclass(frozen=True, slots=True, eq=False)
class Geometry:
    """What matches agree on.

    Parameters
    ----------
    kind : "homography", "fundamental" or "essential"
    matrix : (3, 3) in pixels; the essential matrix in units of the camera
    cov : (9, 9) of its elements, as the fit gives it; None where there is none
    inliers : (M,) bool
    errors_px : (M,) distance of each match from the model, px
    sigma_px : of a coordinate of an inlier
    iterations, stopped, backend : how it was sought
    chance_log10 : expected number of models as good by chance
    two_view : the motion, of an essential matrix
    """

    kind: str
    matrix: Array
    cov: Array | None
    inliers: NDArray[np.bool_]
    errors_px: Array
    sigma_px: float
    iterations: int
    stopped: str
    backend: str
    chance_log10: float
    two_view: TwoView | None = None

    @property
    def count(self) -> int:
        """How many matches agree."""
        return int(self.inliers.sum())


def fit_model(
    kind: str,
    a: Array,
    b: Array,
    settings: MatchSettings,
    *,
    sigma: Array | None = None,
    rng: np.random.Generator,
) -> Geometry | None:
    """A homography or fundamental matrix; None where the matches are too few, or determine none."""
    from vision3d import robust

    if len(a) < FEWEST[kind]:
        return None
    plane = kind == "homography"
    fit = robust.fit_homography if plane else robust.fit_fundamental
    asked = settings.robust((1.0 if plane else EPIPOLAR_SHARE) * settings.threshold_px)
    try:
        found = fit(a, b, asked, sigma=sigma, rng=rng)
    except (UnderConstrainedError, SolverError, DataError):
        return None
    one = distinct_rows(a, b)
    within = settings.threshold_px
    alpha = chance_agreement(found.model, kind, a[one], b[one], within)
    chance = log10_false_alarms(int(one.sum()), int((found.inliers & one).sum()), SAMPLE[kind], alpha)
    return Geometry(
        kind, found.model, found.cov, found.inliers, found.errors, found.sigma, found.iterations,
        found.stopped, found.backend, chance + float(np.log10(SOLUTIONS[kind])),
    )  # fmt: skip


def fit_essential_pair(
    cameras: tuple[Camera, Camera], a: Array, b: Array, settings: MatchSettings, *,
    sigma: Array | None = None, rng: np.random.Generator,
) -> Geometry:  # fmt: skip
    """The motion between two pictures of known cameras."""
    from vision3d.two_view import estimate_two_view

    view = estimate_two_view(
        *cameras, a, b, sigma_px=sigma, threshold_px=EPIPOLAR_SHARE * settings.threshold_px, rng=rng,
    )  # fmt: skip
    return Geometry(
        "essential", view.essential, None, view.inliers, view.residuals, view.sigma_px, view.trials,
        view.stopped,
        "own", view.log10_nfa, view,
    )  # fmt: skip


def criterion(geometry: Geometry, sigma_px: float, points: Array) -> float:
    """Torr's criterion: what a model leaves unexplained and what it costs to say; less is better.

    Σ ρ + λ₁ d n + λ₂ k with ρ = min(e²/σ², 2 (4 - d)), λ₁ = ln 4, λ₂ = ln 4n (Torr, IJCV 2002).  A homography
    has d = 2 and k = 8, a fundamental matrix d = 3 and k = 7.  `sigma_px` is of a coordinate in either image;
    the errors of a homography at `points` (M, 2) are of both ends, and Sampson's distance shares them out.
    """
    d, k = (2, 8) if geometry.kind == "homography" else (3, 7)
    n = len(geometry.errors_px)
    variance: float | Array = sigma_px**2
    if geometry.kind == "homography":
        variance = variance * (1.0 + np.abs(np.linalg.det(slopes(geometry.matrix, points))))
    with np.errstate(invalid="ignore"):
        errors = np.minimum(geometry.errors_px**2 / variance, 2.0 * (4 - d))
    errors[~np.isfinite(errors)] = 2.0 * (4 - d)
    return float(errors.sum() + np.log(4.0) * d * n + np.log(4.0 * n) * k)


def slopes(matrix: Array, points: Array) -> Array:
    """(M, 2, 2) Jacobian of a homography at points."""
    there = np.column_stack([points, np.ones(len(points))]) @ matrix.T
    at = there[:, :2] / there[:, 2:]
    return np.asarray(
        (matrix[None, :2, :2] - at[:, :, None] * matrix[None, 2:, :2]) / there[:, 2, None, None]
    )
