"""The interacting multiple model filter over a whole log (Blom and Bar-Shalom 1988).

Every model keeps a belief of its own.  At each node the beliefs are mixed by the probabilities of having
switched, moved and updated each by its model, and the models are judged by how well they foresaw the
readings.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from sequential.kernels.arrays import f1, f2, f3, i0, w2, w3
from sequential.kernels.belief import gain_and_innovation
from sequential.kernels.call import bare, inlined
from sequential.kernels.charts import wrap
from sequential.kernels.correcting import correction_scratch
from sequential.kernels.extended import absorb
from sequential.kernels.matrices import copy_matrix, copy_vector
from sequential.kernels.mixing import largest, mix, normalise
from sequential.kernels.modes import MODE_OUT, MODES, filtered_of, mode_of, plan_of
from sequential.kernels.moving import predict
from sequential.kernels.records import FINISHED, MODEL, SCHEDULE
from sequential.kernels.sensing import measure, sensor_jacobian

__all__ = ["filter_modes"]

SO2 = 1


@inlined
def inside(base, modes, plan, reading, beliefs, update, expected, residual):
    """Whether a reading lies inside the gate of any model; without gates every reading does."""
    s, rows, n, d = plan.sensor[reading], plan.rows[reading], base.n, base.d
    m = base.z_dim[s]
    h, flat, cross, gain, innovation_cov, lower = (
        update[0],
        update[1],
        update[2],
        update[3],
        update[4],
        update[5],
    )
    for j in range(len(beliefs)):
        threshold = modes.gate[j, s, rows]
        if threshold == math.inf:
            return True
    for j in range(len(beliefs)):
        model, own = mode_of(base, modes, j, modes.open), plan_of(plan, modes, j)
        belief = beliefs[j]
        x, p = belief[:n], belief[n:].reshape((d, d))
        measure(model, own, reading, x, 0, expected, residual)
        sensor_jacobian(model, own, reading, x, 0, expected, flat, h)
        noise = own.noise_cov[own.noise_row[reading]]
        nis, _, _ = gain_and_innovation(
            p, h, noise, 1.0, residual, m, d, innovation_cov, lower, cross, gain, update[8]
        )
        if not nis > modes.gate[j, s, rows]:
            return True
    return False


@inlined
def combine_innovation(base, plan, reading, weights, out, residual, residual_cov):
    """Mean and covariance of the models' innovations, weighed by their probabilities before the reading."""
    s = plan.sensor[reading]
    m, best = base.z_dim[s], largest(weights)
    for b in range(base.z_first[s], base.z_first[s + 1]):
        for k in range(base.z_table[b, 2], base.z_table[b, 2] + base.z_table[b, 4]):
            total = 0.0
            for j in range(len(weights)):
                apart = out[2][j, reading, k] - out[2][best, reading, k]
                total += weights[j] * (wrap(apart) if base.z_table[b, 0] == SO2 else apart)
            residual[reading, k] = out[2][best, reading, k] + total
    for a in range(m):
        for b in range(m):
            total = 0.0
            for j in range(len(weights)):
                left = out[2][j, reading, a] - residual[reading, a]
                right = out[2][j, reading, b] - residual[reading, b]
                total += weights[j] * (out[3][j, reading, a, b] + left * right)
            residual_cov[reading, a, b] = total


@inlined
def judge(base, modes, plan, reading, beliefs, mu, gained, iterations, scratch, out, residual, residual_cov):
    """Update all beliefs and the probabilities by one reading; its log likelihood, NaN if S is indefinite."""
    update, work, expected, own_residual = scratch
    n, d = base.n, base.d
    taken = inside(base, modes, plan, reading, beliefs, update, expected, own_residual)
    for j in range(len(beliefs)):
        model = mode_of(base, modes, j, modes.open if taken else modes.shut)
        belief = beliefs[j]
        x, p = belief[:n], belief[n:].reshape((d, d))
        gained[j], share = absorb(
            model, plan_of(plan, modes, j), reading, x, p, iterations, update, work, expected, own_residual,
            filtered_of(out, j),
        )  # fmt: skip
        if math.isnan(gained[j]):
            return math.nan
        gained[j] -= 0.5 * math.log(share)
    combine_innovation(base, plan, reading, mu, out, residual, residual_cov)
    if not taken:
        return 0.0
    best = -math.inf
    for j in range(len(mu)):
        if mu[j] > 0.0:
            best = max(best, gained[j])
    for j in range(len(mu)):
        mu[j] = mu[j] * math.exp(gained[j] - best) if mu[j] > 0.0 else 0.0
    return best + math.log(normalise(mu))


