"""Sets of sigma points: where they lie for a unit covariance, and what they weigh."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, ShapeError
from sequential.manifold import Manifold, Vector
from sequential.noise import require_covariance

__all__ = ["SETS", "SigmaPoints", "SigmaSet", "sigma_points"]

Array = NDArray[np.float64]

SETS = ("merwe", "julier", "simplex", "cubature")


class SigmaPoints(NamedTuple):
    """Points and their weights: a mean is Σ w y, a covariance Σ w e eᵀ with the other weights."""

    points: Array  # (c, n)
    mean_weights: Array  # (c,)
    cov_weights: Array  # (c,)


@dataclass(frozen=True, slots=True)
class SigmaSet:
    """One of the sets, by name and spread; see `UnscentedKalmanFilter`."""

    name: str
    alpha: float = 1.0
    beta: float = 2.0
    kappa: float = 0.0

    def __post_init__(self) -> None:
        if self.name not in SETS:
            raise ModelError(
                f"there are no sigma points {self.name!r}; there are {', '.join(map(repr, SETS))}"
            )

    def weights(self, dim: int) -> Array:
        """[γ, weight of the central point in a mean, in a covariance, weight of any other] for d = `dim`.

        Raises
        ------
        ModelError
            where the points would not spread: α ≤ 0 or d + κ ≤ 0.
        """
        if self.name == "simplex":
            return np.array([math.sqrt(dim), 0.0, 0.0, 1.0 / (dim + 1)])
        if self.name == "cubature":
            return np.array([math.sqrt(dim), 0.0, 0.0, 0.5 / dim])
        alpha, beta = (self.alpha, self.beta) if self.name == "merwe" else (1.0, 0.0)
        scale = alpha**2 * (dim + self.kappa)
        if not (alpha > 0 and scale > 0 and math.isfinite(scale)):
            raise ModelError(
                f"{self.name} points with alpha={alpha}, kappa={self.kappa} do not spread over {dim} "
                f"directions: alpha must be positive and kappa above {-dim}"
            )
        central = 1.0 - dim / scale
        return np.array([math.sqrt(scale), central, central + 1.0 - alpha**2 + beta, 0.5 / scale])

    def unit(self, dim: int) -> Array:
        """(c, d) points of a unit covariance besides the central one; no rows: ±γ along each axis."""
        if self.name != "simplex":
            return np.empty((0, dim))
        # columns of Helmert's matrix: orthonormal, and orthogonal to a column of ones
        unit = np.zeros((dim + 1, dim))
        for k in range(dim):
            unit[: k + 1, k] = 1.0
            unit[k + 1, k] = -(k + 1.0)
            unit[:, k] *= math.sqrt((dim + 1.0) / ((k + 1.0) * (k + 2.0)))
        return unit


def sigma_points(
    mean: ArrayLike,
    cov: ArrayLike,
    kappa: float = 0.0,
    *,
    points: str = "julier",
    alpha: float = 1.0,
    beta: float = 2.0,
    manifold: Manifold | None = None,
) -> SigmaPoints:
    """Sigma points of a belief, as `UnscentedKalmanFilter` and `CubatureKalmanFilter` draw them.

    >>> sigma_points([0.0, 0.0], [1.0, 4.0], kappa=1.0).points.shape
    (5, 2)

    Parameters
    ----------
    mean : (n,)
    cov : (d, d), (d,) variances or a number; may be singular
    kappa : κ of "julier" and "merwe"
    points : "julier", "merwe", "cubature" or "simplex": 2d + 1, 2d + 1, 2d and d + 1 points
    alpha, beta : α and β of "merwe"
    manifold : where the mean lives; a vector unless given

    Raises
    ------
    ModelError, ShapeError, NotPositiveDefiniteError
    """
    x = np.atleast_1d(np.asarray(mean, dtype=np.float64))
    space = Vector(len(x)) if manifold is None else manifold
    if x.shape != (space.size,):
        raise ShapeError(f"a mean on {space} has shape ({space.size},), got {x.shape}")
    chosen, d = SigmaSet(points, alpha, beta, kappa), space.dim
    gamma, central, central_cov, other = chosen.weights(d)
    full = require_covariance(cov, d, "the covariance of sigma points", definite=False)
    unit = chosen.unit(d) if points == "simplex" else gamma * np.concatenate([np.eye(d), -np.eye(d)])
    drawn = space.retract(x, unit @ _lower(full).T)
    weights = np.full(len(drawn), other)
    if points in {"simplex", "cubature"}:
        return SigmaPoints(drawn, weights, weights)
    together = np.concatenate([x[None], drawn])
    return SigmaPoints(together, np.append(central, weights), np.append(central_cov, weights))


def _lower(cov: Array) -> Array:
    """Lower L with L Lᵀ = cov; the column of a direction without uncertainty is zero."""
    d = len(cov)
    lower = np.zeros((d, d))
    for j in range(d):
        pivot = cov[j, j] - lower[j, :j] @ lower[j, :j]
        if pivot > 1e-13 * cov[j, j]:
            lower[j, j] = math.sqrt(pivot)
            lower[j + 1 :, j] = (cov[j + 1 :, j] - lower[j + 1 :, :j] @ lower[j, :j]) / lower[j, j]
    return lower
