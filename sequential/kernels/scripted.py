"""Steps and passes of a linear filter given by its matrices, one set for each step or one for all."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from sequential.kernels.arrays import b0, f0, f1, f2, f3, i0, w1, w2, w3
from sequential.kernels.call import bare_as
from sequential.kernels.matrices import (
    add_product_nt,
    cholesky,
    copy_matrix,
    copy_vector,
    fill_diagonal,
    multiply,
    multiply_nt,
    solve_lower,
    solve_lower_transposed,
    symmetrise,
)

__all__ = ["filter_script", "predict_step", "smooth_script", "update_step"]

DOUBT = 1e-4  # a pivot of S below this share of its diagonal costs Joseph's form digits
SINGULAR = 1e-12  # the same of a predicted covariance, whose gain then is a pseudo-inverse's


@bare_as(types.void(w2))
def clear_negative(p):
    """A variance below zero is what rounding left of larger ones: it is zero, and so are its covariances."""
    n = len(p)
    for i in range(n):
        if p[i, i] < 0.0:
            for j in range(n):
                p[i, j] = 0.0
                p[j, i] = 0.0


@bare_as(types.void(f2, f2, f2, f1, f1, f0, w2, w1, w2))
def carry(f, p, q, x, push, fading, work, x_out, p_out):
    """x_out = F x + push, p_out = α² F P Fᵀ + Q."""
    n = len(x)
    multiply(f, p, work, n, n, n)
    multiply_nt(work, f, p_out, n, n, n)
    for i in range(n):
        total = push[i]
        for j in range(n):
            total += f[i, j] * x[j]
        x_out[i] = total
        for j in range(n):
            p_out[i, j] = fading * p_out[i, j] + q[i, j]
    clear_negative(p_out)


@bare_as(types.void(f2, f2, f2, f2, w2, w2, w2))
def join(left, p, k, r, lp, kr, p_out):
    """p_out = L P Lᵀ + K R Kᵀ; lp (n, n) and kr (n, m) are scratch."""
    n, m = k.shape
    multiply(left, p, lp, n, n, n)
    multiply_nt(lp, left, p_out, n, n, n)
    multiply(k, r, kr, n, m, m)
    add_product_nt(kr, k, p_out, n, m, n)
    symmetrise(p_out, n)
    clear_negative(p_out)


@bare_as(i0(f2, f2, f2, f1, f1, w1, w2, w2, w2, w1, w2, w2, w2, w2, w2))
def correct(p, h, r, x, z, y, s, si, k, x_out, p_out, pht, lower, left, work):
    """Joseph's update by a whole reading; 1 where it is in doubt, or a component is missing."""
    m, n = h.shape
    for i in range(m):
        total = z[i]
        for j in range(n):
            total -= h[i, j] * x[j]
        y[i] = total
        if not (r[i, i] > 0.0 and math.isfinite(total)):
            return 1
    multiply_nt(p, h, pht, n, n, m)
    multiply(h, pht, s, m, n, m)
    for i in range(m):
        for j in range(m):
            s[i, j] += r[i, j]
        if not s[i, i] < np.inf:
            return 1
    if cholesky(s, lower, m, False):
        return 1
    for i in range(m):
        if not lower[i, i] * lower[i, i] > DOUBT * s[i, i]:
            return 1
    fill_diagonal(si, 1.0)
    solve_lower(lower, si, m, m)
    solve_lower_transposed(lower, si, m, m)
    symmetrise(si, m)
    multiply(pht, si, k, n, m, m)
    fill_diagonal(left, 1.0)
    for i in range(n):
        total = x[i]
        for a in range(m):
            total += k[i, a] * y[a]
            for j in range(n):
                left[i, j] -= k[i, a] * h[a, j]
        x_out[i] = total
    join(left, p, k, r, work, pht, p_out)
    return 0


@njit(types.void(f2, f2, f2, f1, f1, f0, w1, w2), cache=True, error_model="numpy")
def predict_step(f, p, q, x, push, fading, x_out, p_out):
    """One step ahead: see `carry`."""
    carry(f, p, q, x, push, fading, np.empty_like(p), x_out, p_out)


