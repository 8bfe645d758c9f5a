"""The extended Kalman filter over a whole log: error state on any product manifold.

With `iterations` > 1 each update is iterated (Bell and Cathey 1993), which makes it the maximum a
posteriori estimate of the state given its prediction and the reading.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from sequential.kernels.arrays import f1, f2, w1, w2
from sequential.kernels.belief import LOG_TWO_PI, admit, tallied
from sequential.kernels.call import allocating, inlined
from sequential.kernels.charts import retract, transport
from sequential.kernels.correcting import CORRECTION, correct, correction_scratch, settle
from sequential.kernels.flat import retract_state
from sequential.kernels.matrices import copy_matrix, copy_vector, fill_diagonal, multiply, multiply_nt
from sequential.kernels.moving import predict
from sequential.kernels.records import FILTERED, FINISHED, MODEL, SCHEDULE
from sequential.kernels.sensing import look, loss_weight, measure, sensor_jacobian
from sequential.kernels.sizes import ANY_SIZE, reading_dim, sized

__all__ = ["filter_log"]

WORKSPACE = types.Tuple([w1, w1, w2, w2, types.Tuple([w2, w2, w1, w2]), CORRECTION, w1, w1])
CONVERGED = 1e-9  # an iterated update stops when no tangent component moves by more


@allocating
def iterate(model, plan, reading, x, p, weight, iterations, update, work, expected, residual):
    """Relinearise an update until it settles, from the plain update that stands in `delta`; False: S < 0."""
    s = plan.sensor[reading]
    m, d, blocks = model.z_dim[s], model.d, len(model.table)
    h, flat, delta, back = update[0], update[1], update[7], np.empty(d)
    noise = plan.noise_cov[plan.noise_row[reading]]
    start, prior, total = x.copy(), p.copy(), np.empty(d)
    retract(model.table, 0, blocks, start, 0, delta, 0, x, 0)
    turn, inverse, redone = np.empty((d, d)), np.empty((d, d)), False
    for _ in range(iterations - 1):
        # Prior seen from x: the tangent vector `back` that leads to the prediction, and its covariance.
        transport(model.table, blocks, d, start, 0, x, 0, total, turn, inverse)
        multiply(inverse, prior, work[0], d, d, d)
        multiply_nt(work[0], inverse, p, d, d, d)
        measure(model, plan, reading, x, 0, expected, residual)
        sensor_jacobian(model, plan, reading, x, 0, expected, flat, h)
        for i in range(d):
            back[i] = 0.0
            for k in range(d):
                back[i] -= inverse[i, k] * total[k]
        for i in range(m):
            for k in range(d):
                residual[i] -= h[i, k] * back[k]
        nis, _, _, redone = correct(p, h, noise, weight, residual, m, d, update)
        if nis < 0.0:
            return False
        largest = 0.0
        for i in range(d):
            total[i] = back[i] + delta[i]
            largest = max(largest, abs(total[i]))
        retract(model.table, 0, blocks, x, 0, total, 0, x, 0)
        if largest < CONVERGED:
            break
    return settle(p, h, noise, weight, residual, m, d, update, redone)


@inlined
def absorb(model, plan, reading, x, p, iterations, update, work, expected, residual, out):
    """Update the belief by one reading; (a, b) where its log likelihood is a - ½ log b.

    That is (0, 1) if it was gated; a is NaN if S is indefinite.
    """
    s = plan.sensor[reading]
    m, d = reading_dim(model, s), model.d
    h, delta = update[0], update[7]
    noise = plan.noise_cov[plan.noise_row[reading]]
    look(model, plan, reading, x, 0, expected, residual, update[1], h)
    nis, log_det, determinant, redone = correct(p, h, noise, 1.0, residual, m, d, update)
    verdict = admit(model, plan, reading, nis, residual, update[4], out)
    if verdict < 1:
        return math.nan if verdict < 0 else 0.0, 1.0
    gained = -0.5 * (nis + log_det + plan.rows[reading] * LOG_TWO_PI)
    weight = 1.0
    if model.loss[s] != 0:
        weight = loss_weight(model.loss[s], model.loss_k[s], nis / plan.rows[reading])
    if weight < 1.0:
        redone = correct(p, h, noise, weight, residual, m, d, update)[3]
    if iterations > 1:
        sound = iterate(model, plan, reading, x, p, weight, iterations, update, work, expected, residual)
    else:
        sound = settle(p, h, noise, weight, residual, m, d, update, redone)
        retract_state(model, x, 0, delta, 0, x, 0)
    return gained if sound else math.nan, determinant


@inlined
def filter_nodes(model, plan, belief, x, p, phi, iterations, work, update, expected, residual, keep, out):
    """The loop of `filter_log`, with every array at hand."""
    log_likelihood, logarithm, product = 0.0, 0.0, 1.0
    for node in range(len(plan.reading_ptr) - 1):
        if keep != 0:
            fill_diagonal(phi, 1.0)
        predict(model, plan, node, belief, x, p, phi, keep, work)
        if keep != 0:
            copy_vector(x, out.predicted_mean[node])
            copy_matrix(p, out.predicted_cov[node])
            copy_matrix(phi, out.transition[node])
        for reading in range(plan.reading_ptr[node], plan.reading_ptr[node + 1]):
            gained, share = absorb(
                model, plan, reading, x, p, iterations, update, work, expected, residual, out
            )
            if math.isnan(gained):
                copy_vector(x, out.mean[node])
                copy_matrix(p, out.cov[node])
                return log_likelihood, reading
            log_likelihood += gained
            logarithm, product = tallied(logarithm, product * share)
        copy_vector(x, out.mean[node])
        copy_matrix(p, out.cov[node])
        for i in range(model.d):
            if p[i, i] < 0.0:
                return log_likelihood, -2 - node
    return log_likelihood - 0.5 * (logarithm + math.log(product)), -1


@allocating
def workspace(n, d, widest):
    """Scratch arrays of `filter_nodes`, of type WORKSPACE."""
    belief = np.empty(n + d * d)
    work = (np.empty((d, d)), np.empty((d, d)), np.empty(n), np.empty((d, d)))
    x, p = belief[:n], belief[n:].reshape((d, d))
    update = correction_scratch(n, d, widest)
    return belief, x, p, np.eye(d), work, update, np.empty(widest), np.empty(widest)


@njit(
    FINISHED(MODEL, SCHEDULE, f1, f2, types.int64, types.int64, FILTERED, ANY_SIZE, ANY_SIZE, ANY_SIZE),
    cache=True, error_model="numpy", nogil=True,
)  # fmt: skip
def filter_log(model, plan, prior_mean, prior_cov, iterations, keep, out, storage, tangent, reading):
    """Run the filter; returns (log likelihood, code).

    The code is -1, or the reading at which S was not positive definite,
    or -2 - k where a variance at node k was negative.

    The last three are the sizes of state, tangent and readings, as in `sequential.kernels.sizes`.
    """
    sure = sized(model, storage, tangent, reading)
    belief, x, p, phi, work, update, expected, residual = workspace(model.n, model.d, plan.z.shape[1])
    copy_vector(prior_mean, x)
    copy_matrix(prior_cov, p)
    return filter_nodes(
        sure, plan, belief, x, p, phi, iterations, work, update, expected, residual, keep, out
    )
