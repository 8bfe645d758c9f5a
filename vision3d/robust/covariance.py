"""Covariances of models that are written with more numbers than they have degrees of freedom."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["pseudo_inverse", "unit_norm"]

Array = NDArray[np.float64]
SINGULAR = 1e-14


def pseudo_inverse(information: Array, null: Array) -> Array:
    """The inverse (p, p) of information, at right angles to the rows of null (q, p), which are orthonormal.

    NaN where the information is singular on that space too: the data leave the model undetermined.
    """
    mean = float(np.trace(information)) / len(information)
    along = null.T @ null
    across = np.eye(len(information)) - along
    whole = across @ information @ across + mean * along
    values, vectors = np.linalg.eigh(whole)
    if not values[0] > SINGULAR * values[-1]:
        return np.full(information.shape, np.nan)
    return np.asarray((vectors / values) @ vectors.T - along / mean)


def unit_norm(model: Array, cov: Array) -> tuple[Array, Array]:
    """A model (p,) scaled to unit norm, and its covariance (p, p) then."""
    size = float(np.linalg.norm(model))
    unit = model / size
    across = np.eye(len(unit)) - np.outer(unit, unit)
    return unit, across @ cov @ across / size**2
