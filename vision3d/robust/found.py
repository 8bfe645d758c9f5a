"""What a search ends with, and how that becomes a result in the unit of the data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from vision3d.robust.result import RobustFit

__all__ = ["Found", "relative_weights", "result_of"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """What a search ends with: the model (p,), squared errors, and the weights (N,) of its last fit.

    The covariance of the model is sigma² · inflation times the inverse information of the weighted rows.
    """

    model: Array
    errors2: Array
    weights: Array
    sigma2: float
    threshold2: float
    iterations: int
    stopped: str
    backend: str = "own"
    inflation: float = 1.0
    note: str = ""

    def variance(self, sigma: Array | float | None, scale: float = 1.0) -> float:
        """What to multiply the inverse information by; sigma, where it is known, is in units of 1 / scale."""
        known = self.sigma2 if sigma is None else (float(np.median(sigma)) / scale) ** 2
        return self.inflation * known


def result_of(found: Found, model: Array, cov: Array, *, scale: float = 1.0, note: str = "") -> RobustFit:
    """The result, with errors multiplied by scale: the unit of the data over that of the search."""
    inliers = found.errors2 < found.threshold2
    cost = np.where(inliers, found.errors2 / found.threshold2, 1.0)
    return RobustFit(
        model=model,
        cov=cov,
        inliers=inliers,
        errors=scale * np.sqrt(found.errors2),
        sigma=scale * float(np.sqrt(found.sigma2)),
        iterations=found.iterations,
        stopped=found.stopped,
        score=float(cost.mean()),
        threshold=scale * float(np.sqrt(found.threshold2)),
        backend=found.backend,
        note=note or found.note,
    )


def relative_weights(sigma: Array | float | None, count: int) -> Array:
    """(median sigma / sigma)² of each row; 1 without sigmas.

    Raises
    ------
    DataError
        for sigmas that are not one positive number a row.
    """
    if sigma is None or np.ndim(sigma) == 0:
        return np.ones(count)
    given = np.ascontiguousarray(sigma, dtype=np.float64)
    if given.shape != (count,) or not (given > 0.0).all() or not np.isfinite(given).all():
        raise DataError(
            f"sigma is one positive standard deviation for each of {count} rows; got {given.shape}"
        )
    return np.asarray((np.median(given) / given) ** 2)
