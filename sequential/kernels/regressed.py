"""The update of a belief by a reading that was regressed on it: y ≈ D L⁻¹ (x - mean) + rest."""

from __future__ import annotations

import math

from sequential.kernels.belief import tallied
from sequential.kernels.bierman import update_covariance_ud
from sequential.kernels.call import bare, inlined
from sequential.kernels.correcting import DOUBTFUL
from sequential.kernels.matrices import copy_matrix
from sequential.kernels.sigma_points import slope

__all__ = ["correct", "gain_of", "redo"]


@inlined
def gain_of(moment, given, share, lower, projected, residual, m, d, innovation_cov, factored, gain, white):
    """S = moment + share R and Kᵀ = S⁻¹ D Lᵀ in `gain`; (NIS, a, b), NIS negative if S is in doubt.

    log det S = a + log b.  The diagonal of the factor holds inverses: one division a row.
    """
    nis, log_det, determinant = 0.0, 0.0, 1.0
    for i in range(m):
        for j in range(m):
            innovation_cov[i, j] = moment[i, j] + share * given[i, j]
    for i in range(m):
        s = residual[i]
        for j in range(i):
            t = innovation_cov[i, j]
            for k in range(j):
                t -= factored[i, k] * factored[j, k]
            factored[i, j] = t * factored[j, j]
            s -= factored[i, j] * white[j]
        t = innovation_cov[i, i]
        for k in range(i):
            t -= factored[i, k] * factored[i, k]
        if not t > DOUBTFUL * innovation_cov[i, i]:
            return -1.0, 0.0, 1.0
        log_det, determinant = tallied(log_det, determinant * t)
        inverse = 1.0 / math.sqrt(t)
        factored[i, i] = inverse
        white[i] = s * inverse
        nis += white[i] * white[i]
        for j in range(d):
            t = 0.0
            for k in range(j + 1):
                t += projected[i, k] * lower[j, k]
            for k in range(i):
                t -= factored[i, k] * gain[k, j]
            gain[i, j] = t * inverse
    for i in range(m - 1, -1, -1):
        for j in range(d):
            t = gain[i, j]
            for k in range(i + 1, m):
                t -= factored[k, i] * gain[k, j]
            gain[i, j] = t * factored[i, i]
    return nis, log_det, determinant


@inlined
def correct(p, lower, projected, rest, given, share, gain, residual, m, d, left, scaled, delta):
    """P <- (L - K D)(L - K D)ᵀ + K (Ω + share R) Kᵀ and delta = K residual."""
    for i in range(d):
        total = 0.0
        for k in range(m):
            total += gain[k, i] * residual[k]
        delta[i] = total
        for j in range(d):
            total = lower[i, j]
            for k in range(m):
                total -= gain[k, i] * projected[k, j]
            left[i, j] = total
        for j in range(m):
            total = 0.0
            for k in range(m):
                total += gain[k, i] * (rest[k, j] + share * given[k, j])
            scaled[i, j] = total
        for j in range(i + 1):
            total = 0.0
            for k in range(d):
                total += left[i, k] * left[j, k]
            for k in range(m):
                total += scaled[i, k] * gain[k, j]
            p[i, j] = total
            p[j, i] = total


@bare
def redo(p, lower, projected, rest, given, share, residual, m, d, updated, delta, doubt):
    """(NIS, log det S) of the update in UD form, the covariance in `updated`; NIS -1 if S is not positive."""
    h, u, rows, factored, vectors, square = doubt
    slope(projected, lower, d, m, h)
    for a in range(m):
        for b in range(m):
            square[a, b] = rest[a, b] + share * given[a, b]
    copy_matrix(p, updated)
    for i in range(d):
        delta[i] = 0.0
    return update_covariance_ud(updated, h, square, 1.0, residual, m, d, delta, u, rows, factored, vectors)
