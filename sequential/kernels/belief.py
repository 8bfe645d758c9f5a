"""A Kalman update of a mean and a covariance by one reading, in Joseph's form."""

from __future__ import annotations

import math

from numba import types

from sequential.kernels.arrays import b0, f0, f1, f2, i0, w1, w2
from sequential.kernels.call import inlined, inlined_as
from sequential.kernels.matrices import TINY, multiply, multiply_nt, symmetrise
from sequential.kernels.sizes import reading_dim

__all__ = ["LOG_TWO_PI", "add_correction", "admit", "gain_and_innovation", "joseph", "tallied"]

PAIR = types.Tuple([f0, f0])
TRIPLE = types.Tuple([f0, f0, f0])
LOG_TWO_PI = math.log(2.0 * math.pi)
TINIEST, LARGEST = 1e-100, 1e100  # within these a product of pivots is kept, for one logarithm at the end


@inlined_as(PAIR(f0, f0))
def tallied(logarithm, product):
    """(a, b) with a + log b the same, and b within bounds."""
    if TINIEST < product < LARGEST:
        return logarithm, product
    return logarithm + math.log(product), 1.0


@inlined_as(TRIPLE(f2, f2, f2, f0, f1, i0, i0, w2, w2, w2, w2, w1))
def gain_and_innovation(p, h, noise, weight, residual, m, d, innovation_cov, lower, cross, gain, left):
    """S = H P Hᵀ + R/w, K = P Hᵀ S⁻¹, with the NIS, which is negative if S is not positive definite.

    Returns (NIS, a, b) where log det S = a + log b: logarithms are dear, and those of many readings can be
    one.  S = L D Lᵀ without square roots: `lower` holds L below its diagonal and D⁻¹ on it, `gain` Kᵀ (m, d),
    `cross` H P, `left` L⁻¹ residual.
    """
    share = 1.0 / weight
    multiply(h, p, cross, m, d, d)
    multiply_nt(cross, h, innovation_cov, m, d, m)
    for i in range(m):
        for j in range(m):
            innovation_cov[i, j] += noise[i, j] * share
    symmetrise(innovation_cov, m)
    nis, log_det, determinant = 0.0, 0.0, 1.0
    for i in range(m):
        s, pivot = residual[i], innovation_cov[i, i]
        for j in range(i):
            t = innovation_cov[i, j]
            for k in range(j):
                t -= lower[i, k] * lower[j, k]
            lower[i, j] = t  # times D until its row is done
        for j in range(i):
            t = lower[i, j] * lower[j, j]
            pivot -= t * lower[i, j]
            lower[i, j] = t
            s -= t * left[j]
        if not pivot > TINY * innovation_cov[i, i]:
            return -1.0, 0.0, 1.0
        inverse = 1.0 / pivot
        lower[i, i], left[i] = inverse, s
        nis += s * s * inverse
        log_det, determinant = tallied(log_det, determinant * pivot)
        for j in range(d):
            t = cross[i, j]
            for k in range(i):
                t -= lower[i, k] * gain[k, j]
            gain[i, j] = t
    for i in range(m - 1, -1, -1):
        for j in range(d):
            t = gain[i, j] * lower[i, i]
            for k in range(i + 1, m):
                t -= lower[k, i] * gain[k, j]
            gain[i, j] = t
    return nis, log_det, determinant


@inlined_as(b0(f2, f2, f2, f2, f2, f0, i0, i0, w2, w2))
def joseph(p, h, cross, gain, noise, weight, m, d, out, spread):
    """out = (I - K H) P (I - K H)ᵀ + K (R/w) Kᵀ; False: a variance is negative.

    Kᵀ (m, d) stands in `gain`, H P in `cross`.

    Multiplied out as M - (M Hᵀ - K R/w) Kᵀ with M = P - K H P, which holds for any gain and costs no product
    of two (d, d) matrices (Bierman 1977, section V.2).
    """
    share = 1.0 / weight
    for i in range(d):
        for j in range(d):
            s = p[i, j]
            for k in range(m):
                s -= gain[k, i] * cross[k, j]
            out[i, j] = s
        for a in range(m):
            s = 0.0
            for j in range(d):
                s += out[i, j] * h[a, j]
            for k in range(m):
                s -= gain[k, i] * noise[k, a] * share
            spread[i, a] = s
    sound = True
    for i in range(d):
        for j in range(i + 1):
            s = out[i, j]
            for a in range(m):
                s -= spread[i, a] * gain[a, j]
            out[i, j] = s
            out[j, i] = s
        sound = sound and out[i, i] >= 0.0
    return sound


@inlined_as(types.void(f2, f1, i0, i0, w1))
def add_correction(gain, residual, m, d, out):
    """out (d,) += K residual, with Kᵀ (m, d) in `gain`."""
    for i in range(d):
        for k in range(m):
            out[i] += gain[k, i] * residual[k]


@inlined
def admit(model, plan, reading, nis, residual, innovation_cov, out):
    """Write the innovation down and judge it: 1 take it, 0 the gate is shut, -1 S was indefinite."""
    s = plan.sensor[reading]
    m = reading_dim(model, s)
    for i in range(m):
        out.residual[reading, i] = residual[i]
        for j in range(m):
            out.residual_cov[reading, i, j] = innovation_cov[i, j]
    if nis < 0.0:
        return -1
    out.accepted[reading] = 0 if nis > model.gate[s, plan.rows[reading]] else 1
    return out.accepted[reading]
