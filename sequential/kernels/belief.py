"""A Kalman update of a mean and a covariance by one reading, in Joseph's form."""

from __future__ import annotations

import math

from numba import types

from sequential.kernels.arrays import f0, f1, f2, i0, w1, w2
from sequential.kernels.call import bare_as, inlined
from sequential.kernels.matrices import (
    add_product_nt,
    cholesky,
    multiply,
    multiply_nt,
    solve_lower,
    solve_lower_transposed,
    symmetrise,
)

__all__ = ["LOG_TWO_PI", "add_correction", "admit", "gain_and_innovation", "joseph"]

PAIR = types.Tuple([f0, f0])
LOG_TWO_PI = math.log(2.0 * math.pi)


@bare_as(PAIR(f2, f2, f2, f0, f1, i0, i0, w2, w2, w2, w2))
def gain_and_innovation(p, h, noise, weight, residual, m, d, innovation_cov, lower, cross, gain):
    """S = H P Hᵀ + R/w, K = P Hᵀ S⁻¹; returns (NIS, log det S), NIS negative if S is not positive definite.

    `gain` holds Kᵀ (m, d), `lower` the Cholesky factor of S; `cross` (m, d) is scratch: H P, then the
    whitened residual in its first column.
    """
    multiply(h, p, cross, m, d, d)
    multiply_nt(cross, h, innovation_cov, m, d, m)
    for i in range(m):
        for j in range(m):
            innovation_cov[i, j] += noise[i, j] / weight
    symmetrise(innovation_cov, m)
    if cholesky(innovation_cov, lower, m, False) > 0:
        return -1.0, 0.0
    for i in range(m):
        for j in range(d):
            gain[i, j] = cross[i, j]
    solve_lower(lower, gain, m, d)
    solve_lower_transposed(lower, gain, m, d)
    nis, log_det = 0.0, 0.0
    for i in range(m):
        s = residual[i]
        for k in range(i):
            s -= lower[i, k] * cross[k, 0]
        cross[i, 0] = s / lower[i, i]
        nis += cross[i, 0] * cross[i, 0]
        log_det += 2.0 * math.log(lower[i, i])
    return nis, log_det


@bare_as(types.void(w2, f2, f2, f2, f0, i0, i0, w2, w2, w2))
def joseph(p, h, gain, noise, weight, m, d, left, work, scaled):
    """P <- (I - K H) P (I - K H)ᵀ + K (R/w) Kᵀ, with Kᵀ (m, d) in `gain`; symmetric for any gain."""
    for i in range(d):
        for j in range(d):
            s = 1.0 if i == j else 0.0
            for k in range(m):
                s -= gain[k, i] * h[k, j]
            left[i, j] = s
    multiply(left, p, work, d, d, d)
    multiply_nt(work, left, p, d, d, d)
    for i in range(d):
        for j in range(m):
            s = 0.0
            for k in range(m):
                s += gain[k, i] * noise[k, j]
            scaled[i, j] = s / weight
            left[i, j] = gain[j, i]
    add_product_nt(scaled, left, p, d, m, d)
    symmetrise(p, d)


@bare_as(types.void(f2, f1, i0, i0, w1))
def add_correction(gain, residual, m, d, out):
    """out (d,) += K residual, with Kᵀ (m, d) in `gain`."""
    for i in range(d):
        for k in range(m):
            out[i] += gain[k, i] * residual[k]


@inlined
def admit(model, plan, reading, nis, residual, innovation_cov, out):
    """Write the innovation down and judge it: 1 take it, 0 the gate is shut, -1 S was indefinite."""
    s = plan.sensor[reading]
    m = model.z_dim[s]
    for i in range(m):
        out.residual[reading, i] = residual[i]
        for j in range(m):
            out.residual_cov[reading, i, j] = innovation_cov[i, j]
    if nis < 0.0:
        return -1
    out.accepted[reading] = 0 if nis > model.gate[s, plan.rows[reading]] else 1
    return out.accepted[reading]
