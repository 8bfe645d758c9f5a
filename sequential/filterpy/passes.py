"""Whole sequences through a linear filter taken over: forward pass and RTS smoother."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ShapeError
from sequential.filterpy.linear_update import pseudo_inverse

__all__ = ["filter_pass", "smoother_gain", "smoother_pass"]

Array = NDArray[Any]
NAMES = ("Fs", "Qs", "Hs", "Rs", "Bs", "us")


def filter_pass(
    filter_: Any, zs: Any, tables: Sequence[Any], *, update_first: bool, saver: Any
) -> tuple[Array, Array, Array, Array]:
    """Means and covariances after each update, then after each prediction; the filter ends at the last."""
    count = len(zs)
    for name, table in zip(NAMES, tables, strict=True):
        if table is not None and len(table) < count:
            msg = f"{name} has {len(table)} entries for {count} readings; it needs one for each"
            raise ShapeError(msg)
    F, Q, H, R, B, u = ([None] * count if table is None else table for table in tables)
    means, covs = np.empty((count, *filter_.x.shape)), np.empty((count, *filter_.P.shape))
    means_p, covs_p = np.empty_like(means), np.empty_like(covs)
    for k in range(count):
        if update_first:
            filter_.update(zs[k], R=R[k], H=H[k])
            means[k], covs[k] = filter_.x, filter_.P
        filter_.predict(u=u[k], B=B[k], F=F[k], Q=Q[k])
        means_p[k], covs_p[k] = filter_.x, filter_.P
        if not update_first:
            filter_.update(zs[k], R=R[k], H=H[k])
            means[k], covs[k] = filter_.x, filter_.P
        if saver is not None:
            saver.save()
    return means, covs, means_p, covs_p


def smoother_pass(Xs: Any, Ps: Any, Fs: Any, Qs: Any, inv: Any) -> tuple[Array, Array, Array, Array]:
    """Smoothed states and covariances, gains, predicted covariances; entry k of Fs and Qs leads to k."""
    if len(Xs) != len(Ps):
        msg = f"Xs has {len(Xs)} entries and Ps {len(Ps)}; the smoother takes both from one pass"
        raise ShapeError(msg)
    x, P = np.array(Xs, dtype=np.float64), np.array(Ps, dtype=np.float64)
    n = P.shape[1]
    gains, ahead = np.zeros_like(P), P.copy()
    for k in range(len(x) - 2, -1, -1):
        F, Q = Fs[k + 1], Qs[k + 1]
        ahead[k] = F @ P[k] @ F.T + Q
        K = smoother_gain(P[k] @ F.T, ahead[k], inv)
        x[k] += K @ (x[k + 1] - F @ x[k])
        # P - K ahead Kᵀ as a sum of squares: it cannot lose its sign
        left = np.eye(n) - K @ F
        P[k] = left @ P[k] @ left.T + K @ (P[k + 1] + Q) @ K.T
        P[k] = 0.5 * (P[k] + P[k].T)
        gains[k] = K
    return x, P, gains, ahead


def smoother_gain(cross: Array, ahead: Array, inv: Any = np.linalg.inv) -> Array:
    """Cross-covariance (n, n) times the inverse of the predicted covariance, which may be singular."""
    if inv is not np.linalg.inv:
        gain: Array = cross @ inv(ahead)
        return gain
    scale = np.sqrt(np.maximum(np.diagonal(ahead), 0.0))
    scale = np.divide(1.0, scale, out=np.zeros_like(scale), where=scale > 0.0)
    balanced = ahead * np.outer(scale, scale)
    try:
        if (np.diagonal(np.linalg.cholesky(balanced)) > 1e-6).all():
            solved: Array = np.linalg.solve(balanced, (cross * scale).T).T * scale
            return solved
    except np.linalg.LinAlgError:
        pass
    return cross @ pseudo_inverse(ahead)
