"""Weights of graduated non-convexity: from nearly convex to the loss that is meant.

Yang, Antonante, Tzoumas, Carlone 2020, "Graduated non-convexity for robust spatial perception: from
non-minimal solvers to global outlier rejection", IEEE RA-L 5(2), eq. 11-14 (truncated least squares,
Geman-McClure).  Agarwal, Tipaldi, Spinello, Stachniss, Burgard 2013, "Robust map optimization using dynamic
covariance scaling", ICRA, eq. 16.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from numpy.typing import NDArray

__all__ = ["SCHEDULES", "DynamicScaling", "GemanMcClure", "Schedule", "TruncatedSquares"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Schedule(abc.ABC):
    """One robust cost, and how it is come to.

    Everything takes squared whitened residuals (N,) and their bounds c² (N,): beyond its bound a measurement
    is an outlier.  `mu` is the control parameter.
    """

    factor: float = 1.4  # by which mu changes from one solve to the next
    name: ClassVar[str] = ""

    @abc.abstractmethod
    def first(self, squared: Array, bound: Array) -> float | None:
        """The first mu, or None where every measurement fits already."""

    @abc.abstractmethod
    def next(self, mu: float) -> float:
        """Mu of the next solve."""

    @abc.abstractmethod
    def weights(self, squared: Array, bound: Array, mu: float) -> Array:
        """(N,) in [0, 1]."""

    @abc.abstractmethod
    def cost(self, squared: Array, bound: Array) -> float:
        """What is meant in the end: the sum of the robust costs."""

    @abc.abstractmethod
    def finished(self, mu: float, weights: Array, before: Array) -> bool:
        """Whether nothing is left to graduate."""


@final
@dataclass(frozen=True, slots=True)
class TruncatedSquares(Schedule):
    """Squares up to c², nothing beyond: weights end at zero or one."""

    name: ClassVar[str] = "tls"

    def first(self, squared: Array, bound: Array) -> float | None:
        """Remark 5: so small that the surrogate is convex."""
        beyond = 2.0 * squared - bound
        if not (squared > bound).any():
            return None
        return float(np.min(bound[beyond > 0] / beyond[beyond > 0]))

    def next(self, mu: float) -> float:
        """Larger: towards the truncation."""
        return mu * self.factor

    def weights(self, squared: Array, bound: Array, mu: float) -> Array:
        """Eq. 14."""
        low, high = mu / (mu + 1.0) * bound, (mu + 1.0) / mu * bound
        between = np.sqrt(bound / np.maximum(squared, low) * mu * (mu + 1.0)) - mu
        return np.where(squared <= low, 1.0, np.where(squared >= high, 0.0, np.clip(between, 0.0, 1.0)))

    def cost(self, squared: Array, bound: Array) -> float:
        """Σ min(r², c²)."""
        return float(np.minimum(squared, bound).sum())

    def finished(self, mu: float, weights: Array, before: Array) -> bool:
        """Weights of zero and one alone, twice the same."""
        return bool(((weights == 0) | (weights == 1)).all() and np.array_equal(weights, before))


@final
@dataclass(frozen=True, slots=True)
class GemanMcClure(Schedule):
    """c² r² / (c² + r²)."""

    name: ClassVar[str] = "gm"

    def first(self, squared: Array, bound: Array) -> float | None:
        """Remark 5."""
        if not (squared > bound).any():
            return None
        return float(np.max(2.0 * squared / bound))

    def next(self, mu: float) -> float:
        """Smaller, down to one."""
        return max(mu / self.factor, 1.0)

    def weights(self, squared: Array, bound: Array, mu: float) -> Array:
        """Eq. 12."""
        return np.square(mu * bound / (squared + mu * bound))

    def cost(self, squared: Array, bound: Array) -> float:
        """Its own."""
        return float((bound * squared / (bound + squared)).sum())

    def finished(self, mu: float, weights: Array, before: Array) -> bool:
        """Mu is one, and weights do not change any more."""
        return mu <= 1.0 and bool(np.abs(weights - before).max(initial=0.0) < 1e-6)


@final
@dataclass(frozen=True, slots=True)
class DynamicScaling(Schedule):
    """Dynamic covariance scaling: no graduation, weights s² with s = min(1, 2Φ / (Φ + r²)), Φ = c²."""

    name: ClassVar[str] = "dcs"

    def first(self, squared: Array, bound: Array) -> float | None:
        """There is nothing to graduate."""
        return 1.0 if (squared > bound).any() else None

    def next(self, mu: float) -> float:
        """The same."""
        return mu

    def weights(self, squared: Array, bound: Array, mu: float) -> Array:
        """Eq. 16, squared."""
        return np.square(np.minimum(1.0, 2.0 * bound / (bound + squared)))

    def cost(self, squared: Array, bound: Array) -> float:
        """r² below Φ, then Φ (3 r² - Φ) / (r² + Φ)."""
        far = bound * (3.0 * squared - bound) / (squared + bound)
        return float(np.where(squared <= bound, squared, far).sum())

    def finished(self, mu: float, weights: Array, before: Array) -> bool:
        """Weights do not change any more."""
        return bool(np.abs(weights - before).max(initial=0.0) < 1e-6)


SCHEDULES: dict[str, Schedule] = {
    one.name: one for one in (TruncatedSquares(), GemanMcClure(), DynamicScaling())
}
