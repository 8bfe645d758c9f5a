"""A linear process in continuous time, dx = (A x + B u) dt + G dw, discretised exactly for any step."""

from __future__ import annotations

import abc
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import NotFiniteError, ShapeError
from sequential.manifold import Manifold
from sequential.model import Functions, ProcessModel
from sequential.models.exponential import tabulated_series
from sequential.models.linear import require_flat
from sequential.noise import require_covariance

__all__ = ["ContinuousProcess", "Dynamics", "LinearDynamics", "across", "spread"]

Array = NDArray[np.float64]


class Dynamics(NamedTuple):
    """dx = (A x + B u) dt + white noise of spectral density D = G S Gᵀ."""

    A: Array  # (n, n)
    density: Array  # (n, n)
    B: Array  # (n, m), with m = 0 where nothing drives it


class LinearDynamics(ProcessModel):
    """A process that is a linear stochastic differential equation; steps may be cut anywhere."""

    linear: bool = True

    @abc.abstractmethod
    def dynamics(self, manifold: Manifold) -> Dynamics:
        """The equation on `manifold`; raises `ModelError` where the two do not fit."""

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `ProcessModel.functions`."""
        return tabulated_series(*self.dynamics(manifold))


@dataclass(frozen=True, eq=False)
class ContinuousProcess(LinearDynamics):
    """dx = A x + B u + G w, with w white of spectral density S, and u constant from sample to sample.

    Parameters
    ----------
    A : (n, n) in 1/s
    G : (n, k) where the noise enters
    spectral_density : S, (k, k), (k,) or a number, unit²·s of w (two-sided)
    B : (n, m) what the input does; the input stream then has m columns

    Raises
    ------
    ShapeError, NotFiniteError, NotPositiveDefiniteError
        where the matrices do not fit together, or S is no covariance.

    Notes
    -----
    Exact for any step, in the sense of van Loan 1978 (Computing integrals involving the matrix exponential).
    """

    A: ArrayLike
    G: ArrayLike
    spectral_density: ArrayLike
    B: ArrayLike | None = None
    linear: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "_equation", spread(self.A, self.G, self.spectral_density, self.B))

    def dynamics(self, manifold: Manifold) -> Dynamics:
        """The equation as declared."""
        equation: Dynamics = self._equation  # type: ignore[attr-defined]  # set above
        require_flat(manifold, len(equation.A), "ContinuousProcess")
        return equation


def spread(A: ArrayLike, G: ArrayLike, spectral_density: ArrayLike, B: ArrayLike | None = None) -> Dynamics:
    """Check the matrices of a stochastic differential equation and join G S Gᵀ.

    Raises
    ------
    ShapeError, NotFiniteError, NotPositiveDefiniteError
    """
    a = np.atleast_2d(np.array(A, dtype=np.float64))
    n = len(a)
    if a.shape != (n, n):
        raise ShapeError(f"A of a linear process is square, (n, n); got {np.shape(A)}")
    g, b = _columns(G, n, "G"), np.zeros((n, 0)) if B is None else _columns(B, n, "B")
    for name, value in (("A", a), ("G", g), ("B", b)):
        if not np.isfinite(value).all():
            raise NotFiniteError(f"{name} of a linear process holds NaN or infinity")
    s = require_covariance(spectral_density, g.shape[1], "spectral_density", definite=False)
    density = g @ s @ g.T
    return Dynamics(a, (density + density.T) / 2, b)


def _columns(given: ArrayLike, n: int, name: str) -> Array:
    own = np.array(given, dtype=np.float64)
    own = own.reshape(-1, 1) if own.ndim < 2 else own
    if own.ndim != 2 or len(own) != n:
        raise ShapeError(f"{name} of a linear process has shape ({n}, k), got {np.shape(given)}")
    return own


def across(matrix: Array, axes: int) -> Array:
    """One axis' matrix (k, k) for several axes, (k·axes, k·axes), ordered derivative by derivative."""
    return np.asarray(np.kron(matrix, np.eye(axes)), dtype=np.float64)
