"""The extended Kalman filter over a whole log in UD or square-root form: P is never formed but to be read.

Both keep P = U D Uᵀ: the UD form with a unit triangular U (Bierman and Thornton), the square-root form with a
triangular U = P½ and D = I (Householder arrays).  Everything else is as in `extended`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from sequential.kernels.arrays import f0, f1, f2, i0, w1, w2
from sequential.kernels.belief import LOG_TWO_PI, admit
from sequential.kernels.bierman import BIERMAN_VECTORS, factor_ud, reconstruct, update_ud
from sequential.kernels.call import allocating, bare, bare_as, call, inlined
from sequential.kernels.charts import retract, transport
from sequential.kernels.matrices import copy_matrix, copy_vector, fill_diagonal, multiply
from sequential.kernels.orthogonal import push_root, push_ud, update_root
from sequential.kernels.records import FILTERED, FINISHED, MODEL, SCHEDULE
from sequential.kernels.sensing import loss_weight, measure, process_jacobian, scratch_size, sensor_jacobian

__all__ = ["ROOT", "UD", "filter_factored"]

UD, ROOT = 0, 1
CONVERGED = 1e-9  # an iterated update stops when no tangent component moves by more
PAIR = types.Tuple([f0, f0])


@bare_as(types.void(i0, f2, w2, w1, f2, f1, i0, w2, w1))
def push(form, f, u, diagonal, source, variance, d, array, weight):
    """U D Uᵀ <- F U D Uᵀ Fᵀ + G diag(variance) Gᵀ."""
    if form == UD:
        push_ud(f, u, diagonal, source, variance, d, array, weight)
    else:
        push_root(f, u, diagonal, source, variance, d, array, weight)


@bare_as(PAIR(i0, f2, f1, f2, f2, f0, f1, i0, i0, w1, w2, w1, w2, w2, w2, w2))
def propose(
    form, u, diagonal, h, noise, weight, residual, m, d, delta, new, new_diagonal, rows, lower, vectors, array
):
    """The factors after a reading, beside those before it, and the correction; returns (NIS, log det S)."""
    copy_matrix(u, new)
    copy_vector(diagonal, new_diagonal)
    for i in range(d):
        delta[i] = 0.0
    if form == UD:
        return update_ud(new, new_diagonal, h, noise, weight, residual, m, d, delta, rows, lower, vectors)
    return update_root(new, h, noise, weight, residual, m, d, delta, array, lower, vectors[0])


@bare_as(types.void(f2, f1, f2, f2, i0, i0, w2, w2))
def innovation_covariance(u, diagonal, h, noise, m, d, rows, out):
    """S = H U D Uᵀ Hᵀ + R."""
    multiply(h, u, rows, m, d, d)
    for i in range(m):
        for j in range(i + 1):
            s = noise[i, j]
            for k in range(d):
                s += rows[i, k] * diagonal[k] * rows[j, k]
            out[i, j] = s
            out[j, i] = s


@inlined
def predict_factors(form, model, plan, node, x, u, diagonal, phi, keep, work):
    """Carry mean and factors (and phi with `keep`) along the steps to a node; False: Q is indefinite."""
    d, width = model.d, plan.inputs.shape[1]
    f, flat, after, q, source, variance, array, weight = work
    for s in range(plan.step_ptr[node], plan.step_ptr[node + 1]):
        row, dt = plan.step_input[s] * width, plan.step_dt[s]
        call(model.step, x, 0, plan.inputs, row, dt, model.params, 0, after, 0)
        process_jacobian(model, x, plan.inputs, plan.step_input[s], dt, after, f)
        fill_diagonal(q, 0.0)
        call(model.noise, x, 0, plan.inputs, row, dt, model.params, 0, q, 0)
        copy_vector(after, x)
        if factor_ud(q, d, source, variance) > 0:
            return False
        push(form, f, u, diagonal, source, variance, d, array, weight)
        if keep != 0:
            multiply(f, phi, flat, d, d, d)
            copy_matrix(flat, phi)
    return True


@allocating
def iterate(form, model, plan, reading, x, u, diagonal, weight, iterations, update, work, expected, residual):
    """Relinearise an update until it settles, from the plain one in `delta`; returns its last NIS."""
    s = plan.sensor[reading]
    m, d, blocks = model.z_dim[s], model.d, len(model.table)
    h, flat, _, delta, new, new_diagonal, rows, lower, vectors, array = update
    noise = plan.noise_cov[plan.noise_row[reading]]
    start, seen, seen_diagonal = x.copy(), np.empty((d, d)), np.empty(d)
    turn, inverse, e, ahead, still = np.empty((d, d)), np.empty((d, d)), np.empty(d), np.empty(d), np.zeros(d)
    retract(model.table, 0, blocks, start, 0, delta, 0, x, 0)
    nis = 0.0
    for _ in range(iterations - 1):
        # the prior seen from x: the tangent vector `ahead` that leads back to it, and its factors there
        transport(model.table, blocks, d, start, 0, x, 0, e, turn, inverse)
        copy_matrix(u, seen)
        copy_vector(diagonal, seen_diagonal)
        push(form, inverse, seen, seen_diagonal, seen, still, d, work[6], work[7])
        measure(model, plan, reading, x, 0, expected, residual)
        sensor_jacobian(model, plan, reading, x, 0, expected, flat, h)
        for i in range(d):
            ahead[i] = 0.0
            for k in range(d):
                ahead[i] -= inverse[i, k] * e[k]
        for i in range(m):
            for k in range(d):
                residual[i] -= h[i, k] * ahead[k]
        nis, _ = propose(
            form, seen, seen_diagonal, h, noise, weight, residual, m, d, delta, new, new_diagonal,
            rows, lower, vectors, array,
        )  # fmt: skip
        largest = 0.0
        for i in range(d):
            delta[i] += ahead[i]
            largest = max(largest, abs(delta[i]))
        retract(model.table, 0, blocks, x, 0, delta, 0, x, 0)
        if largest < CONVERGED:
            break
    return nis


@inlined
def absorb(form, model, plan, reading, x, u, diagonal, iterations, update, work, expected, residual, out):
    """Update the belief by one reading; returns its log likelihood, 0 if gated, NaN if S is singular."""
    s = plan.sensor[reading]
    m, d, blocks = model.z_dim[s], model.d, len(model.table)
    h, flat, innovation_cov, delta, new, new_diagonal, rows, lower, vectors, array = update
    noise = plan.noise_cov[plan.noise_row[reading]]
    measure(model, plan, reading, x, 0, expected, residual)
    sensor_jacobian(model, plan, reading, x, 0, expected, flat, h)
    innovation_covariance(u, diagonal, h, noise, m, d, rows, innovation_cov)
    nis, log_det = propose(
        form, u, diagonal, h, noise, 1.0, residual, m, d, delta, new, new_diagonal,
        rows, lower, vectors, array,
    )  # fmt: skip
    verdict = admit(model, plan, reading, nis, residual, innovation_cov, out)
    if verdict < 1:
        return math.nan if verdict < 0 else 0.0
    log_likelihood = -0.5 * (nis + log_det + plan.rows[reading] * LOG_TWO_PI)
    weight = loss_weight(model.loss[s], model.loss_k[s], nis / plan.rows[reading])
    if weight < 1.0:
        nis, _ = propose(
            form, u, diagonal, h, noise, weight, residual, m, d, delta, new, new_diagonal,
            rows, lower, vectors, array,
        )  # fmt: skip
    if iterations > 1:
        nis = iterate(
            form, model, plan, reading, x, u, diagonal, weight, iterations, update, work, expected, residual
        )
    else:
        retract(model.table, 0, blocks, x, 0, delta, 0, x, 0)
    copy_matrix(new, u)
    copy_vector(new_diagonal, diagonal)
    return log_likelihood if nis >= 0.0 else math.nan


@bare
def filter_nodes(
    form, model, plan, x, u, diagonal, phi, iterations, work, update, expected, residual, keep, out
):
    """The loop of `filter_factored`, with every array at hand."""
    log_likelihood = 0.0
    for node in range(len(plan.reading_ptr) - 1):
        if keep != 0:
            fill_diagonal(phi, 1.0)
        failed = -1
        if not predict_factors(form, model, plan, node, x, u, diagonal, phi, keep, work):
            failed = -2 - node
        if keep != 0:
            copy_vector(x, out.predicted_mean[node])
            reconstruct(u, diagonal, model.d, out.predicted_cov[node])
            copy_matrix(phi, out.transition[node])
        reading = plan.reading_ptr[node]
        while failed == -1 and reading < plan.reading_ptr[node + 1]:
            gained = absorb(
                form, model, plan, reading, x, u, diagonal, iterations, update, work, expected, residual, out
            )
            if math.isnan(gained):
                failed = reading
            else:
                log_likelihood += gained
            reading += 1
        copy_vector(x, out.mean[node])
        reconstruct(u, diagonal, model.d, out.cov[node])
        if failed != -1:
            return log_likelihood, failed
    return log_likelihood, -1


@bare_as(types.void(i0, f2, i0, w2, w1))
def open_factors(form, cov, d, u, diagonal):
    """U D Uᵀ = P of a semi-definite covariance, in a form's own way."""
    factor_ud(cov, d, u, diagonal)
    if form == ROOT:
        for j in range(d):
            for i in range(d):
                u[i, j] *= math.sqrt(diagonal[j])
            diagonal[j] = 1.0


