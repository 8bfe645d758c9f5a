"""Neighbouring nodes, smoothed together: what expectation-maximisation and sampling need beside the means."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.history import Run
from sequential.timeline import Problem

__all__ = ["SmoothedPairs", "smoothed_pairs"]

Array = NDArray[np.float64]
SINGULAR = 1e-13  # of the largest: directions of a normalised covariance below this are known exactly


@dataclass(frozen=True, slots=True, eq=False)
class SmoothedPairs:
    """Beliefs about each node, and about each node together with the one before, given all readings.

    Parameters
    ----------
    forward : the filter's run, with predictions
    mean, cov : (K, n), (K, d, d) smoothed
    cross : (K, d, d) covariance of node k with node k-1; entry 0 is zero
    """

    forward: Run
    mean: Array
    cov: Array
    cross: Array


def smoothed_pairs(problem: Problem, recursive: Any) -> SmoothedPairs:
    """Filter and smooth a problem, keeping the covariance of neighbours.

    Parameters
    ----------
    recursive : a filter with a `keep` setting

    Notes
    -----
    Cov(x_k, x_{k-1} | all) = P_{k|N} G_{k-1}ᵀ with the smoother's gain G (Shumway and Stoffer 2017, property
    6.3, in the form of Särkkä and Svensson 2023, section 12.1).
    """
    from sequential.kernels.smoothing import smooth_history

    forward = replace(recursive, keep=True).solve(problem)
    ahead = forward.predicted
    assert ahead is not None  # noqa: S101 - keep=True, for the type checker
    mean, cov = np.empty_like(forward.mean), np.empty_like(forward.cov)
    table = problem.model.manifold.table()
    smooth_history(table, forward.mean, forward.cov, ahead.mean, ahead.cov, ahead.transition, 1, mean, cov)
    cross = np.zeros_like(cov)
    pushed = ahead.transition[1:] @ forward.cov[:-1]  # Φ P, whose transpose times the inverse is the gain
    cross[1:] = cov[1:] @ _divided(ahead.cov[1:], pushed)
    return SmoothedPairs(forward, mean, cov, cross)


def _divided(cov: Array, right: Array) -> Array:
    """(K, d, d) cov⁻¹ right, by the pseudo-inverse where a covariance is singular."""
    scale = np.sqrt(np.diagonal(cov, axis1=1, axis2=2))
    scale = np.where(scale > 0.0, scale, 1.0)
    normal = cov / (scale[:, :, None] * scale[:, None, :])
    try:
        solved = np.linalg.solve(normal, right / scale[:, :, None])
    except np.linalg.LinAlgError:
        solved = np.linalg.pinv(normal, rcond=SINGULAR, hermitian=True) @ (right / scale[:, :, None])
    return np.asarray(solved / scale[:, :, None])
