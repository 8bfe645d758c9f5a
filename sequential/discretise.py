"""Noise in continuous time, as the covariance that a step of dt seconds gathers.

Every function returns (F, Q) for x' = F x + w, cov w = Q.  States of several axes are ordered derivative by
derivative, [p (axes), v (axes), …], as the process models have them.
"""

from __future__ import annotations

import math
from typing import overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.manifold import Vector
from sequential.models.continuous import Dynamics, across, spread
from sequential.models.kinematic import CoordinatedTurn, GaussMarkov, Singer, positive

__all__ = [
    "coordinated_turn",
    "gauss_markov",
    "piecewise_white_acceleration",
    "piecewise_white_jerk",
    "singer",
    "van_loan",
    "white_noise_acceleration",
    "white_noise_jerk",
]

Array = NDArray[np.float64]
Pair = tuple[Array, Array]


@overload
def van_loan(
    A: ArrayLike, G: ArrayLike, spectral_density: ArrayLike, dt: float, B: None = None
) -> tuple[Array, Array]: ...
@overload
def van_loan(
    A: ArrayLike, G: ArrayLike, spectral_density: ArrayLike, dt: float, B: ArrayLike
) -> tuple[Array, Array, Array]: ...
def van_loan(
    A: ArrayLike, G: ArrayLike, spectral_density: ArrayLike, dt: float, B: ArrayLike | None = None
) -> tuple[Array, ...]:
    """Discretise dx = A x + B u + G w over dt, with w white and u constant.

    Parameters
    ----------
    A : (n, n) in 1/s
    G : (n, k) where the noise enters
    spectral_density : (k, k), (k,) or a number, unit²·s of w (two-sided)
    dt : s, zero or more
    B : (n, m) what the input does

    Returns
    -------
    F, Q : (n, n) transition exp(A dt) and covariance
    Bd : (n, m), only where a B is given: x' = F x + Bd u

    Notes
    -----
    van Loan 1978, Computing integrals involving the matrix exponential, IEEE TAC 23(3), theorem 1, over an
    interval so short that exp(-A h) does not grow, and doubled from there.
    """
    equation = spread(A, G, spectral_density, B)
    return _over(equation, dt, with_input=B is not None)


def _over(equation: Dynamics, dt: float, *, with_input: bool = False) -> tuple[Array, ...]:
    from scipy.linalg import expm

    positive("dt", dt, zero=True)
    a, density, b = equation
    n, m = b.shape
    size = float(np.linalg.norm(a, 1)) * dt
    halvings = max(0, math.ceil(math.log2(size))) if size > 1.0 else 0
    h = dt / 2.0**halvings
    block = np.zeros((2 * n + m, 2 * n + m))
    block[:n, :n], block[:n, n : 2 * n] = -a, density
    block[n : 2 * n, n : 2 * n] = a.T
    whole = expm(block * h)
    F = whole[n : 2 * n, n : 2 * n].T
    Q = F @ whole[:n, n : 2 * n]
    driven = np.zeros((n + m, n + m))
    driven[:n, :n], driven[:n, n:] = a, b
    Bd = expm(driven * h)[:n, n:]
    for _ in range(halvings):
        Q, Bd, F = Q + F @ Q @ F.T, Bd + F @ Bd, F @ F
    Q = (Q + Q.T) / 2
    return (F, Q, Bd) if with_input else (F, Q)


def white_noise_acceleration(dt: float, density: float, axes: int = 1) -> Pair:
    """Continuous white noise of spectral density q (m²/s³) in the acceleration; [p, v] per axis.

    Bar-Shalom, Li, Kirubarajan 2001, eq. 6.2.2-12.
    """
    q = positive("density", density, zero=True)
    cov: Array = q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    return _integrators(dt, 2, axes), across(cov, axes)


def white_noise_jerk(dt: float, density: float, axes: int = 1) -> Pair:
    """Continuous white noise of spectral density q (m²/s⁵) in the jerk; [p, v, a] per axis.

    Bar-Shalom, Li, Kirubarajan 2001, eq. 6.2.3-9.
    """
    q = positive("density", density, zero=True)
    cov: Array = q * np.array(
        [
            [dt**5 / 20, dt**4 / 8, dt**3 / 6],
            [dt**4 / 8, dt**3 / 3, dt**2 / 2],
            [dt**3 / 6, dt**2 / 2, dt],
        ]
    )
    return _integrators(dt, 3, axes), across(cov, axes)


def piecewise_white_acceleration(dt: float, sigma: float, axes: int = 1) -> Pair:
    """An acceleration of standard deviation σ (m/s²), constant in each step, anew in the next (DWNA).

    Its covariance has rank one per axis.  Two steps of dt/2 are *not* one of dt: σ belongs to the interval.
    Bar-Shalom, Li, Kirubarajan 2001, eq. 6.3.2-4.
    """
    gain = positive("sigma", sigma, zero=True) * np.array([dt**2 / 2, dt])
    return _integrators(dt, 2, axes), across(np.outer(gain, gain), axes)


def piecewise_white_jerk(dt: float, sigma: float, axes: int = 1) -> Pair:
    """An acceleration that gains an increment of standard deviation σ (m/s²) in each step (DWPA).

    Bar-Shalom, Li, Kirubarajan 2001, eq. 6.3.3-4: the gain is [dt²/2, dt, 1].
    """
    gain = positive("sigma", sigma, zero=True) * np.array([dt**2 / 2, dt, 1.0])
    return _integrators(dt, 3, axes), across(np.outer(gain, gain), axes)


def singer(dt: float, time_constant: float, acceleration_sigma: float, axes: int = 1) -> Pair:
    """Acceleration as a Gauss-Markov process; [p, v, a] per axis (Singer 1970).

    Taken from van Loan's exponential: the closed form loses its digits where dt is far below the time
    constant.
    """
    F, Q = _over(Singer(time_constant, acceleration_sigma, axes).dynamics(Vector(3 * axes)), dt)
    return F, Q


def gauss_markov(dt: float, time_constant: ArrayLike, sigma: ArrayLike) -> Pair:
    """First-order Gauss-Markov (Ornstein-Uhlenbeck) components of standard deviation σ in the long run.

    F = exp(-dt/τ), Q = σ² (1 - exp(-2 dt/τ)); τ (s) and σ are numbers or (n,).
    """
    tau, own = np.broadcast_arrays(*(np.atleast_1d(np.asarray(v, float)) for v in (time_constant, sigma)))
    GaussMarkov(tau, own).dynamics(Vector(len(tau)))
    return np.diag(np.exp(-dt / tau)), np.diag(-(own**2) * np.expm1(-2.0 * dt / tau))


def coordinated_turn(dt: float, turn_rate: float, density: float) -> Pair:
    """A planar turn at a known rate (rad/s), [x, y, vx, vy], white acceleration of density q (m²/s³)."""
    F, Q = _over(CoordinatedTurn(turn_rate, density).dynamics(Vector(4)), dt)
    return F, Q


def _integrators(dt: float, order: int, axes: int) -> Array:
    positive("dt", dt, zero=True)
    terms = [dt**k / math.factorial(k) * np.eye(order, k=k) for k in range(order)]
    return across(np.sum(terms, axis=0), axes)
