"""Stumpff functions: the coefficients of every exponential on rotations, without a singularity at zero.

With ``x`` the squared angle, ``c_k(x) = sum_j (-x)^j / (k + 2j)!``; so ``c_0 = cos a``, ``c_1 = sin a / a``,
``c_2 = (1 - cos a) / a^2``, ``c_3 = (a - sin a) / a^3`` and so on.  Written with them, the closed forms of
the Lie group textbooks (where each divides by a power of the angle) need no special case.
"""

from __future__ import annotations

from functools import cache
from math import factorial
from typing import Any

import numpy as np

from sequential.manifold.protocol import Array

__all__ = ["SERIES_BELOW", "SERIES_TERMS", "half_cotangent", "inverse_coefficient", "stumpff"]

SERIES_BELOW = 1.0
"""Squared angle (rad²) under which the Taylor series is summed; the closed forms cancel digits there."""

FEW = 8  # so many angles are summed as plain numbers, which saves the start of twenty array operations

SERIES_TERMS = 10
"""Terms kept: the first one left out is below 1 / 20! = 4e-19 for squared angles under `SERIES_BELOW`."""


def stumpff(order: int, squared: Array) -> Array:
    """Evaluate the Stumpff function c_order.

    Parameters
    ----------
    order : int
        k >= 0.
    squared : Array
        Squared angles (...), rad², not negative.

    Returns
    -------
    Array
        c_k, shape (...), with a relative error below 1e-13 for k <= 5.
    """
    small = squared < SERIES_BELOW
    if np.all(small):
        return _series(order, squared)
    series = _series(order, np.where(small, squared, 0.0))
    closed = _closed(order, np.where(small, SERIES_BELOW, squared))
    return np.where(small, series, closed)


def half_cotangent(squared: Array) -> Array:
    """Evaluate (a/2) cot(a/2) = c_1 / (2 c_2); regular at 0 and pi, with a pole at a = 2 pi."""
    return stumpff(1, squared) / (2.0 * stumpff(2, squared))


def inverse_coefficient(squared: Array) -> Array:
    """Evaluate (1 - (a/2) cot(a/2)) / a^2, which multiplies skew² in the inverse Jacobians of SO(3).

    It equals ``(c_3 - 2 c_4) / (2 c_2)``, which shows that it is 1/12 at a = 0 and regular at pi.
    """
    return (stumpff(3, squared) - 2.0 * stumpff(4, squared)) / (2.0 * stumpff(2, squared))


def _series(order: int, squared: Array) -> Array:
    """Sum the Taylor series by Horner's rule."""
    coefficients = _coefficients(order)
    if np.size(squared) <= FEW:
        own = [_horner(coefficients, x) for x in np.ravel(squared).tolist()]
        return np.reshape(own, np.shape(squared))
    return np.asarray(_horner(coefficients, squared))


def _horner(coefficients: tuple[float, ...], squared: Any) -> Any:
    """The sum for a number or for an array, the same to the last bit."""
    total = coefficients[0]
    for coefficient in coefficients[1:]:
        total = coefficient - squared * total
    return total


@cache
def _coefficients(order: int) -> tuple[float, ...]:
    """Of the series, highest power first."""
    return tuple(1.0 / factorial(order + 2 * term) for term in reversed(range(SERIES_TERMS)))


def _closed(order: int, squared: Array) -> Array:
    """Climb from cos or sin by the recurrence c_{k+2} = (1/k! - c_k) / x."""
    angle = np.sqrt(squared)
    value = np.sin(angle) / angle if order % 2 else np.cos(angle)
    for low in range(order % 2, order, 2):
        value = (1.0 / factorial(low) - value) / squared
    return value
