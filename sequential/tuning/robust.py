"""What a reading counts for where its sensor has a loss or a gate: a NIS that is bounded.

A filter gives a surprising reading less weight, or none.  A criterion that let the same reading count in
full would raise the noise of every reading until the outliers fit.  Here no reading counts for more than
its bound, scaled so that readings without outliers still give their own covariance: Huber's proposal 2
(Huber 1981, Robust Statistics, section 6.4), consistent at the normal distribution.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sequential.history import Innovations
from sequential.model import Loss, SensorModel

__all__ = ["bounded_nis", "robust_distance"]

Array = NDArray[np.float64]
CELLS = 20_000  # of the quantile rule behind an expectation under χ²


def robust_distance(loss: Loss, nis: Array, dim: int) -> Array:
    """(M,) what stands for the NIS in a likelihood, so that its slope over log σ² is the bounded NIS.

    Its sum with log det S is smallest, in the mean over Gaussian readings, at their own covariance.
    """
    most = dim * loss.k**2
    if loss.kind == "cauchy":
        rho = most * np.log1p(nis / most)
    else:
        rho = np.where(nis <= most, nis, most * (1.0 + np.log(np.maximum(nis, most) / most)))
    return np.asarray(_consistency(loss.kind, loss.k, dim) * rho)


def bounded_nis(seen: Innovations, sensor: SensorModel) -> Array:
    """(M,) NIS of all readings, bounded by loss and gate of the sensor; in the mean m for Gaussian ones."""
    nis = seen.nis() if len(seen.t) else np.zeros(0)
    found = np.empty_like(nis)
    rows = seen.dof()
    for dim in np.unique(rows).tolist():
        own = rows == dim
        found[own] = _bounded(nis[own], sensor, dim)
    return found


def _bounded(nis: Array, sensor: SensorModel, dim: int) -> Array:
    if sensor.gate is not None:
        top = _quantile(dim, sensor.gate)
        nis = np.minimum(nis, top) * (dim / float(np.minimum(_grid(dim), top).mean()))
    if sensor.loss is None:
        return nis
    kind, k = sensor.loss.kind, sensor.loss.k
    return np.asarray(_consistency(kind, k, dim) * _limited(kind, k, nis, dim))


def _limited(kind: str, k: float, nis: Array, dim: int) -> Array:
    """At most k² for each dimension: gradually for Cauchy's loss, sharply for Huber's."""
    most = dim * k**2
    return np.asarray(most * nis / (most + nis)) if kind == "cauchy" else np.minimum(nis, most)


@lru_cache(maxsize=64)
def _consistency(kind: str, k: float, dim: int) -> float:
    """The factor with which the bounded value of s ~ χ²(m) has the mean m."""
    return dim / float(_limited(kind, k, _grid(dim), dim).mean())


@lru_cache(maxsize=16)
def _grid(dim: int) -> Array:
    """Quantiles of χ²(m) at the middles of equal cells of probability."""
    from scipy.special import chdtri

    return np.asarray(chdtri(dim, (np.arange(CELLS) + 0.5) / CELLS), dtype=np.float64)


def _quantile(dim: int, probability: float) -> float:
    from scipy.special import chdtri

    return float(chdtri(dim, 1.0 - probability))
