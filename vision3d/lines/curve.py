"""A smooth curve through the middles of a stripe, and how sure its ends are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision3d.lines.stripes import Stripe

__all__ = ["Curve", "fit_curve"]

Array = NDArray[np.float64]
ROUNDS = 4
HUBER = 1.5


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
    """

    bottom: float
    middle: float
    cov: Array
    rms: float
    coverage: float
    width_spread: float


def fit_curve(stripe: Stripe, bottom: float, middle: float) -> Curve | None:
    """Fit a cubic by Huber's weights; None where too few rows show the stripe whole."""
    whole = np.isfinite(stripe.left) & ~stripe.cut_off
    y = np.flatnonzero(whole).astype(np.float64)
    if len(y) < 12:
        return None
    x = 0.5 * (stripe.left[whole] + stripe.right[whole])
    scale = 0.5 * (stripe.rows - 1)
    design = np.vander((y - scale) / scale, 4, increasing=True)
    ends = np.vander((np.array([bottom, middle]) - scale) / scale, 4, increasing=True)
    weights = np.ones(len(y))
    coefficients: Array = np.zeros(4)
    residual: Array = x
    for _ in range(ROUNDS):
        root = np.sqrt(weights)[:, None]
        solved = np.linalg.lstsq(root * design, root[:, 0] * x, rcond=None)[0]
        coefficients = np.asarray(solved, dtype=np.float64)
        residual = x - design @ coefficients
        sigma = max(1.4826 * float(np.median(np.abs(residual))), 0.02)
        weights = np.minimum(1.0, HUBER * sigma / np.maximum(np.abs(residual), 1e-12))
    at = ends @ coefficients
    between = (y >= middle - 0.5) & (y <= bottom + 0.5)
    return Curve(
        bottom=float(at[0]),
        middle=float(at[1]),
        cov=_covariance(design, ends, weights, residual),
        rms=float(np.sqrt(np.mean(weights * residual**2))),
        coverage=float(between.sum() / max(bottom - middle + 1.0, 1.0)),
        width_spread=_width_spread(y, stripe.right[whole] - stripe.left[whole]),
    )


def _covariance(design: Array, ends: Array, weights: Array, residual: Array) -> Array:
    """Of the ends; neighbouring rows err together, which the residuals tell themselves."""
    information = design.T @ (weights[:, None] * design)
    spread = float(np.sum(weights * residual**2)) / max(len(residual) - 4, 1)
    inverse = np.linalg.inv(information + 1e-9 * np.eye(4))
    cov: Array = ends @ inverse @ ends.T * (spread * _rows_that_err_together(residual) + 1e-4)
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
