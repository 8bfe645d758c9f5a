"""The bootstrap particle filter over a whole log, on any product manifold (Gordon, Salmond, Smith 1993).

Random numbers come from outside, a span of the log at a time, so that memory stays bounded: normals for
every step and particle, uniforms for every node.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit, types

from sequential.kernels.arrays import f0, f2, f3, i0, i2, w1, w2, w3
from sequential.kernels.belief import LOG_TWO_PI
from sequential.kernels.call import bare, bare_as, call
from sequential.kernels.charts import local, retract
from sequential.kernels.matrices import cholesky, copy_matrix, copy_vector, fill_diagonal
from sequential.kernels.mixing import moments_of, normalise
from sequential.kernels.records import MODEL, SCHEDULE
from sequential.kernels.resampling import resample

__all__ = ["CLOUD", "Cloud", "follow"]

HUBER = 1


class Cloud(NamedTuple):
    """What the filter carries and writes; `kept` and its weights have length one unless wanted."""

    states: Any  # (P, n)
    weights: Any  # (P,)
    mean: Any  # (K, n)
    cov: Any  # (K, d, d)
    effective: Any  # (K,) effective sample size, before resampling
    kept: Any  # (K, P, n)
    kept_weights: Any  # (K, P)
    residual: Any  # (M, m)
    residual_cov: Any  # (M, m, m)
    accepted: Any  # (M,)


CLOUD = types.NamedTuple([w2, w1, w2, w3, w1, w3, w2, w2, w3, types.int64[::1]], Cloud)


@bare_as(f0(i0, f0, f0))
def heavy_tail(kind, k, squared):
    """-log of the density that a loss stands for, at a whitened squared norm: half of it without a loss."""
    if kind == 0:
        return 0.5 * squared
    if kind == HUBER:
        r = math.sqrt(squared)
        return 0.5 * squared if r <= k else k * (r - 0.5 * k)
    return 0.5 * k * k * math.log1p(squared / (k * k))


@bare
def move(model, plan, s, states, normals, scratch):
    """Take every particle along one step and add noise drawn in the tangent."""
    after, noise, last, lower, xi = scratch
    n, d, blocks = model.n, model.d, len(model.table)
    u, dt, flat = plan.step_input[s] * plan.inputs.shape[1], plan.step_dt[s], states.reshape(-1)
    fresh = True
    for i in range(len(states)):
        fill_diagonal(noise, 0.0)
        call(model.noise, flat, i * n, plan.inputs, u, dt, model.params, 0, noise, 0)
        for a in range(d):
            for b in range(d):
                fresh = fresh or noise[a, b] != last[a, b]
        if fresh:  # the noise of many processes is the same for all particles
            copy_matrix(noise, last)
            cholesky(noise, lower, d, True)
            fresh = False
        call(model.step, flat, i * n, plan.inputs, u, dt, model.params, 0, after, 0)
        for a in range(d):
            total = 0.0
            for b in range(a + 1):
                total += lower[a, b] * normals[i, b]
            xi[a] = total
        retract(model.table, 0, blocks, after, 0, xi, 0, flat, i * n)


@bare
def foresee(model, plan, reading, cloud, scores, seen):
    """What every particle expects of a reading; its innovation is written down and judged.

    `scores` becomes the squared whitened residual of each particle.  Returns log det R, NaN where R or S
    is not positive definite.
    """
    images, expected, residual, lower, e, shift = seen
    s, n = plan.sensor[reading], model.n
    m, first, last = model.z_dim[s], model.z_first[s], model.z_first[s + 1]
    wide, z_at, flat = images.shape[1], reading * plan.z.shape[1], cloud.states.reshape(-1)
    noise, cov = plan.noise_cov[plan.noise_row[reading]], cloud.residual_cov[reading]
    after = images.reshape(-1)
    if cholesky(noise, lower, m, False) > 0:
        return math.nan
    log_det = 0.0
    for a in range(m):
        log_det += 2.0 * math.log(lower[a, a])
    for i in range(len(scores)):
        call(
            model.observe[s], flat, i * n, plan.context, reading * plan.context.shape[1], 0.0,
            model.sensor_params, model.sensor_params_at[s], after, i * wide,
        )  # fmt: skip
        local(model.z_table, first, last, after, i * wide, plan.z_flat, z_at, residual, 0)
        scores[i] = whiten(plan.z[reading], lower, residual, m)
    moments_of(model.z_table, first, last, model.z_size[s], m, images, cloud.weights, expected, cov, e, shift)
    local(model.z_table, first, last, expected, 0, plan.z_flat, z_at, residual, 0)
    for a in range(m):
        missing = math.isnan(plan.z[reading, a])
        cloud.residual[reading, a] = 0.0 if missing else residual[a]
        for b in range(m):
            if missing or math.isnan(plan.z[reading, b]):
                cov[a, b] = 0.0
            cov[a, b] += noise[a, b]
    if cholesky(cov, lower, m, False) > 0:
        return math.nan
    nis = whiten(plan.z[reading], lower, residual, m)
    cloud.accepted[reading] = 0 if nis > model.gate[s, plan.rows[reading]] else 1
    return log_det


@bare
def whiten(z, lower, residual, m):
    """Squared norm of L⁻¹ r, over the components that are not missing; r is overwritten."""
    squared = 0.0
    for a in range(m):
        total = 0.0 if math.isnan(z[a]) else residual[a]
        for b in range(a):
            total -= lower[a, b] * residual[b]
        residual[a] = total / lower[a, a]
        squared += residual[a] * residual[a]
    return squared


@bare
def weigh(model, plan, reading, cloud, scores, seen):
    """Multiply the weights by the likelihood of a reading; its log likelihood, NaN where there is none."""
    log_det = foresee(model, plan, reading, cloud, scores, seen)
    if math.isnan(log_det) or cloud.accepted[reading] == 0:
        return log_det * 0.0
    s, rows, best = plan.sensor[reading], plan.rows[reading], -math.inf
    for i in range(len(scores)):
        scores[i] = -rows * heavy_tail(model.loss[s], model.loss_k[s], scores[i] / rows)
        if cloud.weights[i] > 0.0 and scores[i] > best:
            best = scores[i]
    if best == -math.inf:
        return math.nan
    for i in range(len(scores)):
        here = cloud.weights[i] * math.exp(scores[i] - best)
        cloud.weights[i] = max(0.0, here)  # a particle that expects NaN is given up
    return best + math.log(normalise(cloud.weights)) - 0.5 * (log_det + rows * LOG_TWO_PI)


@bare
def settle(model, node, cloud, uniforms, scheme, threshold, spare, sums, ancestors, e, shift):
    """Write the node's estimate down, and resample where too few particles carry the weight."""
    count, total = len(cloud.weights), 0.0
    for i in range(count):
        total += cloud.weights[i] * cloud.weights[i]
    cloud.effective[node] = 1.0 / total
    blocks = len(model.table)
    moments_of(
        model.table, 0, blocks, model.n, model.d, cloud.states, cloud.weights, cloud.mean[node],
        cloud.cov[node], e, shift,
    )  # fmt: skip
    if len(cloud.kept) > 1 or len(cloud.mean) == 1:
        copy_matrix(cloud.states, cloud.kept[node])
        copy_vector(cloud.weights, cloud.kept_weights[node])
    if not cloud.effective[node] < threshold * count:
        return
    resample(cloud.weights, uniforms, scheme, sums, ancestors)
    for i in range(count):
        copy_vector(cloud.states[ancestors[i]], spare[i])
        cloud.weights[i] = 1.0 / count
    copy_matrix(spare, cloud.states)


