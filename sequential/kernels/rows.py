"""Covariances moved and updated by matrices that are lists of what is not zero in their rows.

A list is (count (r,), column (r, c), value (r, c)).  All are inlined by force, so that sizes which the
compiler knows unroll the loops.
"""

from __future__ import annotations

import math

from sequential.kernels.call import inlined

__all__ = ["factor_innovation", "gather_rows", "project_rows", "update_rows"]


@inlined
def gather_rows(matrix, r, c, rows):
    """List what is not zero in the rows of a matrix (r, c)."""
    count, column, value = rows
    for i in range(r):
        found = 0
        for j in range(c):
            if matrix[i, j] != 0.0:
                column[i, found] = j
                value[i, found] = matrix[i, j]
                found += 1
        count[i] = found


@inlined
def project_rows(rows, p, noise, weight, m, d, projected, innovation_cov):
    """H P (m, d), and S = H P Hᵀ + R/w (m, m), exactly symmetric, which may take the place of P."""
    count, column, value = rows
    share = 1.0 / weight
    for i in range(m):
        for j in range(d):
            projected[i, j] = 0.0
        for k in range(count[i]):
            s, row = value[i, k], column[i, k]
            for j in range(d):
                projected[i, j] += s * p[row, j]
    for i in range(m):
        for j in range(i + 1):
            s = noise[i, j] * share
            for k in range(count[j]):
                s += value[j, k] * projected[i, column[j, k]]
            innovation_cov[i, j] = s
            innovation_cov[j, i] = s


@inlined
def factor_innovation(innovation_cov, residual, m, lower, white):
    """S = L Lᵀ and L⁻¹ residual; returns (NIS, log det S, smallest share of a diagonal left as a pivot)."""
    nis, determinant, log_det, least = 0.0, 1.0, 0.0, 1.0
    for i in range(m):
        s = residual[i]
        for j in range(i):
            t = innovation_cov[i, j]
            for k in range(j):
                t -= lower[i, k] * lower[j, k]
            lower[i, j] = t * lower[j, j]
            s -= lower[i, j] * white[j]
        pivot = innovation_cov[i, i]
        for k in range(i):
            pivot -= lower[i, k] * lower[i, k]
        least = min(least, pivot / innovation_cov[i, i])
        determinant *= pivot
        # the diagonal of `lower` holds inverses: one division a row
        lower[i, i] = 1.0 / math.sqrt(pivot) if pivot > 0.0 else math.nan
        white[i] = s * lower[i, i]
        nis += white[i] * white[i]
        if not 1e-200 < determinant < 1e200:
            log_det += math.log(determinant)
            determinant = 1.0
    return nis, log_det + math.log(determinant), least


@inlined
def update_rows(rows, p, noise, weight, m, d, projected, lower, gain, spread, work, delta, white):
    """delta = K r, P <- P - K H P - (…) Kᵀ in Bierman's arrangement of Joseph's form, from L and L⁻¹ r.

    With M = P - K H P it is M - (M Hᵀ - K R/w) Kᵀ, which is Joseph's form for any gain K at the cost of the
    short one (Bierman 1977, section V.2).  Leaves Kᵀ (m, d) in `gain` and the new covariance in `work`.
    Returns False where a variance came out negative.
    """
    count, column, value = rows
    share = 1.0 / weight
    # first W = L⁻¹ H P in `gain`, with K r = Wᵀ L⁻¹ r
    for j in range(d):
        delta[j] = 0.0
    for i in range(m):
        for j in range(d):
            gain[i, j] = projected[i, j]
        for k in range(i):
            for j in range(d):
                gain[i, j] -= lower[i, k] * gain[k, j]
        for j in range(d):
            gain[i, j] *= lower[i, i]
            delta[j] += gain[i, j] * white[i]
    for i in range(m - 1, -1, -1):
        for k in range(i + 1, m):
            for j in range(d):
                gain[i, j] -= lower[k, i] * gain[k, j]
        for j in range(d):
            gain[i, j] *= lower[i, i]
    for i in range(d):
        for j in range(d):
            work[i, j] = p[i, j]
        for k in range(m):
            s = gain[k, i]
            for j in range(d):
                work[i, j] -= s * projected[k, j]
        for a in range(m):
            s = 0.0
            for k in range(count[a]):
                s += value[a, k] * work[i, column[a, k]]
            for b in range(m):
                s -= gain[b, i] * noise[b, a] * share
            spread[i, a] = s
    sound = True
    for i in range(d):
        for j in range(i + 1):
            s = work[i, j]
            for a in range(m):
                s -= spread[i, a] * gain[a, j]
            work[i, j] = s
            work[j, i] = s
        sound = sound and work[i, i] >= 0.0
    return sound
