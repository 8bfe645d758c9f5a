"""Uniform B-splines of any order: weights of the control values within one interval of knots.

Qin 2000, "General matrix representations for B-splines": within an interval the weights are polynomials of
the local time u in [0, 1]; their sums from the end make a spline cumulative, so that it works on rotations.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

__all__ = ["cumulative_weights", "weights"]

Array = NDArray[np.float64]


@lru_cache(maxsize=16)
def _matrix(order: int) -> Array:
    """(order, order): row j holds the coefficients of 1, u, u² … of the weight of control value j."""
    matrix = np.ones((1, 1))
    for k in range(2, order + 1):
        # N_j,k(u) = (u + k - 1 - j) / (k - 1) N_{j-1,k-1}(u) + (j + 1 - u) / (k - 1) N_j,k-1(u)
        wider = np.zeros((k, k))
        for j in range(k):
            if j > 0:
                wider[j, : k - 1] += (k - 1 - j) / (k - 1) * matrix[j - 1]
                wider[j, 1:] += matrix[j - 1] / (k - 1)
            if j < k - 1:
                wider[j, : k - 1] += (j + 1) / (k - 1) * matrix[j]
                wider[j, 1:] -= matrix[j] / (k - 1)
        matrix = wider
    matrix.flags.writeable = False
    return matrix


def weights(order: int, u: Array, derivative: int = 0) -> Array:
    """Weights (N, order) at local times (N,), or a derivative of them by u."""
    powers = np.zeros((len(u), order))
    for n in range(derivative, order):
        factor = float(np.prod(np.arange(n, n - derivative, -1)))
        powers[:, n] = factor * u ** (n - derivative)
    product: Array = powers @ _matrix(order).T
    return product


def cumulative_weights(order: int, u: Array, derivative: int = 0) -> Array:
    """(N, order - 1): the weight of the step from control value j - 1 to j, for j = 1 … order - 1."""
    own = weights(order, u, derivative)
    return np.asarray(np.cumsum(own[:, ::-1], axis=1)[:, ::-1][:, 1:])
