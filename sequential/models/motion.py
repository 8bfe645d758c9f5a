"""Motion on a vector space: random walk and nearly constant velocity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError
from sequential.manifold import Manifold, Vector
from sequential.model import Functions, ProcessModel, as_params
from sequential.models.continuous import Dynamics, across
from sequential.models.declared import density_noise
from sequential.models.linear import require_flat
from sequential.noise import require_covariance

__all__ = ["ConstantVelocity", "RandomWalk"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RandomWalk(ProcessModel):
    """A state that stays where it is but for white noise in its rate.

    Parameters
    ----------
    density : spectral density of the rate, (d, d), (d,) or a number: unit² per second
    """

    density: ArrayLike
    linear: bool = True

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `ProcessModel.functions`."""
        n, d = manifold.size, manifold.dim
        cov = require_covariance(self.density, d, "the density of a RandomWalk", definite=False)
        return Functions(stay, stay_jacobian, as_params(d, cov, n), noise=density_noise)

    def dynamics(self, manifold: Manifold) -> Dynamics:
        """The equation dx = w on a flat state."""
        n = manifold.size
        require_flat(manifold, n, "RandomWalk as a differential equation")
        cov = require_covariance(self.density, n, "the density of a RandomWalk", definite=False)
        return Dynamics(np.zeros((n, n)), cov, np.zeros((n, 0)))


def stay(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """The state as it was; p = [d, density (d·d), n]."""
    d = int(p[0])
    for i in range(int(p[1 + d * d])):
        out[i] = x[i]


def stay_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Identity."""
    d = int(p[0])
    for i in range(d * d):
        out[i] = 0.0
    for i in range(d):
        out[i * d + i] = 1.0


@dataclass(frozen=True, eq=False)
class ConstantVelocity(ProcessModel):
    """Positions, then velocities, driven by white acceleration.

    Parameters
    ----------
    acceleration_density : spectral density q of the acceleration, m²/s³ (one number for every axis)
    axes : number of position axes; the state is [p (axes), v (axes)]

    Notes
    -----
    Exact discretisation: Q = q [[dt³/3, dt²/2], [dt²/2, dt]] per axis (Bar-Shalom, Li, Kirubarajan 2001,
    eq. 6.2.2-12).
    """

    acceleration_density: float
    axes: int = 1
    linear: bool = True

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `ProcessModel.functions`."""
        if not isinstance(manifold, Vector) or manifold.size != 2 * self.axes:
            msg = f"ConstantVelocity(axes={self.axes}) needs Vector({2 * self.axes}); the state is {manifold}"
            raise ModelError(msg)
        if not self.acceleration_density >= 0:
            msg = f"acceleration_density is {self.acceleration_density}; it must be zero or more"
            raise ModelError(msg)
        params = as_params(self.axes, self.acceleration_density)
        return Functions(coast, coast_jacobian, params, noise=acceleration_noise)

    def dynamics(self, manifold: Manifold) -> Dynamics:
        """The equation dp = v, dv = w."""
        self.functions(manifold)
        a, d = np.array([[0.0, 1.0], [0.0, 0.0]]), np.diag([0.0, self.acceleration_density])
        return Dynamics(across(a, self.axes), across(d, self.axes), np.zeros((2 * self.axes, 0)))


def coast(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Position advances by v·dt; p = [axes, q]."""
    axes = int(p[0])
    for i in range(axes):
        out[i] = x[i] + dt * x[axes + i]
        out[axes + i] = x[axes + i]


def coast_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """[[I, dt I], [0, I]]."""
    axes = int(p[0])
    d = 2 * axes
    for i in range(d * d):
        out[i] = 0.0
    for i in range(d):
        out[i * d + i] = 1.0
    for i in range(axes):
        out[i * d + axes + i] = dt


def acceleration_noise(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Add the exact covariance of white acceleration over dt."""
    axes = int(p[0])
    d = 2 * axes
    for i in range(axes):
        j = axes + i
        out[i * d + i] += p[1] * dt * dt * dt / 3.0
        out[i * d + j] += p[1] * dt * dt / 2.0
        out[j * d + i] += p[1] * dt * dt / 2.0
        out[j * d + j] += p[1] * dt
