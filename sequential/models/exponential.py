"""The matrix exponential and the noise gathered on the way, for one A and any step, without an eigenvalue.

The series of F(h) = exp(A h), of Q(h) = ∫ F(s) D F(s)ᵀ ds and of ∫ F(s) B ds are tabulated once, with the
model.  A step sums them where they converge at once, and doubles from a short interval where not:
F(2h) = F(h)², Q(2h) = Q(h) + F(h) Q(h) F(h)ᵀ.  Nilpotent A have finite series, which are never doubled.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.model import Functions, as_params

__all__ = ["tabulated_series"]

Array = NDArray[np.float64]

TERMS = 20  # of the series of F; 0.5^21 / 21! is 1e-26
NOISE_TERMS = 26  # of the series of Q, which converges half as fast
RADIUS = 0.5  # largest ‖A‖ h that the series are summed at


def tabulated_series(a: Array, density: Array, b: Array) -> Functions:
    """The raw functions of dx = A x + B u + w, with the series as their numbers.

    Parameters
    ----------
    a : (n, n)
    density : (n, n) spectral density of w
    b : (n, m), with m = 0 where nothing drives it
    """
    n, m = b.shape
    powers, grown = [np.eye(n)], [density]
    for k in range(1, TERMS + 1):
        powers.append(a @ powers[-1] / k)
    for k in range(2, NOISE_TERMS + 1):
        half = a @ grown[-1]
        grown.append((half + half.T) / k)
    nilpotent = n <= TERMS and not powers[n].any()
    powers, grown = _without_zeros(powers), _without_zeros(grown)
    rate = 0.0 if nilpotent else _rate(a)
    driven = [power @ b / (k + 1) for k, power in enumerate(powers)]
    params = as_params(n, m, len(powers), len(grown), rate, powers, grown, driven)
    if not np.isfinite(params).all():
        raise ModelError("A of a linear process is too large for double precision; use other units")
    return Functions(step, jacobian, params, m, noise, helpers=HELPERS)


def _without_zeros(series: list[Array]) -> list[Array]:
    """The terms up to the last that is not zero, one at least."""
    last = max((k for k, term in enumerate(series) if term.any()), default=0)
    return series[: last + 1]


def _rate(a: Array) -> float:
    """A bound of ‖Aᵏ‖^(1/k) for the powers of the tail (Al-Mohy and Higham 2009, theorem 4.2)."""
    fourth = np.linalg.matrix_power(a, 4)
    higher = (np.linalg.norm(fourth, 1) ** (1 / 4), np.linalg.norm(fourth @ a, 1) ** (1 / 5))
    return float(min(np.linalg.norm(a, 1), max(higher)))


def halvings(dt: float, p: Any) -> int:
    """How often a step is halved for the series to converge."""
    size = p[4] * abs(dt)
    return 0 if not size > RADIUS else math.ceil(math.log2(size / RADIUS))


def power_sum(p: Any, at: int, stride: int, count: int, h: float) -> float:
    """Σ_k p[at + k·stride] hᵏ, by Horner's rule."""
    total = 0.0
    for k in range(count - 1, -1, -1):
        total = total * h + p[at + k * stride]
    return total


def square(f: Any, n: int, work: Any) -> None:
    """F <- F F."""
    copy(f, work, n * n)
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total += work[i * n + k] * work[k * n + j]
            f[i * n + j] = total


def arrival(x: Any, u: Any, h: float, p: Any, out: Any) -> None:
    """F(h) x + ∫ F B u over an interval that is short enough for the series."""
    n, m, count = int(p[0]), int(p[1]), int(p[2])
    nn, driven = n * n, 5 + (count + int(p[3])) * n * n
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += power_sum(p, 5 + i * n + j, nn, count, h) * x[j]
        for j in range(m):
            total += h * power_sum(p, driven + i * m + j, n * m, count, h) * u[j]
        out[i] = total


def step(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """F x + ∫ F B u; p = [n, m, terms of F, of Q, rate, F (terms·n·n), Q (terms·n·n), ∫F B (terms·n·m)]."""
    n, count = int(p[0]), int(p[2])
    nn, times = n * n, halvings(dt, p)
    h = math.ldexp(dt, -times)
    if times == 0:
        arrival(x, u, h, p, out)
        return
    f, driven, work = np.empty(nn), np.empty(n), np.zeros(nn)
    for i in range(nn):
        f[i] = power_sum(p, 5 + i, nn, count, h)
    arrival(work, u, h, p, driven)
    for _ in range(times):
        copy(driven, work, n)
        add_product(f, work, n, driven)
        square(f, n, work)
    copy(driven, out, n)
    add_product(f, x, n, out)


def copy(a: Any, out: Any, count: int) -> None:
    """The first numbers of a, into out."""
    for i in range(count):
        out[i] = a[i]


def add_product(f: Any, x: Any, n: int, out: Any) -> None:
    """Out += F x."""
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += f[i * n + j] * x[j]
        out[i] += total


def jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """F = exp(A dt)."""
    n, count = int(p[0]), int(p[2])
    nn, times = n * n, halvings(dt, p)
    h = math.ldexp(dt, -times)
    for i in range(nn):
        out[i] = power_sum(p, 5 + i, nn, count, h)
    if times > 0:
        work = np.empty(nn)
        for _ in range(times):
            square(out, n, work)


def noise(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Add Q, the noise gathered over dt."""
    n, count = int(p[0]), int(p[2])
    nn, times = n * n, halvings(dt, p)
    h = math.ldexp(dt, -times)
    first = 5 + count * nn
    if times == 0:
        for i in range(nn):
            out[i] += h * power_sum(p, first + i, nn, int(p[3]), h)
        return
    f, q, work, fq = np.empty(nn), np.empty(nn), np.empty(nn), np.empty(nn)
    for i in range(nn):
        f[i] = power_sum(p, 5 + i, nn, count, h)
        q[i] = h * power_sum(p, first + i, nn, int(p[3]), h)
    for _ in range(times):
        double(q, f, n, fq)
        square(f, n, work)
    for i in range(nn):
        out[i] += q[i]


def double(q: Any, f: Any, n: int, fq: Any) -> None:
    """Q <- Q + F Q Fᵀ, symmetric to the last bit."""
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total += f[i * n + k] * q[k * n + j]
            fq[i * n + j] = total
    for i in range(n):
        for j in range(i + 1):
            total = 0.0
            for k in range(n):
                total += fq[i * n + k] * f[j * n + k]
            q[i * n + j] += total
            q[j * n + i] = q[i * n + j]


HELPERS = (halvings, power_sum, copy, arrival, add_product, square, double)
