"""Models that a user writes as ordinary functions: no decorators, Jacobians optional."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError
from sequential.manifold import Manifold
from sequential.model import (
    Functions,
    Loss,
    ProcessModel,
    SensorModel,
    as_params,
    plain,
    vector_or,
)
from sequential.noise import require_covariance

__all__ = ["LinearSensor", "Process", "Sensor"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Process(ProcessModel):
    """A process from ordinary functions.

    Parameters
    ----------
    step : `step(x, u, dt)` or `step(x, dt)` -> (n,) state after dt seconds
    noise_density : (d, d), (d,) or a number: spectral density, so that dt seconds add `noise_density * dt`
    noise_cov : instead, `noise_cov(x, u, dt)` or `noise_cov(x, dt)` -> (d, d)
    jacobian : same arguments -> (d, d); differenced where absent
    inputs : length of u
    linear : the step is linear in the state, so that a `KalmanFilter` may take it

    Notes
    -----
    Functions are compiled where Numba can; write them with scalars, `math` and `np.array([...])`.
    """

    step: Callable[..., Any]
    noise_density: ArrayLike | None = None
    noise_cov: Callable[..., Any] | None = None
    jacobian: Callable[..., Any] | None = None
    inputs: int = 0
    linear: bool = False

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `ProcessModel.functions`."""
        n, d = manifold.size, manifold.dim
        full = ("x", "u", "dt")
        if (self.noise_density is None) == (self.noise_cov is None):
            msg = "a Process needs either noise_density=… (per second) or noise_cov=…(x, dt), one of the two"
            raise ModelError(msg)
        params = as_params(0.0)
        noise: Any = density_noise
        if self.noise_density is not None:
            cov = require_covariance(self.noise_density, d, "noise_density", definite=False)
            params = as_params(d, cov)
        elif self.noise_cov is not None:
            noise = plain(self.noise_cov, full, d * d, adds=True)
        jacobian = None if self.jacobian is None else plain(self.jacobian, full, d * d)
        return Functions(plain(self.step, full, n), jacobian, params, self.inputs, noise)


@dataclass(frozen=True, eq=False)
class Sensor(SensorModel):
    """A sensor from ordinary functions.

    Parameters
    ----------
    observe : `observe(x)` or `observe(x, context)` -> (m,) what the sensor would read
    noise_cov : (m, m), (m,) variances, or a number; zero is a perfect reading, for filters only
    jacobian : same arguments -> (m, d); differenced where absent
    manifold : where the reading lives; a plain vector unless given (`SO2()` for a bearing)
    gate : probability, such as 0.999: readings whose NIS exceeds that χ² quantile are rejected
    loss : robust loss, `Loss("huber", 1.345)` or `Loss("cauchy", 1.0)`
    context : how many context columns of the stream `observe` is given
    """

    observe: Callable[..., Any]
    noise_cov: ArrayLike  # type: ignore[assignment]
    jacobian: Callable[..., Any] | None = None
    manifold: Manifold | None = None  # type: ignore[assignment]
    gate: float | None = None
    loss: Loss | None = None
    context: int = 0
    linear: bool = False

    def __post_init__(self) -> None:
        given = np.asarray(self.noise_cov, dtype=np.float64)
        dim = self.manifold.dim if self.manifold is not None else (len(given) if given.ndim else 1)
        object.__setattr__(self, "manifold", vector_or(self.manifold, dim))
        # a loss weighs whitened residuals, which a perfect reading does not have
        cov = require_covariance(given, dim, "the noise_cov of a sensor", definite=self.loss is not None)
        object.__setattr__(self, "noise_cov", cov)

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `SensorModel.functions`."""
        full, image = ("x", "u"), vector_or(self.manifold, 1)
        jacobian = None if self.jacobian is None else plain(self.jacobian, full, image.dim * manifold.dim)
        return Functions(plain(self.observe, full, image.size), jacobian, as_params(0.0), self.context)


@dataclass(frozen=True, eq=False)
class LinearSensor(SensorModel):
    """A sensor that reads `matrix @ x`: matrix (m, n), noise_cov (m, m).

    A noise_cov of zero, or a singular one, is a perfect reading: filters take it, factor graphs do not.
    """

    matrix: ArrayLike
    noise_cov: ArrayLike  # type: ignore[assignment]
    gate: float | None = None
    loss: Loss | None = None
    linear: bool = True

    def __post_init__(self) -> None:
        matrix = np.atleast_2d(np.asarray(self.matrix, dtype=np.float64))
        object.__setattr__(self, "matrix", matrix)
        object.__setattr__(self, "manifold", vector_or(None, len(matrix)))
        whose = "the noise_cov of a LinearSensor"
        cov = require_covariance(self.noise_cov, len(matrix), whose, definite=self.loss is not None)
        object.__setattr__(self, "noise_cov", cov)

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `SensorModel.functions`."""
        matrix = np.asarray(self.matrix)
        if matrix.shape[1] != manifold.size or manifold.size != manifold.dim:
            msg = f"LinearSensor's matrix has {matrix.shape[1]} columns, the state is {manifold}"
            raise ModelError(msg)
        return Functions(linear_observe, linear_jacobian, as_params(*matrix.shape, matrix))


def density_noise(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Add density·dt; p = [d, density (d·d)]."""
    d = int(p[0])
    for i in range(d * d):
        out[i] += p[1 + i] * dt


def linear_observe(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Matrix times state; p = [m, n, matrix (m·n)]."""
    m, n = int(p[0]), int(p[1])
    for i in range(m):
        total = 0.0
        for j in range(n):
            total += p[2 + i * n + j] * x[j]
        out[i] = total


def linear_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """The matrix itself."""
    for i in range(int(p[0]) * int(p[1])):
        out[i] = p[2 + i]