@allocating
def follow(model, plan, x, u, diagonal, form, iterations, keep, out):
    """Run the filter from x, U and D, in place; see `filter_factored`."""
    n, d, widest = model.n, model.d, plan.z.shape[1]
    work = (
        np.empty((d, d)), np.empty((d, d)), np.empty(n), np.empty((d, d)), np.empty((d, d)), np.empty(d),
        np.empty((d, 2 * d)), np.empty(2 * d),
    )  # fmt: skip
    flat = np.empty(scratch_size(n, d, widest))
    update = (
        np.empty((widest, d)), flat, np.empty((widest, widest)), np.empty(d), np.empty((d, d)), np.empty(d),
        np.empty((widest, d)), np.empty((widest, widest)), np.empty((BIERMAN_VECTORS, max(widest, d))),
        np.empty((widest + d, widest + d)),
    )  # fmt: skip
    return filter_nodes(
        form, model, plan, x, u, diagonal, np.eye(d), iterations, work, update, np.empty(widest),
        np.empty(widest), keep, out,
    )  # fmt: skip


@njit(
    FINISHED(MODEL, SCHEDULE, f1, f2, types.int64, types.int64, types.int64, FILTERED),
    cache=True,
    error_model="numpy",
)
def filter_factored(model, plan, prior_mean, prior_cov, form, iterations, keep, out):
    """Run the filter in form UD or ROOT; returns (log likelihood, code).

    The code is -1, or the reading at which S was singular, or -2 - k where Q was indefinite before node k.
    """
    x, u, diagonal = prior_mean.copy(), np.empty((model.d, model.d)), np.empty(model.d)
    open_factors(form, prior_cov, model.d, u, diagonal)
    return follow(model, plan, x, u, diagonal, form, iterations, keep, out)
