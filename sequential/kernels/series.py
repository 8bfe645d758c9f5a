"""The linear Kalman filter over many series that share a model and its stamps.

Series by series; or, where all miss the same components, by the gains of one: the covariances are the same.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from sequential.kernels.arrays import f1, f2, f3, i0, i1, i2, w1, w3
from sequential.kernels.call import inlined
from sequential.kernels.linear_steps import absorb, linear_scratch, move
from sequential.kernels.matrices import copy_matrix, copy_vector
from sequential.kernels.records import MODEL, SCHEDULE, Filtered
from sequential.kernels.sizes import ANY_SIZE, known
from sequential.timeline import Schedule

__all__ = ["filter_by_gains", "filter_each"]

_w4 = types.float64[:, :, :, ::1]
_i2 = types.int64[:, ::1]


@inlined
def of_series(plan, z, noise_row, rows, s):
    """The schedule with the readings of series s."""
    return Schedule(
        plan.step_ptr, plan.step_dt, plan.step_input, plan.inputs, plan.reading_ptr, plan.sensor, z[s],
        plan.context, plan.z_flat, plan.noise_cov, noise_row[s], rows[s],
    )  # fmt: skip


@inlined
def filter_one(model, plan, d, m, constant, scratch, mean, cov, out):
    """One series; returns its log likelihood, NaN where an innovation covariance was not positive."""
    (x, p), steps, sights, (update, doubt), (fresh, last) = scratch
    log_likelihood = 0.0
    for node in range(len(plan.reading_ptr) - 1):
        move(model, plan, node, x, p, p, d, 0, last, steps, update[9], 0)
        for reading in range(plan.reading_ptr[node], plan.reading_ptr[node + 1]):
            if plan.rows[reading] > 0:
                size = known(m, model.z_dim[plan.sensor[reading]])
                log_likelihood += absorb(
                    model, plan, reading, x, p, d, size, sights, constant, fresh, update, doubt, out
                )
        for i in range(d):
            mean[node, i] = x[i]
            for j in range(d):
                cov[node, i, j] = p[i, j]
    return log_likelihood


@inlined
def filter_some(model, plan, prior, d, m, constant, scratch, z, noise_row, rows, mean, cov, out, found, span):
    """Series first:last, each from the prior."""
    for s in range(span[0], span[1]):
        copy_vector(prior[0], scratch[0][0])
        copy_matrix(prior[1], scratch[0][1])
        own = Filtered(mean[s], cov[s], mean[s], cov[s], cov[s], out[0][s], out[1][s], out[2][s])
        found[s] = filter_one(
            model, of_series(plan, z, noise_row, rows, s), d, m, constant, scratch, mean[s], cov[s], own
        )


@njit(
    types.void(
        MODEL, SCHEDULE, f1, f2, i1, f3, i2, i2, w3, _w4, w3, _w4, _i2, w1, i0, i0, ANY_SIZE, ANY_SIZE
    ),
    cache=True, error_model="numpy", nogil=True,
)  # fmt: skip
def filter_each(
    model, plan, prior_mean, prior_cov, constant, z, noise_row, rows, mean, cov, residual, residual_cov,
    accepted, found, first, last, state, reading,
):  # fmt: skip
    """Filter series first:last of z (N, M, m) into mean (N, K, n), cov (N, K, d, d) and found (N,)."""
    d = known(state, model.d)
    scratch = linear_scratch(d, plan.z.shape[1], len(model.z_dim))
    prior, out = (prior_mean, prior_cov), (residual, residual_cov, accepted)
    filter_some(
        model, plan, prior, d, reading, constant, scratch, z, noise_row, rows, mean, cov, out, found,
        (first, last),
    )  # fmt: skip


@inlined
def follow(
    start, transition, offset, reading_of, matrix, shift, gain, whitener, log_det, z, mean, residual, work
):
    """One series by given gains; returns its log likelihood."""
    x, moved, d, m = work
    log_likelihood = 0.0
    for i in range(d):
        x[i] = start[i]
    for node in range(len(reading_of)):
        for i in range(d):
            s = offset[node, i]
            for k in range(d):
                s += transition[node, i, k] * x[k]
            moved[i] = s
        reading = reading_of[node]
        if reading >= 0:
            for a in range(m):
                s = z[reading, a] - shift[a]
                for k in range(d):
                    s -= matrix[a, k] * moved[k]
                residual[reading, a] = 0.0 if math.isnan(z[reading, a]) else s
            for a in range(m):
                s = 0.0
                for b in range(a + 1):
                    s += whitener[reading, a, b] * residual[reading, b]
                log_likelihood -= 0.5 * s * s
                for i in range(d):
                    moved[i] += gain[reading, a, i] * residual[reading, a]
            log_likelihood -= 0.5 * log_det[reading]
        for i in range(d):
            x[i] = moved[i]
            mean[node, i] = moved[i]
    return log_likelihood


@njit(
    types.void(f1, f3, f2, i1, f2, f1, f3, f3, f1, f3, w3, w3, w1, i0, i0, ANY_SIZE, ANY_SIZE),
    cache=True, error_model="numpy", nogil=True,
)  # fmt: skip
def filter_by_gains(
    start, transition, offset, reading_of, matrix, shift, gain, whitener, log_det, z, mean, residual, found,
    first, last, state, reading,
):  # fmt: skip
    """Means (N, K, n) of series first:last of z (N, M, m), by the gains (M, m, d) and moves that all share.

    `reading_of` (K,) is the reading at a node or -1, `whitener` (M, m, m) L⁻¹ of S = L Lᵀ, and `log_det` (M,)
    that of 2π S over the components that are there.
    """
    d, m = known(state, transition.shape[1]), known(reading, z.shape[2])
    work = np.empty(d), np.empty(d), d, m
    for s in range(first, last):
        found[s] = follow(
            start, transition, offset, reading_of, matrix, shift, gain, whitener, log_det, z[s], mean[s],
            residual[s], work,
        )  # fmt: skip
