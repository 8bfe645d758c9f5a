"""Motion by linear stochastic differential equations: acceleration, manoeuvre, turn, and what forgets."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError
from sequential.manifold import Manifold, Product
from sequential.model import ProcessModel
from sequential.models.continuous import Dynamics, LinearDynamics, across
from sequential.models.linear import require_flat
from sequential.noise import require_covariance

__all__ = ["ConstantAcceleration", "CoordinatedTurn", "GaussMarkov", "Independent", "Singer"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ConstantAcceleration(LinearDynamics):
    """Nearly constant acceleration: white noise in the jerk.

    Parameters
    ----------
    jerk_density : spectral density q of the jerk, m²/s⁵ (one number for every axis)
    axes : number of position axes; the state is [p (axes), v (axes), a (axes)]

    Notes
    -----
    Q = q [[dt⁵/20, dt⁴/8, dt³/6], [·, dt³/3, dt²/2], [·, ·, dt]] per axis (Bar-Shalom, Li, Kirubarajan 2001,
    eq. 6.2.3-9).
    """

    jerk_density: float
    axes: int = 1
    linear: bool = True

    def dynamics(self, manifold: Manifold) -> Dynamics:
        """The chain of integrators with noise at its end."""
        return _chain(self, manifold, 0.0, positive("jerk_density", self.jerk_density, zero=True))


@dataclass(frozen=True, eq=False)
class Singer(LinearDynamics):
    """A target that manoeuvres: acceleration as a first-order Gauss-Markov process (Singer 1970).

    Parameters
    ----------
    time_constant : how long a manoeuvre lasts, s: the autocorrelation of a is σ² exp(-|t|/time_constant)
    acceleration_sigma : σ, standard deviation of the acceleration, m/s²
    axes : number of position axes; the state is [p (axes), v (axes), a (axes)]
    """

    time_constant: float
    acceleration_sigma: float
    axes: int = 1
    linear: bool = True

    def dynamics(self, manifold: Manifold) -> Dynamics:
        """The chain of integrators, its end decaying."""
        rate = 1.0 / positive("time_constant", self.time_constant)
        sigma = positive("acceleration_sigma", self.acceleration_sigma, zero=True)
        return _chain(self, manifold, rate, 2.0 * rate * sigma**2)


@dataclass(frozen=True, eq=False)
class GaussMarkov(LinearDynamics):
    """First-order Gauss-Markov (Ornstein-Uhlenbeck): white noise that is forgotten, such as a drifting bias.

    Parameters
    ----------
    time_constant : τ, s; a number, or (n,) one for each component
    sigma : standard deviation in the long run, a number or (n,); or `cov`, (n, n), in its place

    Notes
    -----
    x' = exp(-dt/τ) x + w, cov w = σ² (1 - exp(-2 dt/τ)); the spectral density is 2σ²/τ.  With a `cov` that is
    not diagonal and several τ, the density is that whose stationary covariance is `cov`.
    """

    time_constant: ArrayLike
    sigma: ArrayLike | None = None
    cov: ArrayLike | None = None
    linear: bool = True

    def dynamics(self, manifold: Manifold) -> Dynamics:
        """Independent decay of every component."""
        n = manifold.size
        require_flat(manifold, n, "GaussMarkov")
        tau = np.broadcast_to(np.asarray(self.time_constant, dtype=np.float64), (n,))
        for value in tau:
            positive("time_constant", float(value))
        if (self.sigma is None) == (self.cov is None):
            raise ModelError("a GaussMarkov needs either sigma=… or cov=…, one of the two")
        given: Any = self.cov if self.sigma is None else np.asarray(self.sigma, dtype=np.float64) ** 2
        cov = require_covariance(given, n, "the stationary covariance of a GaussMarkov", definite=False)
        rates = 1.0 / tau
        density = (rates[:, None] + rates) * cov
        checked = require_covariance(density, n, "the density of a GaussMarkov", definite=False)
        return Dynamics(-np.diag(rates), checked, np.zeros((n, 0)))


@dataclass(frozen=True, eq=False)
class CoordinatedTurn(LinearDynamics):
    """A planar turn at a known rate, with white acceleration; the state is [x, y, vx, vy].

    Parameters
    ----------
    turn_rate : rad/s, counter-clockwise; 0 is constant velocity
    acceleration_density : spectral density of the acceleration on each axis, m²/s³
    """

    turn_rate: float
    acceleration_density: float
    linear: bool = True

    def dynamics(self, manifold: Manifold) -> Dynamics:
        """The velocity turns, the position follows."""
        require_flat(manifold, 4, "CoordinatedTurn")
        q = positive("acceleration_density", self.acceleration_density, zero=True)
        if not math.isfinite(self.turn_rate):
            raise ModelError(f"turn_rate is {self.turn_rate}; it must be finite")
        a = np.zeros((4, 4))
        a[0, 2] = a[1, 3] = 1.0
        a[2, 3], a[3, 2] = -self.turn_rate, self.turn_rate
        return Dynamics(a, np.diag([0.0, 0.0, q, q]), np.zeros((4, 0)))


@final
@dataclass(frozen=True, eq=False, init=False)
class Independent(LinearDynamics):
    """Parts of a product state that move each by its own linear equation.

    The state is a `Product` of vectors with the same names, and the input, where parts have one, is theirs
    side by side in the order of the parts.

    >>> import sequential as sq
    >>> state = sq.Product(motion=sq.Vector(2), bias=sq.Vector(1))
    >>> process = sq.Independent(motion=sq.ConstantVelocity(0.1), bias=sq.GaussMarkov(100.0, 0.2))
    >>> process.dynamics(state).A.shape
    (3, 3)
    """

    processes: Mapping[str, ProcessModel]
    linear: bool = True

    def __init__(self, /, **processes: ProcessModel) -> None:
        """Keep the processes by the name of their part."""
        for name, process in processes.items():
            if not hasattr(process, "dynamics"):
                raise ModelError(
                    f"part {name!r} of Independent is a {type(process).__name__}, which is no linear "
                    "differential equation; ConstantVelocity, GaussMarkov and ContinuousProcess are"
                )
        object.__setattr__(self, "processes", MappingProxyType(dict(processes)))

    def dynamics(self, manifold: Manifold) -> Dynamics:
        """The equations along the diagonal."""
        names = manifold.names if isinstance(manifold, Product) else ()
        if not isinstance(manifold, Product) or set(names) != set(self.processes):
            raise ModelError(
                f"Independent moves the parts {', '.join(self.processes)}; the state is {manifold}"
            )
        parts: list[Dynamics] = []
        for name in names:
            process: Any = self.processes[name]
            parts.append(process.dynamics(manifold.part(name)))
        return Dynamics(*(_diagonal_blocks([part[k] for part in parts]) for k in range(3)))


def _chain(process: Any, manifold: Manifold, rate: float, density: float) -> Dynamics:
    """Position, velocity, acceleration that decays at a rate and is driven by white noise."""
    axes = int(process.axes)
    require_flat(manifold, 3 * axes, f"{type(process).__name__}(axes={axes})")
    a = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -rate]])
    d = np.diag([0.0, 0.0, density])
    return Dynamics(across(a, axes), across(d, axes), np.zeros((3 * axes, 0)))


def _diagonal_blocks(blocks: list[Array]) -> Array:
    whole = np.zeros((sum(len(b) for b in blocks), sum(b.shape[1] for b in blocks)))
    row = column = 0
    for block in blocks:
        whole[row : row + len(block), column : column + block.shape[1]] = block
        row, column = row + len(block), column + block.shape[1]
    return whole


def positive(name: str, value: float, *, zero: bool = False) -> float:
    """A number that makes sense, or a `ModelError` that names it."""
    if not math.isfinite(value) or value < 0 or (value == 0 and not zero):
        raise ModelError(
            f"{name} is {value}; it must be {'zero or more' if zero else 'above zero'} and finite"
        )
    return float(value)