@njit(i0(f2, f2, f2, f1, f1, w1, w2, w2, w2, w1, w2), cache=True, error_model="numpy")
def update_step(p, h, r, x, z, y, s, si, k, x_out, p_out):
    """One reading: see `correct`."""
    m, n = h.shape
    pht, lower, left, work = np.empty((n, m)), np.empty((m, m)), np.empty((n, n)), np.empty((n, n))
    return correct(p, h, r, x, z, y, s, si, k, x_out, p_out, pht, lower, left, work)


@njit(i0(f2, f3, f3, f3, f3, f2, f0, b0, i0, w1, w2, w2, w3, w2, w3), cache=True, error_model="numpy")
def filter_script(
    zs, fs, qs, hs, rs, pushes, fading, update_first, first, x, p, means, covs, means_p, covs_p
):
    """Steps from `first` on, with the belief x, p in place; returns the step that it could not take, or N.

    A table of one entry serves every step.  A reading of NaN throughout is none.
    """
    count, m, n = len(zs), zs.shape[1], len(x)
    pht, lower, left, work = np.empty((n, m)), np.empty((m, m)), np.empty((n, n)), np.empty((n, n))
    y, s, si, k = np.empty(m), np.empty((m, m)), np.empty((m, m)), np.empty((n, m))
    x_in, p_in = np.empty(n), np.empty((n, n))
    for step in range(first, count):
        f, q = fs[step if len(fs) > 1 else 0], qs[step if len(qs) > 1 else 0]
        h, r = hs[step if len(hs) > 1 else 0], rs[step if len(rs) > 1 else 0]
        push = pushes[step if len(pushes) > 1 else 0]
        missing = 0
        for i in range(m):
            missing += 1 if math.isnan(zs[step, i]) else 0
        copy_vector(x, x_in)
        copy_matrix(p, p_in)
        if not update_first:
            carry(f, p, q, x, push, fading, work, means_p[step], covs_p[step])
            copy_vector(means_p[step], x_in)
            copy_matrix(covs_p[step], p_in)
        if missing == m:
            copy_vector(x_in, means[step])
            copy_matrix(p_in, covs[step])
        elif correct(
            p_in, h, r, x_in, zs[step], y, s, si, k, means[step], covs[step], pht, lower, left, work
        ):
            return step
        copy_vector(means[step], x)
        copy_matrix(covs[step], p)
        if update_first:
            carry(f, covs[step], q, means[step], push, fading, work, means_p[step], covs_p[step])
            copy_vector(means_p[step], x)
            copy_matrix(covs_p[step], p)
    return count


@njit(i0(f3, f3, i0, w2, w3, w3, w3), cache=True, error_model="numpy")
def smooth_script(fs, qs, first, x, p, gains, ahead):
    """RTS from node `first` down, in place; returns the node whose prediction is singular, or -1.

    P - K P_ahead Kᵀ is taken as (I - K F) P (I - K F)ᵀ + K Q Kᵀ, which cannot lose its sign.
    """
    n = x.shape[1]
    lower, work, left, gain_t = np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    noise, out = np.empty((n, n)), np.empty((n, n))
    for k in range(first, -1, -1):
        f, q = fs[k + 1 if len(fs) > 1 else 0], qs[k + 1 if len(qs) > 1 else 0]
        multiply(f, p[k], gain_t, n, n, n)
        multiply_nt(gain_t, f, ahead[k], n, n, n)
        for i in range(n):
            for j in range(n):
                ahead[k, i, j] += q[i, j]
        if cholesky(ahead[k], lower, n, False):
            return k
        for i in range(n):
            if not lower[i, i] * lower[i, i] > SINGULAR * ahead[k, i, i]:
                return k
        solve_lower(lower, gain_t, n, n)
        solve_lower_transposed(lower, gain_t, n, n)
        for i in range(n):
            for j in range(n):
                gains[k, i, j] = gain_t[j, i]
                noise[i, j] = p[k + 1, i, j] + q[i, j]
        fill_diagonal(left, 1.0)
        for i in range(n):
            work[0, i] = x[k + 1, i]
            for j in range(n):
                work[0, i] -= f[i, j] * x[k, j]
        for i in range(n):
            for a in range(n):
                x[k, i] += gains[k, i, a] * work[0, a]
                for j in range(n):
                    left[i, j] -= gains[k, i, a] * f[a, j]
        join(left, p[k], gains[k], noise, lower, work, out)
        copy_matrix(out, p[k])
    return -1
