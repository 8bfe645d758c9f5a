"""The unscented Kalman filter over a whole log: sigma points on any product manifold.

Means are sought about the image of the central point by moving to the weighted mean of the tangents that
lead to the others (Hauberg, Lauze, Pedersen 2013, Unscented Kalman filtering on Riemannian manifolds), so
that no angle is ever averaged.  Both halves of the filter are written as statistical linear regressions
(Lefebvre, Bruyninckx, De Schutter 2002): y ≈ A x + b + e, with A = D L⁻¹ / 2γ for the differences D of
opposite points and e of covariance Ω.  The update can then take Joseph's form, and A is the transition
that a smoother needs.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from sequential.kernels.arrays import f1, f2
from sequential.kernels.belief import LOG_TWO_PI, add_correction, admit, gain_and_innovation, joseph
from sequential.kernels.call import bare, call
from sequential.kernels.charts import local, retract
from sequential.kernels.matrices import copy_matrix, copy_vector, multiply
from sequential.kernels.records import FILTERED, FINISHED, MODEL, SCHEDULE
from sequential.kernels.sensing import loss_weight

__all__ = ["filter_sigma_points"]

PASSES = 10  # over a mean on a manifold; two suffice but for a spread of radians
SETTLED = 1e-9  # a correction below this is exact to rounding when subtracted from the tangents
LOST = 1e-13  # a pivot below this share of its diagonal is rounding: a direction without uncertainty
INDEFINITE = -1e-6  # and one that is this negative is not


@bare
def spread(p, d, gamma, lower, steps):
    """Rows ±γ L_i of `steps` (2d, d) from P = L Lᵀ; returns False where P is not positive semi-definite."""
    for j in range(d):
        s = p[j, j]
        for k in range(j):
            s -= lower[j, k] * lower[j, k]
        share = INDEFINITE * p[j, j]
        if not s >= share or p[j, j] < 0.0:
            return False
        pivot = math.sqrt(s) if s > LOST * p[j, j] else 0.0
        for i in range(j):
            lower[i, j] = 0.0
        lower[j, j] = pivot
        for i in range(j + 1, d):
            s = p[i, j]
            for k in range(j):
                s -= lower[i, k] * lower[j, k]
            lower[i, j] = s / pivot if pivot > 0.0 else 0.0
        for i in range(d):
            steps[j, i] = gamma * lower[i, j]
            steps[d + j, i] = -steps[j, i]
    return True


@bare
def mean_of(table, first, last, size, dim, count, points, weights, mean, tangents, move):
    """Mean of `count` + 1 points (row 0 central) about the central one, and the tangents there to all."""
    flat, out = points.reshape(-1), tangents.reshape(-1)
    width, wide = points.shape[1], tangents.shape[1]
    for i in range(size):
        mean[i] = points[0, i]
    for _ in range(PASSES):
        for i in range(count + 1):
            local(table, first, last, mean, 0, flat, i * width, out, i * wide)
        largest = 0.0
        for k in range(dim):
            total = 0.0
            for i in range(1, count + 1):
                total += tangents[i, k]
            move[k] = weights[3] * total + weights[1] * tangents[0, k]
            largest = max(largest, abs(move[k]))
        retract(table, first, last, mean, 0, move, 0, mean, 0)
        if not largest > SETTLED:
            break
    for i in range(count + 1):
        for k in range(dim):
            tangents[i, k] -= move[k]


@bare
def second_moment(tangents, weights, count, dim, out):
    """out = Σ w e eᵀ over the central point and `count` others."""
    for a in range(dim):
        for b in range(a + 1):
            total = 0.0
            for i in range(1, count + 1):
                total += tangents[i, a] * tangents[i, b]
            total = weights[3] * total + weights[2] * tangents[0, a] * tangents[0, b]
            out[a, b] = total
            out[b, a] = total


@bare
def regress(tangents, lower, d, dim, gamma, out):
    """Slope A (dim, d) = D L⁻¹ / 2γ; a direction without uncertainty gets a zero column."""
    for r in range(dim):
        for j in range(d - 1, -1, -1):
            if not lower[j, j] > 0.0:
                out[r, j] = 0.0
                continue
            s = (tangents[1 + j, r] - tangents[1 + d + j, r]) / (2.0 * gamma)
            for k in range(j + 1, d):
                s -= out[r, k] * lower[k, j]
            out[r, j] = s / lower[j, j]


@bare
def draw(model, x, p, weights, sigma):
    """Points x, x ⊕ γ L_i, x ⊕ -γ L_i into the rows of the first array of `sigma`."""
    points, _, _, steps, lower, _ = sigma
    n, d, blocks = model.n, model.d, len(model.table)
    if not spread(p, d, weights[0], lower, steps):
        return False
    flat, step = points.reshape(-1), steps.reshape(-1)
    copy_vector(x, points[0])
    for i in range(2 * d):
        retract(model.table, 0, blocks, x, 0, step, i * d, flat, (i + 1) * n)
    return True


@bare
def predict(model, plan, node, x, p, phi, weights, keep, sigma, work):
    """Carry mean, covariance and (with `keep`) phi along the steps to a node; False where P is indefinite."""
    points, moved, tangents, _, lower, move = sigma
    n, d, blocks, width = model.n, model.d, len(model.table), plan.inputs.shape[1]
    for s in range(plan.step_ptr[node], plan.step_ptr[node + 1]):
        u, dt = plan.step_input[s] * width, plan.step_dt[s]
        if not draw(model, x, p, weights, sigma):
            return False
        before, after = points.reshape(-1), moved.reshape(-1)
        for i in range(2 * d + 1):
            call(model.step, before, i * n, plan.inputs, u, dt, model.params, 0, after, i * n)
        mean_of(model.table, 0, blocks, n, d, 2 * d, moved, weights, x, tangents, move)
        second_moment(tangents, weights, 2 * d, d, p)
        call(model.noise, before, 0, plan.inputs, u, dt, model.params, 0, p, 0)
        if keep != 0:
            regress(tangents, lower, d, d, weights[0], work[0])
            multiply(work[0], phi, work[1], d, d, d)
            copy_matrix(work[1], phi)
    return True


@bare
def look(model, plan, reading, x, p, weights, sigma, seen, h, noise):
    """Regress a reading on the state: residual, slope H (m, d), Ω + R in `noise`; False: P indefinite."""
    points, lower = sigma[0], sigma[4]
    images, tangents, expected, residual, move = seen
    s, given = plan.sensor[reading], plan.noise_cov[plan.noise_row[reading]]
    m, n, d = model.z_dim[s], model.n, model.d
    width, size, wide = plan.context.shape[1], plan.z.shape[1], images.shape[1]
    first, last, at = model.z_first[s], model.z_first[s + 1], model.sensor_params_at[s]
    if not draw(model, x, p, weights, sigma):
        return False
    before, after = points.reshape(-1), images.reshape(-1)
    for i in range(2 * d + 1):
        call(
            model.observe[s], before, i * n, plan.context, reading * width, 0.0,
            model.sensor_params, at, after, i * wide,
        )  # fmt: skip
    mean_of(model.z_table, first, last, model.z_size[s], m, 2 * d, images, weights, expected, tangents, move)
    local(model.z_table, first, last, expected, 0, plan.z.reshape(-1), reading * size, residual, 0)
    if plan.rows[reading] < m:
        for a in range(m):
            if math.isnan(plan.z[reading, a]):
                residual[a] = 0.0
                for i in range(2 * d + 1):
                    tangents[i, a] = 0.0
    regress(tangents, lower, d, m, weights[0], h)
    second_moment(tangents, weights, 2 * d, m, noise)
    share = 0.25 / (weights[0] * weights[0])
    for a in range(m):
        for b in range(m):
            explained = 0.0
            for j in range(1, d + 1):
                explained += (tangents[j, a] - tangents[j + d, a]) * (tangents[j, b] - tangents[j + d, b])
            noise[a, b] += given[a, b] - share * explained
    return True


@bare
def absorb(model, plan, reading, x, p, weights, sigma, seen, update, work, out):
    """Update by one reading; returns its log likelihood, 0 if gated, NaN if S or P is indefinite."""
    h, cross, gain, innovation_cov, factor, noise, scaled, delta = update
    residual = seen[3]
    s, given = plan.sensor[reading], plan.noise_cov[plan.noise_row[reading]]
    m, d = model.z_dim[s], model.d
    if not look(model, plan, reading, x, p, weights, sigma, seen, h, noise):
        return math.nan
    nis, log_det = gain_and_innovation(p, h, noise, 1.0, residual, m, d, innovation_cov, factor, cross, gain)
    verdict = admit(model, plan, reading, nis, residual, innovation_cov, out)
    if verdict < 1:
        return math.nan if verdict < 0 else 0.0
    log_likelihood = -0.5 * (nis + log_det + plan.rows[reading] * LOG_TWO_PI)
    weight = loss_weight(model.loss[s], model.loss_k[s], nis / plan.rows[reading])
    if weight < 1.0:
        for i in range(m):
            for j in range(m):
                noise[i, j] += given[i, j] * (1.0 / weight - 1.0)
        gain_and_innovation(p, h, noise, 1.0, residual, m, d, innovation_cov, factor, cross, gain)
    for i in range(d):
        delta[i] = 0.0
    add_correction(gain, residual, m, d, delta)
    joseph(p, h, gain, noise, 1.0, m, d, work[0], work[1], scaled)
    retract(model.table, 0, len(model.table), x, 0, delta, 0, x, 0)
    return log_likelihood


@njit(FINISHED(MODEL, SCHEDULE, f1, f2, f1, types.int64, FILTERED), cache=True, error_model="numpy")
def filter_sigma_points(model, plan, prior_mean, prior_cov, weights, keep, out):
    """Run the filter with weights (4,) = [γ, mean and covariance of the central point, of any other].

    Returns (log likelihood, code): -1, or the reading at which S or P was not positive definite, or -2 - k
    where P was not on the way to node k.
    """
    n, d = model.n, model.d
    nodes, widest = len(plan.reading_ptr) - 1, plan.z.shape[1]
    count = 2 * d + 1
    x, p, phi = prior_mean.copy(), prior_cov.copy(), np.eye(d)
    sigma = (
        np.empty((count, n)), np.empty((count, n)), np.empty((count, d)), np.empty((2 * d, d)),
        np.zeros((d, d)), np.empty(d),
    )  # fmt: skip
    seen = (
        np.empty((count, widest)), np.empty((count, widest)), np.empty(widest), np.empty(widest),
        np.empty(widest),
    )  # fmt: skip
    update = (
        np.empty((widest, d)), np.empty((widest, d)), np.empty((widest, d)), np.empty((widest, widest)),
        np.empty((widest, widest)), np.empty((widest, widest)), np.empty((d, max(widest, d))), np.empty(d),
    )  # fmt: skip
    work = (np.empty((d, d)), np.empty((d, d)))
    log_likelihood = 0.0
    for node in range(nodes):
        phi[:, :] = 0.0
        for i in range(d):
            phi[i, i] = 1.0
        if not predict(model, plan, node, x, p, phi, weights, keep, sigma, work):
            out.mean[node] = x
            out.cov[node] = p
            return log_likelihood, -2 - node
        if keep != 0:
            out.predicted_mean[node] = x
            out.predicted_cov[node] = p
            out.transition[node] = phi
        for reading in range(plan.reading_ptr[node], plan.reading_ptr[node + 1]):
            gained = absorb(model, plan, reading, x, p, weights, sigma, seen, update, work, out)
            if math.isnan(gained):
                out.mean[node] = x
                out.cov[node] = p
                return log_likelihood, reading
            log_likelihood += gained
        out.mean[node] = x
        out.cov[node] = p
    return log_likelihood, -1