@bare
def follow_nodes(
    model,
    plan,
    span,
    normals,
    uniforms,
    scheme,
    threshold,
    cloud,
    scratch,
    seen,
    scores,
    spare,
    sums,
    ancestors,
):
    """The loop of `follow`, with every array at hand."""
    total, step = 0.0, span[0, 1]
    for node in range(span[0, 0], span[1, 0]):
        while step < plan.step_ptr[node + 1]:
            move(model, plan, step, cloud.states, normals[step - span[0, 1]], scratch)
            step += 1
        for reading in range(plan.reading_ptr[node], plan.reading_ptr[node + 1]):
            gained = weigh(model, plan, reading, cloud, scores, seen)
            if math.isnan(gained):
                return total, reading
            total += gained
        drawn = uniforms[node - span[0, 0]]
        settle(model, node, cloud, drawn, scheme, threshold, spare, sums, ancestors, scratch[4], seen[5])
    while step < span[1, 1]:
        move(model, plan, step, cloud.states, normals[step - span[0, 1]], scratch)
        step += 1
    return total, -1


@njit(types.Tuple([f0, i0])(MODEL, SCHEDULE, i2, f3, f2, i0, f0, CLOUD), cache=True, error_model="numpy")
def follow(model, plan, span, normals, uniforms, scheme, threshold, cloud):
    """Carry a cloud over a span of the log, [[node, step], [node, step]]: from, up to.

    `normals` (steps, P, d) and `uniforms` (nodes, 1 or P) are what chance has to say there.  Returns (log
    likelihood, -1 or the reading at which no particle could be weighed).
    """
    n, d, widest, count = model.n, model.d, max(plan.z.shape[1], model.d), len(cloud.weights)
    scratch = (
        np.empty(n), np.empty((d, d)), np.full((d, d), np.nan), np.empty((d, d)), np.empty(widest),
    )  # fmt: skip
    seen = (
        np.empty((count, plan.z.shape[1])), np.empty(widest), np.empty(widest), np.empty((widest, widest)),
        np.empty(widest), np.empty(widest),
    )  # fmt: skip
    return follow_nodes(
        model, plan, span, normals, uniforms, scheme, threshold, cloud, scratch, seen, np.empty(count),
        np.empty((count, n)), np.empty(count), np.empty(count, dtype=np.int64),
    )  # fmt: skip
