"""The backward pass of Rauch, Tung and Striebel, on any product manifold."""

from __future__ import annotations

import numpy as np
from numba import njit, types

from sequential.kernels.arrays import f2, f3, i2
from sequential.kernels.charts import local, retract
from sequential.kernels.matrices import (
    cholesky,
    multiply,
    multiply_nt,
    solve_lower,
    solve_lower_transposed,
    symmetrise,
)

__all__ = ["smooth_history"]

_f2, _f3 = types.float64[:, ::1], types.float64[:, :, ::1]


@njit(types.int64(i2, f2, f3, f2, f3, f3, types.int64, _f2, _f3), cache=True, error_model="numpy")
def smooth_history(table, mean, cov, predicted_mean, predicted_cov, transition, with_cov, out_mean, out_cov):
    """Smooth a filtered history (Särkkä and Svensson 2023, alg. 13.3); returns the number of lost pivots.

    The gain G = P Φᵀ P⁻¹ uses a Cholesky factor of the predicted covariance; where that is singular in a
    direction (a static part known perfectly), the direction is left out, which is its pseudo-inverse.
    """
    nodes, d = cov.shape[0], cov.shape[1]
    blocks = len(table)
    gain, lower, work, change = np.empty((d, d)), np.empty((d, d)), np.empty((d, d)), np.empty((d, d))
    step, delta = np.empty(d), np.empty(d)
    size, lost = out_mean.shape[1], 0
    means, smoothed = mean.reshape(-1), out_mean.reshape(-1)
    out_mean[nodes - 1] = mean[nodes - 1]
    out_cov[nodes - 1] = cov[nodes - 1]
    for node in range(nodes - 2, -1, -1):
        ahead = node + 1
        # gain holds Gᵀ = P⁻¹ Φ P.
        multiply(transition[ahead], cov[node], gain, d, d, d)
        lost += cholesky(predicted_cov[ahead], lower, d, True)
        solve_lower(lower, gain, d, d)
        solve_lower_transposed(lower, gain, d, d)
        local(table, 0, blocks, predicted_mean[ahead], 0, smoothed, ahead * size, step, 0)
        for i in range(d):
            delta[i] = 0.0
            for k in range(d):
                delta[i] += gain[k, i] * step[k]
        retract(table, 0, blocks, means, node * size, delta, 0, smoothed, node * size)
        if with_cov != 0:
            for i in range(d):
                for j in range(d):
                    change[i, j] = out_cov[ahead, i, j] - predicted_cov[ahead, i, j]
                    work[i, j] = gain[j, i]
            multiply(work, change, lower, d, d, d)
            multiply_nt(lower, work, change, d, d, d)
            for i in range(d):
                for j in range(d):
                    out_cov[node, i, j] = cov[node, i, j] + change[i, j]
            symmetrise(out_cov[node], d)
    return lost