@bare
def interact(table, n, d, transition, means, covs, beliefs, mu, ahead, share, moments):
    """Mix the beliefs: model j begins where the switches into it came from; mu becomes the chance of each."""
    for j in range(len(mu)):
        for i in range(len(mu)):
            share[i] = transition[i, j] * mu[i]
        ahead[j] = normalise(share)
        if not ahead[j] > 0.0:  # a model that cannot be reached keeps its own belief
            for i in range(len(mu)):
                share[i] = 1.0 if i == j else 0.0
        belief = beliefs[j]
        mix(table, share, means, covs, belief[:n], belief[n:].reshape((d, d)), *moments)
    copy_vector(ahead, mu)


@bare
def filter_nodes(
    base, modes, plan, transitions, iterations, state, scratch, moments, out, probability, mean, cov,
    residual, residual_cov,
):  # fmt: skip
    """The loop of `filter_modes`, with every array at hand."""
    means, covs, beliefs, mu, ahead, share, gained, phi = state
    n, d, total = base.n, base.d, 0.0
    for node in range(len(plan.reading_ptr) - 1):
        interact(base.table, n, d, transitions[node], means, covs, beliefs, mu, ahead, share, moments)
        for j in range(len(mu)):
            model, belief = mode_of(base, modes, j, modes.open), beliefs[j]
            predict(model, plan, node, belief, belief[:n], belief[n:].reshape((d, d)), phi, 0, scratch[1])
        failed = -1
        for reading in range(plan.reading_ptr[node], plan.reading_ptr[node + 1]):
            gain_log = judge(
                base, modes, plan, reading, beliefs, mu, gained, iterations, scratch, out, residual,
                residual_cov,
            )  # fmt: skip
            if math.isnan(gain_log):
                failed = reading
                break
            total += gain_log
        for j in range(len(mu)):
            belief = beliefs[j]
            copy_vector(belief[:n], means[j])
            copy_matrix(belief[n:].reshape((d, d)), covs[j])
            copy_vector(means[j], out[0][j, node])
            copy_matrix(covs[j], out[1][j, node])
        copy_vector(mu, probability[node])
        mix(base.table, mu, means, covs, mean[node], cov[node], *moments)
        if failed >= 0:
            return total, failed
    return total, -1


@njit(
    FINISHED(MODEL, MODES, SCHEDULE, f2, f3, f1, f3, i0, MODE_OUT, w2, w2, w3, w2, w3),
    cache=True, error_model="numpy",
)  # fmt: skip
def filter_modes(
    base, modes, plan, prior_means, prior_covs, chances, transitions, iterations, out, probability, mean, cov,
    residual, residual_cov,
):  # fmt: skip
    """Run the filter; returns (log likelihood, -1 or the reading at which some S was not positive definite).

    `transitions` (K, J, J) are the chances of switching on the way to each node; `out` takes the histories
    of the models, the other arrays the combined one: probability (K, J), mean, cov, residual, residual_cov.
    """
    n, d, count, widest = base.n, base.d, len(chances), plan.z.shape[1]
    state = (
        prior_means.copy(), prior_covs.copy(), np.empty((count, n + d * d)), chances.copy(),
        np.empty(count), np.empty(count), np.empty(count), np.eye(d),
    )  # fmt: skip
    moments = (
        np.empty(d), np.empty(d), np.empty((d, d)), np.empty((d, d)), np.empty((d, d)), np.empty((d, d)),
    )  # fmt: skip
    work = (np.empty((d, d)), np.empty((d, d)), np.empty(n), np.empty((d, d)))
    update = correction_scratch(n, d, widest)
    scratch = (update, work, np.empty(widest), np.empty(widest))
    return filter_nodes(
        base, modes, plan, transitions, iterations, state, scratch, moments, out, probability, mean, cov,
        residual, residual_cov,
    )  # fmt: skip
