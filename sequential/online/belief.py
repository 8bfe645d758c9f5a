"""What goes into an online filter and comes out of it: a belief, and the innovation of a reading."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.manifold import Manifold
from sequential.model import Gaussian

__all__ = ["Belief", "Innovation", "Layout"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Layout:
    """Where things stand in the array that a step writes.

    [mean n | covariance d² | what the filter's form keeps beside it | residual | its covariance | accepted,
    log likelihood], the two of the innovation padded to the widest measurement of the model.
    """

    manifold: Manifold
    width: int
    form: str = "joseph"
    extra: int = 0

    @property
    def shapes(self) -> tuple[tuple[int], tuple[int, int]]:
        """Shapes of mean and covariance."""
        return (self.manifold.size,), (self.manifold.dim, self.manifold.dim)

    def pack(self, mean: Array, cov: Array) -> Array:
        """A belief of no particular form, as an array of this layout; NaN where nothing is known."""
        numbers = np.full(self.size, np.nan)
        numbers[: self.belief] = np.concatenate([mean, np.ravel(cov)])
        return numbers

    @property
    def belief(self) -> int:
        """Numbers of mean and covariance."""
        return self.manifold.size + self.manifold.dim**2

    @property
    def innovation(self) -> int:
        """Index of the first number of the innovation."""
        return self.belief + self.extra

    @property
    def size(self) -> int:
        """Length of the array."""
        return self.innovation + self.width + self.width**2 + 2


class Belief:
    """What is known at one time: a mean on the manifold and a covariance in the tangent there.

    Beliefs are values: filters make new ones and never write to one that they were given, so any of them may
    be kept, to go back to it or to try two things from it.
    """

    __slots__ = ("_layout", "_numbers", "_t")

    def __init__(self, numbers: Array, t: int, layout: Layout) -> None:
        self._numbers, self._t, self._layout = numbers, t, layout

    @property
    def t(self) -> int:
        """Time of the belief, int nanoseconds."""
        return self._t

    @property
    def mean(self) -> Array:
        """(n,) read-only."""
        self._numbers.flags.writeable = False
        return self._numbers[: self._layout.manifold.size]

    @property
    def cov(self) -> Array:
        """(d, d) read-only, in the tangent at the mean."""
        self._numbers.flags.writeable = False
        n, d = self._layout.manifold.size, self._layout.manifold.dim
        return self._numbers[n : n + d * d].reshape(d, d)

    @property
    def sigmas(self) -> Array:
        """(d,) standard deviations along the tangent directions."""
        return np.sqrt(np.diagonal(self.cov))

    @property
    def manifold(self) -> Manifold:
        """Where the mean lives."""
        return self._layout.manifold

    def at(self, t: int) -> Belief:
        """The same belief, said to be of another time in int nanoseconds."""
        return self if t == self._t else Belief(self._numbers, t, self._layout)

    def gaussian(self) -> Gaussian:
        """The same belief as the prior of a model."""
        return Gaussian(self.mean, self.cov)

    def __repr__(self) -> str:
        return f"Belief(t={self._t * 1e-9:.6f} s, mean={self.mean}, sigmas={self.sigmas})"


class Innovation:
    """A reading beside what was expected of it; computed when asked for."""

    __slots__ = ("_dim", "_layout", "_numbers")

    def __init__(self, numbers: Array, dim: int, layout: Layout) -> None:
        self._numbers, self._dim, self._layout = numbers, dim, layout

    @property
    def residual(self) -> Array:
        """(m,) measured minus expected, in the tangent of the measurement; zero where a component missed."""
        self._numbers.flags.writeable = False
        return self._numbers[self._layout.innovation :][: self._dim]

    @property
    def cov(self) -> Array:
        """(m, m) covariance of the residual; a missing component has a unit variance of its own."""
        self._numbers.flags.writeable = False
        begin, width = self._layout.innovation + self._layout.width, self._layout.width
        whole = self._numbers[begin : begin + width * width].reshape(width, width)
        return whole[: self._dim, : self._dim]

    @property
    def nis(self) -> float:
        """Normalised innovation squared, rᵀ S⁻¹ r; NaN where the whole reading missed."""
        if np.isnan(self.residual).any():
            return float("nan")
        return float(self.residual @ np.linalg.solve(self.cov, self.residual))

    @property
    def accepted(self) -> bool:
        """Whether the reading was used: False where a gate rejected it, or the whole of it missed."""
        return bool(self._numbers[-2])

    @property
    def log_likelihood(self) -> float:
        """Log density of the reading given the belief before; 0 where it was not accepted."""
        return float(self._numbers[-1])

    def __repr__(self) -> str:
        return f"Innovation(residual={self.residual}, nis={self.nis:.3g}, accepted={self.accepted})"
