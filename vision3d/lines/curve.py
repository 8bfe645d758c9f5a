"""A smooth curve through the middles of a stripe, and how sure its ends are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision3d.lines.stripes import Stripe

__all__ = ["Curve", "fit_curve", "refine_curve"]

Array = NDArray[np.float64]
ROUNDS = 3
HUBER = 1.5
FLOOR = 0.02  # px that a row is never better known than
BIAS = (0.02, 0.007)  # px, of what repeats from row to row: at the curve's end, and within it
GAP_ROWS = 6
CUBIC, HIGHEST = 3, 6


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A polynomial x(y) through the middles of the rows.

    Attributes
    ----------
    bottom, middle : x at the lowest row and at the row that looks ahead, px
    cov : (2, 2) covariance of the two, px²
    rms : of the residuals, px
    coverage : share of the rows between bottom and middle in which the stripe was seen whole
    width_spread : how far the widths depart from a straight line in y, as a share of the width
    criterion : Akaike's, the smaller the better
    """

    bottom: float
    middle: float
    cov: Array
    rms: float
    coverage: float
    width_spread: float
    criterion: float


def fit_curve(stripe: Stripe, bottom: float, middle: float, degree: int = 3) -> Curve | None:
    """Fit a polynomial by Huber's weights; None where too few rows show the stripe whole."""
    whole = np.isfinite(stripe.left) & ~stripe.cut_off
    y = np.flatnonzero(whole).astype(np.float64)
    if len(y) < 12:
        return None
    x = 0.5 * (stripe.left[whole] + stripe.right[whole])
    scale = 0.5 * (stripe.rows - 1)
    design = np.vander((y - scale) / scale, degree + 1, increasing=True)
    ends = np.vander((np.array([bottom, middle]) - scale) / scale, degree + 1, increasing=True)
    coefficients, weights = _solve(design, x)
    residual = x - design @ coefficients
    at = ends @ coefficients
    between = (y >= middle - 0.5) & (y <= bottom + 0.5)
    together = _rows_that_err_together(residual)
    spread = float(np.sum(weights * residual**2)) / max(float(weights.sum()) - degree - 1, 1.0)
    free = len(y) / together
    return Curve(
        bottom=float(at[0]),
        middle=float(at[1]),
        cov=_covariance(design, ends, weights, spread * together),
        rms=float(np.sqrt(np.mean(weights * residual**2))),
        coverage=float(between.sum() / max(bottom - middle + 1.0, 1.0)),
        width_spread=_width_spread(y, stripe.right[whole] - stripe.left[whole]),
        criterion=free * float(np.log(spread + FLOOR**2)) + 2.0 * (degree + 1),
    )


def refine_curve(stripe: Stripe, bottom: float, middle: float, first: Curve) -> Curve:
    """The polynomial of the degree that the rows speak for, by Akaike's criterion.

    Where the lowest or the highest rows are missing no more than a cubic is carried on to them.
    """
    seen = np.flatnonzero(np.isfinite(stripe.left) & ~stripe.cut_off)
    cut_short = seen[-1] < bottom - GAP_ROWS or seen[0] > middle
    degrees = range(1, CUBIC + 1 if cut_short else HIGHEST + 1)
    curves = [fit_curve(stripe, bottom, middle, degree) for degree in degrees]
    return min((one for one in curves if one is not None), key=lambda one: one.criterion, default=first)


def _solve(design: Array, x: Array) -> tuple[Array, Array]:
    """Coefficients and Huber's weights."""
    weights = np.ones(len(x))
    coefficients: Array = np.zeros(design.shape[1])
    for _ in range(ROUNDS):
        root = np.sqrt(weights)[:, None]
        solved = np.linalg.lstsq(root * design, root[:, 0] * x, rcond=None)[0]
        coefficients = np.asarray(solved, dtype=np.float64)
        residual = np.abs(x - design @ coefficients)
        sigma = max(1.4826 * float(np.median(residual)), FLOOR)
        weights = np.minimum(1.0, HUBER * sigma / np.maximum(residual, 1e-12))
    return coefficients, weights


def _covariance(design: Array, ends: Array, weights: Array, variance: float) -> Array:
    """Of the ends, from the variance of a row that errs for itself."""
    information = design.T @ (weights[:, None] * design)
    inverse = np.linalg.inv(information + 1e-12 * np.eye(len(information)))
    cov: Array = ends @ inverse @ ends.T * variance + np.diag(np.square(BIAS))
    return cov


def _rows_that_err_together(residual: Array) -> float:
    """By how much the correlation of neighbours inflates the variance of a mean: 1 + 2 Σ ρ."""
    lags = min(12, len(residual) // 4)
    power = float(residual @ residual)
    if power <= 0.0:
        return 1.0
    total = 1.0
    for lag in range(1, lags + 1):
        rho = float(residual[lag:] @ residual[:-lag]) / power
        if rho < 0.05:
            break
        total += 2.0 * rho
    return total


def _width_spread(y: Array, wide: Array) -> float:
    """Departure of the widths from a straight line, relative."""
    line = np.polynomial.Polynomial.fit(y, wide, 1)
    off = np.median(np.abs(wide - line(y)))
    return float(1.4826 * off / max(float(np.median(wide)), 2.0))
