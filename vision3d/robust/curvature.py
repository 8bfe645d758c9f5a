"""The covariance of a model of which only squared errors are known: by differences of their sum."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["covariance_by_differences"]

Array = NDArray[np.float64]
FIRST, SHARE = 1e-4, 0.3  # first step, relative; the second in standard deviations of that parameter
SINGULAR = 1e-10


def covariance_by_differences(
    errors2: Callable[[Array], Array], weights: Array, model: Array, sigma2: float
) -> Array:
    """The covariance (p, p) of a model (p,) whose parameters are all free, at the minimum of its cost.

    Parameters
    ----------
    errors2 : model -> squared errors (N,)
    weights : (N,) of the rows
    sigma2 : variance of an error's component

    Returns
    -------
    ndarray
        sigma² times the inverse of half the second derivatives of the weighted sum; NaN where that is
        singular, or the model is no minimum
    """
    p = len(model)
    held = weights > 0.0

    def cost(move: Array) -> float:
        return float(weights[held] @ errors2(model + move)[held])

    rest, steps = cost(np.zeros(p)), FIRST * (1.0 + np.abs(model))
    for i, step in enumerate(np.diag(steps)):
        bend = (cost(step) - 2.0 * rest + cost(-step)) / (2.0 * steps[i] ** 2)
        if not (np.isfinite(bend) and bend > 0.0 and sigma2 > 0.0):
            return np.full((p, p), np.nan)
        steps[i] = SHARE * np.sqrt(sigma2 / bend)
    curvature = np.empty((p, p))
    along = np.diag(steps)
    for i in range(p):
        for j in range(i + 1):
            a, b = along[i], along[j]
            mixed = cost(a + b) - cost(a - b) - cost(b - a) + cost(-a - b)
            curvature[i, j] = curvature[j, i] = mixed / 8.0
    values = np.linalg.eigvalsh(curvature)
    if not values[0] > SINGULAR * values[-1]:
        return np.full((p, p), np.nan)
    return np.asarray(sigma2 * np.outer(steps, steps) * np.linalg.inv(curvature))
