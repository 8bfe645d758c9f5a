"""Whole sequences through a linear filter taken over: forward pass and RTS smoother."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ShapeError
from sequential.filterpy.attributes import as_covariance, as_reading
from sequential.filterpy.linear_update import pseudo_inverse
from sequential.filterpy.recursion import columns
from sequential.kernels.scripted import filter_script, smooth_script

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
    means, covs = np.empty((count, *filter_.x.shape)), np.empty((count, *filter_.P.shape))
    out = means, covs, np.empty_like(means), np.empty_like(covs)
    F, Q, H, R, B, u = ([None] * count if table is None else table for table in tables)
    compiled = None
    if saver is None and filter_.inv is np.linalg.inv:
        compiled = _arguments(filter_, zs, tables)
    k = 0
    while k < count:
        # compiled as far as it goes; what is in doubt, and the last step with all its attributes, one by one
        if compiled is not None:
            k = _compiled_steps(filter_, compiled, k, out, update_first=update_first)
        if update_first:
            filter_.update(zs[k], R=R[k], H=H[k])
            means[k], covs[k] = filter_.x, filter_.P
        filter_.predict(u=u[k], B=B[k], F=F[k], Q=Q[k])
        out[2][k], out[3][k] = filter_.x, filter_.P
        if not update_first:
            filter_.update(zs[k], R=R[k], H=H[k])
            means[k], covs[k] = filter_.x, filter_.P
        if saver is not None:
            saver.save()
        k += 1
    return out


def _arguments(filter_: Any, zs: Any, tables: Sequence[Any]) -> tuple[Array, ...] | None:
    """Readings, F, Q, H, R and B u as tables of one entry or one for each step; None where shapes vary."""
    count, n, m = len(zs), filter_.dim_x, filter_.dim_z
    F, Q, H, R, B, u = tables
    try:
        readings = _readings(zs, m)
        matrices = (
            filter_.F[None]
            if F is None
            else np.array([np.reshape(f, (n, n)) for f in F[:count]], np.float64),
            filter_.Q[None] if Q is None else np.array([as_covariance(q, n, "Qs") for q in Q[:count]]),
            filter_.H[None]
            if H is None
            else np.array([np.reshape(h, (m, n)) for h in H[:count]], np.float64),
            filter_.R[None] if R is None else np.array([as_covariance(r, m, "Rs") for r in R[:count]]),
        )
    except (ShapeError, ValueError):
        return None
    pushes = np.zeros((1, n))
    if u is not None:
        Bs = [filter_.B] * count if B is None else B
        pushes = np.zeros((count, n))
        for k in range(count):
            pushes[k] = np.ravel(columns(Bs[k], u[k], filter_.x))
    return readings, *matrices, pushes


def _readings(zs: Any, m: int) -> Array:
    """(N, m) readings, NaN where there is none."""
    try:
        together = np.asarray(zs, dtype=np.float64)
        if together.size == len(zs) * m:
            return np.ascontiguousarray(together.reshape(len(zs), m))
    except (TypeError, ValueError):
        pass
    nothing = np.full(m, np.nan)
    return np.array([nothing if z is None else as_reading(z, m, 1) for z in zs]).reshape(len(zs), m)


def _compiled_steps(
    filter_: Any, arguments: tuple[Array, ...], first: int, out: tuple[Array, ...], *, update_first: bool
) -> int:
    """Take steps from `first` on; the number of the last, or of one in doubt, which is left to take."""
    last = len(arguments[0]) - 1
    x, P = filter_.x.reshape(-1).copy(), filter_.P.copy()
    count, n = len(out[0]), len(x)
    shaped = (out[0].reshape(count, n), out[1], out[2].reshape(count, n), out[3])
    readings, *matrices = arguments
    stopped = filter_script(
        readings[:last],
        *matrices,
        filter_.alpha**2,
        update_first,
        first,
        x,
        P,
        *shaped,
    )
    vars(filter_).update(x=x.reshape(filter_.x.shape), P=P)
    return int(stopped)


def smoother_pass(Xs: Any, Ps: Any, Fs: Any, Qs: Any, inv: Any) -> tuple[Array, Array, Array, Array]:
    """Smoothed states and covariances, gains, predicted covariances; entry k of Fs and Qs leads to k."""
    if len(Xs) != len(Ps):
        msg = f"Xs has {len(Xs)} entries and Ps {len(Ps)}; the smoother takes both from one pass"
        raise ShapeError(msg)
    x, P = np.array(Xs, dtype=np.float64), np.array(Ps, dtype=np.float64)
    gains, ahead = np.zeros_like(P), P.copy()
    flat, k = x.reshape(len(x), -1), len(x) - 2
    while k >= 0:
        if inv is np.linalg.inv:
            k = int(smooth_script(Fs, Qs, k, flat, P, gains, ahead))
        if k >= 0:
            F, Q = Fs[min(k + 1, len(Fs) - 1)], Qs[min(k + 1, len(Qs) - 1)]
            _smooth_one(k, F, Q, flat, P, gains, ahead, inv)
            k -= 1
    return x, P, gains, ahead


def _smooth_one(k: int, F: Array, Q: Array, x: Array, P: Array, gains: Array, ahead: Array, inv: Any) -> None:
    """One step back in place, by the script's inverse, or over a prediction that is singular."""
    ahead[k] = F @ P[k] @ F.T + Q
    K = smoother_gain(P[k] @ F.T, ahead[k], inv)
    x[k] += K @ (x[k + 1] - F @ x[k])
    left = np.eye(len(F)) - K @ F
    P[k] = left @ P[k] @ left.T + K @ (P[k + 1] + Q) @ K.T
    P[k] = 0.5 * (P[k] + P[k].T)
    gains[k] = K


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
