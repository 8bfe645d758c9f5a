"""The extended Kalman filter over a whole log: error state on any product manifold.

With `iterations` > 1 each update is iterated (Bell and Cathey 1993), which makes it the maximum a
posteriori estimate of the state given its prediction and the reading.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit, types

from sequential.kernels.arrays import f1, f2
from sequential.kernels.belief import LOG_TWO_PI, gain_and_innovation, joseph
from sequential.kernels.call import allocating, bare, call, inlined
from sequential.kernels.charts import retract, transport
from sequential.kernels.matrices import copy_matrix, copy_vector, fill_diagonal, multiply, push_covariance
from sequential.kernels.records import MODEL, SCHEDULE
from sequential.kernels.sensing import loss_weight, measure, process_jacobian, scratch_size, sensor_jacobian

__all__ = ["FILTERED", "Filtered", "filter_log"]

CONVERGED = 1e-9  # an iterated update stops when no tangent component moves by more


class Filtered(NamedTuple):
    """What a filter writes; with `keep` = 0 the three arrays of predictions have length one."""

    mean: Any  # (K, n)
    cov: Any  # (K, d, d)
    predicted_mean: Any  # (K, n)
    predicted_cov: Any  # (K, d, d)
    transition: Any  # (K, d, d)
    residual: Any  # (M, m)
    residual_cov: Any  # (M, m, m)
    accepted: Any  # (M,) 1 used, 0 rejected by its gate


_f1, _f2, _f3, _i1 = types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1], types.int64[::1]
FILTERED = types.NamedTuple([_f2, _f3, _f2, _f3, _f3, _f2, _f3, _i1], Filtered)
FINISHED = types.Tuple([types.float64, types.int64])


@inlined
def predict(model, plan, node, belief, x, p, phi, keep, work):
    """Carry belief = [x | p] (and phi with `keep`) along the steps that lead to a node."""
    d, width = model.d, plan.inputs.shape[1]
    f, flat, after, flipped = work
    for s in range(plan.step_ptr[node], plan.step_ptr[node + 1]):
        u, dt = plan.step_input[s] * width, plan.step_dt[s]
        if model.advance != 0 and (keep == 0 or model.carry != 0):
            if keep != 0:
                call(model.carry, x, 0, plan.inputs, u, dt, model.params, 0, phi, 0)
            call(model.advance, belief, 0, plan.inputs, u, dt, model.params, 0, belief, 0)
            continue
        call(model.step, x, 0, plan.inputs, u, dt, model.params, 0, after, 0)
        process_jacobian(model, x, plan.inputs, plan.step_input[s], dt, after, f)
        push_covariance(f, p, flat, flipped, d)
        call(model.noise, x, 0, plan.inputs, u, dt, model.params, 0, p, 0)
        if keep != 0:
            multiply(f, phi, flat, d, d, d)
            copy_matrix(flat, phi)
        copy_vector(after, x)


@allocating
def iterate(model, plan, reading, x, p, weight, iterations, update, work, expected, residual):
    """Relinearise an update until it settles, from the plain update that stands in `delta`."""
    s = plan.sensor[reading]
    m, d, blocks = model.z_dim[s], model.d, len(model.table)
    h, flat, cross, gain, innovation_cov, lower, scaled, delta, e = update
    noise = model.noise_cov[s]
    start, prior = x.copy(), p.copy()
    retract(model.table, 0, blocks, start, 0, delta, 0, x, 0)
    turn, inverse = np.empty((d, d)), np.empty((d, d))
    for _ in range(iterations - 1):
        # Prior seen from x: the tangent vector b that leads back to the prediction, and its covariance.
        transport(model.table, blocks, d, start, 0, x, 0, e, turn, inverse)
        multiply(inverse, prior, work[0], d, d, d)
        for i in range(d):
            for j in range(d):
                total = 0.0
                for k in range(d):
                    total += work[0][i, k] * inverse[j, k]
                p[i, j] = total
        measure(model, plan, reading, x, 0, expected, residual)
        sensor_jacobian(model, plan, reading, x, 0, expected, flat, h)
        for i in range(d):
            delta[i] = 0.0
            for k in range(d):
                delta[i] -= inverse[i, k] * e[k]
        for i in range(m):
            for k in range(d):
                residual[i] -= h[i, k] * delta[k]
        gain_and_innovation(p, h, noise, weight, residual, m, d, innovation_cov, lower, cross, gain)
        largest = 0.0
        for i in range(d):
            for k in range(m):
                delta[i] += gain[k, i] * residual[k]
            largest = max(largest, abs(delta[i]))
        retract(model.table, 0, blocks, x, 0, delta, 0, x, 0)
        if largest < CONVERGED:
            break
    joseph(p, h, gain, noise, weight, m, d, work[0], work[1], scaled)


@inlined
def absorb(model, plan, reading, x, p, iterations, update, work, expected, residual, out):
    """Update the belief by one reading; returns its log likelihood, 0 if gated, NaN if S is indefinite."""
    s = plan.sensor[reading]
    m, d, blocks = model.z_dim[s], model.d, len(model.table)
    h, flat, cross, gain, innovation_cov, lower, scaled, delta, _ = update
    noise = model.noise_cov[s]
    measure(model, plan, reading, x, 0, expected, residual)
    sensor_jacobian(model, plan, reading, x, 0, expected, flat, h)
    nis, log_det = gain_and_innovation(p, h, noise, 1.0, residual, m, d, innovation_cov, lower, cross, gain)
    for i in range(m):
        out.residual[reading, i] = residual[i]
        for j in range(m):
            out.residual_cov[reading, i, j] = innovation_cov[i, j]
    if nis < 0.0:
        return math.nan
    if nis > model.gate[s]:
        out.accepted[reading] = 0
        return 0.0
    out.accepted[reading] = 1
    log_likelihood = -0.5 * (nis + log_det + m * LOG_TWO_PI)
    weight = loss_weight(model.loss[s], model.loss_k[s], nis / m)
    if weight < 1.0:
        gain_and_innovation(p, h, noise, weight, residual, m, d, innovation_cov, lower, cross, gain)
    for i in range(d):
        delta[i] = 0.0
        for k in range(m):
            delta[i] += gain[k, i] * residual[k]
    if iterations <= 1:
        joseph(p, h, gain, noise, weight, m, d, work[0], work[1], scaled)
        retract(model.table, 0, blocks, x, 0, delta, 0, x, 0)
        return log_likelihood
    iterate(model, plan, reading, x, p, weight, iterations, update, work, expected, residual)
    return log_likelihood


@bare
def filter_nodes(model, plan, belief, x, p, phi, iterations, work, update, expected, residual, keep, out):
    """The loop of `filter_log`, with every array at hand."""
    log_likelihood = 0.0
    for node in range(len(plan.reading_ptr) - 1):
        if keep != 0:
            fill_diagonal(phi, 1.0)
        predict(model, plan, node, belief, x, p, phi, keep, work)
        if keep != 0:
            copy_vector(x, out.predicted_mean[node])
            copy_matrix(p, out.predicted_cov[node])
            copy_matrix(phi, out.transition[node])
        for reading in range(plan.reading_ptr[node], plan.reading_ptr[node + 1]):
            gain_log = absorb(model, plan, reading, x, p, iterations, update, work, expected, residual, out)
            if math.isnan(gain_log):
                copy_vector(x, out.mean[node])
                copy_matrix(p, out.cov[node])
                return log_likelihood, reading
            log_likelihood += gain_log
        copy_vector(x, out.mean[node])
        copy_matrix(p, out.cov[node])
    return log_likelihood, -1


@njit(FINISHED(MODEL, SCHEDULE, f1, f2, types.int64, types.int64, FILTERED), cache=True, error_model="numpy")
def filter_log(model, plan, prior_mean, prior_cov, iterations, keep, out):
    """Run the filter; returns (log likelihood, -1 or the reading at which S was not positive definite)."""
    n, d = model.n, model.d
    widest = plan.z.shape[1]
    belief = np.empty(n + d * d)
    x, p = belief[:n], belief[n:].reshape((d, d))
    copy_vector(prior_mean, x)
    copy_matrix(prior_cov, p)
    phi = np.eye(d)
    work = (np.empty((d, d)), np.empty((d, d)), np.empty(n), np.empty((d, d)))
    flat = np.empty(scratch_size(n, d, widest))
    update = (
        np.empty((widest, d)), flat, np.empty((widest, d)), np.empty((widest, d)),
        np.empty((widest, widest)), np.empty((widest, widest)), np.empty((d, max(widest, d))),
        np.empty(d), np.empty(d),
    )  # fmt: skip
    expected, residual = np.empty(widest), np.empty(widest)
    return filter_nodes(
        model, plan, belief, x, p, phi, iterations, work, update, expected, residual, keep, out
    )
