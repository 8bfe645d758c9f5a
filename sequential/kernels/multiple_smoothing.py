"""Backwards through a history of interacting models.

For every pair of a model i at one node and a model j at the next, the belief of i is moved by j and smoothed
by what j has become (Rauch, Tung, Striebel); the pairs of each i are then merged (Kim 1994, Dynamic linear
models with Markov-switching).  Of the chance that j came from i, the predictions also tell: it is weighed by
how well i, moved by j, foresaw the smoothed mean (Barber 2006, Expectation correction for smoothed inference
in switching linear dynamical systems).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from sequential.kernels.arrays import f2, f3, i2, w1, w2, w3
from sequential.kernels.call import bare, bare_as, inlined
from sequential.kernels.charts import local, retract
from sequential.kernels.matrices import (
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
from sequential.kernels.mixing import mix, normalise
from sequential.kernels.modes import MODES, STACKED, mode_of, plan_of
from sequential.kernels.moving import predict
from sequential.kernels.records import MODEL, SCHEDULE

__all__ = ["smooth_modes"]

w4 = types.float64[:, :, :, ::1]


@bare_as(types.void(i2, f2, w2, f2, w2, w2, f2, f2, w1, w2, w1, f2, w2))
def step_back(table, transition, gain, lower, work, change, mean, cov, step, out_mean, delta, ahead, out_cov):
    """The step of Rauch, Tung and Striebel to (1, n) `out_mean` from what stands in `step` and `ahead`.

    `step` leads from the prediction to the smoothed state, `ahead` is the smoothed minus the predicted
    covariance and `lower` the factor of the latter.
    """
    d = cov.shape[0]
    multiply(transition, cov, gain, d, d, d)
    solve_lower(lower, gain, d, d)
    solve_lower_transposed(lower, gain, d, d)
    for i in range(d):
        delta[i] = 0.0
        for k in range(d):
            delta[i] += gain[k, i] * step[k]
            work[i, k] = gain[k, i]
    retract(table, 0, len(table), mean.reshape(-1), 0, delta, 0, out_mean.reshape(-1), 0)
    multiply(work, ahead, change, d, d, d)
    multiply_nt(change, work, out_cov, d, d, d)
    for i in range(d):
        for k in range(d):
            out_cov[i, k] += cov[i, k]
    symmetrise(out_cov, d)


@inlined
def log_density(lower, tangent, d):
    """log N(e; 0, L Lᵀ) but for its constant; directions without variance are left out."""
    total = 0.0
    for i in range(d):
        if not lower[i, i] > 0.0:
            tangent[i] = 0.0
            continue
        s = tangent[i]
        for k in range(i):
            s -= lower[i, k] * tangent[k]
        tangent[i] = s / lower[i, i]
        total -= 0.5 * tangent[i] * tangent[i] + math.log(lower[i, i])
    return total


@bare
def look_ahead(base, modes, plan, node, j, transition, means, covs, mu, ahead, pairs, joint, memory, scratch):
    """Smooth the belief of every model at a node by model j ahead of it; column j of `joint` (J, J)."""
    belief, lower, phi, change, gain, work, back = memory
    share, scores, step, delta, tangent, moving = scratch
    n, d, count = base.n, base.d, len(mu)
    pair_means, pair_covs = pairs
    smoothed, smoothed_cov, chance = ahead
    model, own = mode_of(base, modes, j, modes.open), plan_of(plan, modes, j)
    x, p = belief[:n], belief[n:].reshape((d, d))
    for i in range(count):
        share[i] = transition[i, j] * mu[i]
        joint[i, j] = 0.0
    if not normalise(share) > 0.0:
        return
    best = -math.inf
    for i in range(count):
        if not share[i] > 0.0:
            continue
        copy_vector(means[i], x)
        copy_matrix(covs[i], p)
        fill_diagonal(phi, 1.0)
        predict(model, own, node + 1, belief, x, p, phi, 1, moving)
        cholesky(p, lower, d, True)
        local(base.table, 0, len(base.table), x, 0, smoothed[j], 0, step, 0)
        copy_vector(step, tangent)
        scores[i] = math.log(share[i]) + log_density(lower, tangent, d)
        best = max(best, scores[i])
        for a in range(d):
            for b in range(d):
                change[a, b] = smoothed_cov[j, a, b] - p[a, b]
        step_back(
            base.table, phi, gain, lower, work, back, means[i : i + 1], covs[i], step,
            pair_means[i, j : j + 1], delta, change, pair_covs[i, j],
        )  # fmt: skip
    for i in range(count):
        scores[i] = math.exp(scores[i] - best) if share[i] > 0.0 else 0.0
    normalise(scores)
    for i in range(count):
        joint[i, j] = chance[j] * scores[i]


@bare
def smooth_nodes(
    base, modes, plan, transitions, mean, cov, probability, out, state, memory, scratch, moments
):
    """The loop of `smooth_modes`, with every array at hand."""
    out_means, out_covs, out_probability, out_mean, out_cov = out
    means, covs, smoothed, smoothed_cov, chance, pair_means, pair_covs, joint, share = state
    nodes, count = probability.shape
    for node in range(nodes - 1, -1, -1):
        for i in range(count):
            copy_vector(mean[i, node], means[i])
            copy_matrix(cov[i, node], covs[i])
        if node == nodes - 1:
            copy_vector(probability[node], chance)
            copy_matrix(means, smoothed)
            for i in range(count):
                copy_matrix(covs[i], smoothed_cov[i])
        else:
            for j in range(count):
                look_ahead(
                    base, modes, plan, node, j, transitions[node + 1], means, covs, probability[node],
                    (smoothed, smoothed_cov, chance), (pair_means, pair_covs), joint, memory, scratch,
                )  # fmt: skip
            for i in range(count):
                for j in range(count):
                    share[j] = joint[i, j]
                chance[i] = normalise(share)
                if chance[i] > 0.0:
                    mix(
                        base.table, share, pair_means[i], pair_covs[i], smoothed[i], smoothed_cov[i], *moments
                    )
                else:
                    copy_vector(means[i], smoothed[i])
                    copy_matrix(covs[i], smoothed_cov[i])
            normalise(chance)
        for i in range(count):
            copy_vector(smoothed[i], out_means[i, node])
            copy_matrix(smoothed_cov[i], out_covs[i, node])
        copy_vector(chance, out_probability[node])
        mix(base.table, chance, smoothed, smoothed_cov, out_mean[node], out_cov[node], *moments)


@njit(
    types.void(MODEL, MODES, SCHEDULE, f3, f3, STACKED, f2, types.Tuple([w3, w4, w2, w2, w3])),
    cache=True, error_model="numpy",
)  # fmt: skip
def smooth_modes(base, modes, plan, transitions, mean, cov, probability, out):
    """Smooth the models' histories (J, K, n), (J, K, d, d), (K, J); `out` takes the same and the combined."""
    count, n, d = mean.shape[0], base.n, base.d
    state = (
        np.empty((count, n)), np.empty((count, d, d)), np.empty((count, n)), np.empty((count, d, d)),
        np.empty(count), np.empty((count, count, n)), np.empty((count, count, d, d)),
        np.empty((count, count)), np.empty(count),
    )  # fmt: skip
    memory = (
        np.empty(n + d * d), np.empty((d, d)), np.empty((d, d)), np.empty((d, d)), np.empty((d, d)),
        np.empty((d, d)), np.empty((d, d)),
    )  # fmt: skip
    moving = (np.empty((d, d)), np.empty((d, d)), np.empty(n), np.empty((d, d)))
    scratch = (np.empty(count), np.empty(count), np.empty(d), np.empty(d), np.empty(d), moving)
    moments = (
        np.empty(d), np.empty(d), np.empty((d, d)), np.empty((d, d)), np.empty((d, d)), np.empty((d, d)),
    )  # fmt: skip
    smooth_nodes(base, modes, plan, transitions, mean, cov, probability, out, state, memory, scratch, moments)
