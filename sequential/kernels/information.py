"""The extended Kalman filter over a whole log in information form: Y = P⁻¹ and the information vector Y δ.

Y is kept as U D Uᵀ, and the two halves of the filter change places (Bierman 1977, section X; Anderson and
Moore 1979, section 6.3): a reading adds the columns of Hᵀ R^-½, which is a matter of orthogonalising, and the
noise of a step is taken out column by column with Bierman's update, as if it were a reading of variance 1/q.
So Q may be singular or zero; the transition must be invertible.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from sequential.kernels.arrays import f1, f2
from sequential.kernels.belief import LOG_TWO_PI, admit
from sequential.kernels.bierman import factor_ud, update_ud_by_scalar
from sequential.kernels.call import allocating, bare, call, inlined
from sequential.kernels.charts import retract
from sequential.kernels.informing import covariance, inform, invert
from sequential.kernels.matrices import (
    copy_matrix,
    copy_vector,
    fill_diagonal,
    multiply,
    multiply_nt,
    symmetrise,
)
from sequential.kernels.orthogonal import orthogonalise
from sequential.kernels.records import FILTERED, FINISHED, MODEL, SCHEDULE
from sequential.kernels.sensing import loss_weight, measure, process_jacobian, scratch_size, sensor_jacobian

__all__ = ["filter_information"]


@inlined
def predict_information(model, plan, node, x, u, diagonal, phi, keep, work):
    """Carry mean and information (and phi with `keep`) along the steps to a node; False: it cannot be."""
    d, width = model.d, plan.inputs.shape[1]
    f, flat, after, q, source, variance, array, weights, inverse, gain, projected, column = work
    for s in range(plan.step_ptr[node], plan.step_ptr[node + 1]):
        row, dt = plan.step_input[s] * width, plan.step_dt[s]
        call(model.step, x, 0, plan.inputs, row, dt, model.params, 0, after, 0)
        process_jacobian(model, x, plan.inputs, plan.step_input[s], dt, after, f)
        fill_diagonal(q, 0.0)
        call(model.noise, x, 0, plan.inputs, row, dt, model.params, 0, q, 0)
        copy_vector(after, x)
        if keep != 0:
            multiply(f, phi, flat, d, d, d)
            copy_matrix(flat, phi)
        if factor_ud(q, d, source, variance) > 0 or not invert(f, d, flat, inverse):
            return False
        for i in range(d):
            weights[i] = diagonal[i]
            for j in range(d):
                total = 0.0
                for k in range(j + 1):
                    total += inverse[k, i] * u[k, j]
                array[i, j] = total
        orthogonalise(array, weights, d, d, u, diagonal)
        for k in range(d):
            if variance[k] > 0.0:
                for i in range(d):
                    column[i] = source[i, k]
                update_ud_by_scalar(u, diagonal, column, 1.0 / variance[k], d, gain, projected)
    return True


@inlined
def absorb(model, plan, reading, x, u, diagonal, p, update, work, expected, residual, out):
    """Update the belief by one reading; returns its log likelihood, 0 if gated, NaN if it cannot be."""
    s = plan.sensor[reading]
    m, d, blocks = model.z_dim[s], model.d, len(model.table)
    h, flat, innovation_cov, delta, rows, lower, vectors, new, new_diagonal = update
    noise = plan.noise_cov[plan.noise_row[reading]]
    measure(model, plan, reading, x, 0, expected, residual)
    sensor_jacobian(model, plan, reading, x, 0, expected, flat, h)
    multiply(h, p, rows, m, d, d)
    multiply_nt(rows, h, innovation_cov, m, d, m)
    for i in range(m):
        for j in range(m):
            innovation_cov[i, j] += noise[i, j]
    symmetrise(innovation_cov, m)
    nis, log_det = inform(
        u,
        diagonal,
        h,
        noise,
        1.0,
        residual,
        m,
        d,
        delta,
        new,
        new_diagonal,
        rows,
        lower,
        vectors,
        work[6],
        work[7],
    )
    verdict = admit(model, plan, reading, nis, residual, innovation_cov, out)
    if verdict < 1:
        return math.nan if verdict < 0 else 0.0
    log_likelihood = -0.5 * (nis + log_det + plan.rows[reading] * LOG_TWO_PI)
    weight = loss_weight(model.loss[s], model.loss_k[s], nis / plan.rows[reading])
    if weight < 1.0:
        nis, _ = inform(
            u, diagonal, h, noise, weight, residual, m, d, delta, new, new_diagonal, rows, lower, vectors,
            work[6], work[7],
        )  # fmt: skip
    for i in range(d):
        diagonal[i] = new_diagonal[1 + i]
        for j in range(d):
            u[i, j] = new[1 + i, 1 + j]
    if not nis >= 0.0 or not covariance(u, diagonal, d, work[8], p):
        return math.nan
    retract(model.table, 0, blocks, x, 0, delta, 0, x, 0)
    return log_likelihood


@bare
def filter_nodes(model, plan, x, u, diagonal, p, phi, work, update, expected, residual, keep, out):
    """The loop of `filter_information`, with every array at hand."""
    log_likelihood = 0.0
    for node in range(len(plan.reading_ptr) - 1):
        if keep != 0:
            fill_diagonal(phi, 1.0)
        failed = -1
        moved = predict_information(model, plan, node, x, u, diagonal, phi, keep, work)
        if not moved or not covariance(u, diagonal, model.d, work[8], p):
            failed = -2 - node
        if keep != 0:
            copy_vector(x, out.predicted_mean[node])
            copy_matrix(p, out.predicted_cov[node])
            copy_matrix(phi, out.transition[node])
        reading = plan.reading_ptr[node]
        while failed == -1 and reading < plan.reading_ptr[node + 1]:
            gained = absorb(model, plan, reading, x, u, diagonal, p, update, work, expected, residual, out)
            if math.isnan(gained):
                failed = reading
            else:
                log_likelihood += gained
            reading += 1
        copy_vector(x, out.mean[node])
        copy_matrix(p, out.cov[node])
        if failed != -1:
            return log_likelihood, failed
    return log_likelihood, -1


@bare
def open_information(p, d, u, diagonal, array, weights, inverse):
    """U D Uᵀ = P⁻¹ of a covariance, and P itself made symmetric; returns False where P is singular."""
    # Y = U⁻ᵀ D⁻¹ U⁻¹ of the covariance's factors, made triangular the other way round
    factor_ud(p, d, u, diagonal)
    if not covariance(u, diagonal, d, inverse, p):
        return False
    for j in range(d):
        weights[j] = 1.0 / diagonal[j]
        for i in range(d):
            array[i, j] = inverse[j, i]
    orthogonalise(array, weights, d, d, u, diagonal)
    return True


@allocating
def follow(model, plan, x, u, diagonal, p, known, keep, out):
    """Run the filter from x and U, D, in place, or if not `known` from P; see `filter_information`."""
    n, d, widest = model.n, model.d, plan.z.shape[1]
    work = (
        np.empty((d, d)), np.empty((d, d)), np.empty(n), np.empty((d, d)), np.empty((d, d)), np.empty(d),
        np.empty((d + 1, d + widest)), np.empty(d + widest), np.empty((d, d)), np.empty(d), np.empty(d),
        np.empty(d),
    )  # fmt: skip
    flat = np.empty(scratch_size(n, d, widest))
    update = (
        np.empty((widest, d)), flat, np.empty((widest, widest)), np.empty(d), np.empty((widest, d)),
        np.empty((widest, widest)), np.empty((2, max(widest, d))), np.empty((d + 1, d + 1)), np.empty(d + 1),
    )  # fmt: skip
    if not known and not open_information(p, d, u, diagonal, work[6], work[7], work[8]):
        return 0.0, -2
    return filter_nodes(
        model, plan, x, u, diagonal, p, np.eye(d), work, update, np.empty(widest), np.empty(widest), keep, out
    )


@njit(FINISHED(MODEL, SCHEDULE, f1, f2, types.int64, FILTERED), cache=True, error_model="numpy")
def filter_information(model, plan, prior_mean, prior_cov, keep, out):
    """Run the filter; returns (log likelihood, code).

    The code is -1, or the reading at which S or R was not positive definite, or -2 - k where the way to node
    k has a singular transition, an indefinite noise, or loses all information on a direction.
    """
    d = model.d
    x, p, u, diagonal = prior_mean.copy(), prior_cov.copy(), np.empty((d, d)), np.empty(d)
    return follow(model, plan, x, u, diagonal, p, False, keep, out)
