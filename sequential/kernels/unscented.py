"""The unscented Kalman filter over a whole log: sigma points on any product manifold.

Both halves of the filter are statistical linear regressions (Lefebvre, Bruyninckx, De Schutter 2002): with
P = L Lᵀ and unit points u, y ≈ A x + b + e, where A = D L⁻¹, D = Σ w (y - ȳ) uᵀ and e has the covariance
Ω = Σ w (y - ȳ - D u)(…)ᵀ.  So S = D Dᵀ + Ω + R, P Aᵀ = L Dᵀ, and Joseph's form of the update is
(L - K D)(L - K D)ᵀ + K (Ω + R) Kᵀ, which no rounding makes indefinite; A is what a smoother needs, and an
update that is made again in UD form where S is nearly singular.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from sequential.kernels.arrays import f1, f2
from sequential.kernels.belief import LOG_TWO_PI, admit, tallied
from sequential.kernels.bierman import BIERMAN_VECTORS
from sequential.kernels.call import call, inlined
from sequential.kernels.matrices import copy_matrix, copy_vector, fill_diagonal, multiply
from sequential.kernels.records import FILTERED, FINISHED, MODEL, SCHEDULE
from sequential.kernels.regressed import correct, gain_of, redo
from sequential.kernels.sensing import loss_weight
from sequential.kernels.sigma_points import (
    factor,
    mean_of,
    place,
    project,
    second_moment,
    shift,
    slope,
    tangent_to,
    unexplained,
)
from sequential.kernels.sizes import ANY_SIZE, reading_dim, reading_size, sized

__all__ = ["filter_sigma_points"]


@inlined
def predict(model, plan, node, x, p, phi, count, weights, unit, keep, sigma, work):
    """Carry mean, covariance and (with `keep`) phi along the steps to a node; False where P is indefinite."""
    points, moved, tangents, steps, lower, move, before, after = sigma
    n, d, blocks, width = model.n, model.d, len(model.table), plan.inputs.shape[1]
    for s in range(plan.step_ptr[node], plan.step_ptr[node + 1]):
        u, dt = plan.step_input[s] * width, plan.step_dt[s]
        if not factor(p, d, lower):
            return False
        place(model.flat, model.table, n, d, count, x, lower, weights, unit, steps, points, before)
        if model.step_points != 0:
            call(model.step_points, before, 0, plan.inputs, u, dt, model.params, 0, after, 0)
        else:
            for i in range(count + 1):
                call(model.step, before, i * n, plan.inputs, u, dt, model.params, 0, after, i * n)
        mean_of(
            model.flat, model.table, 0, blocks, n, d, count, moved, weights, x, tangents, move, after
        )  # fmt: skip
        second_moment(tangents, weights, count, d, p)
        call(model.noise, before, 0, plan.inputs, u, dt, model.params, 0, p, 0)
        if keep != 0:
            project(tangents, weights, unit, d, d, work[0])
            slope(work[0], lower, d, d, work[1])
            multiply(work[1], phi, work[0], d, d, d)
            copy_matrix(work[0], phi)
    return True


@inlined
def look(model, plan, reading, x, p, count, weights, unit, sigma, seen):
    """Regress a reading on the state: residual, D (m, d), D Dᵀ + Ω and Ω; False where P is indefinite."""
    points, _, _, steps, lower, _, before, _ = sigma
    images, tangents, expected, residual, move, projected, moment, rest, after = seen
    s = plan.sensor[reading]
    m, n, d = reading_dim(model, s), model.n, model.d
    width, wide = plan.context.shape[1], images.shape[1]
    first, last, at = model.z_first[s], model.z_first[s + 1], model.sensor_params_at[s]
    if not factor(p, d, lower):
        return False
    place(model.flat, model.table, n, d, count, x, lower, weights, unit, steps, points, before)
    context, params = reading * width, model.sensor_params
    if model.observe_points[s] != 0:
        call(model.observe_points[s], before, 0, plan.context, context, 0.0, params, at, after, 0)
    else:
        for i in range(count + 1):
            call(
                model.observe[s], before, i * n, plan.context, context, 0.0, params, at, after, i * wide
            )  # fmt: skip
    flat, size = model.z_flat[s], reading_size(model, s, m)
    mean_of(
        flat, model.z_table, first, last, size, m, count, images, weights, expected, tangents, move, after
    )  # fmt: skip
    tangent_to(
        flat, model.z_table, first, last, m, expected, plan.z_flat, reading * plan.z.shape[1], residual
    )  # fmt: skip
    if plan.rows[reading] < m:
        for a in range(m):
            if math.isnan(plan.z[reading, a]):
                residual[a] = 0.0
                for i in range(count + 1):
                    tangents[i, a] = 0.0
    project(tangents, weights, unit, d, m, projected)
    unexplained(tangents, weights, unit, d, m, projected, rest)
    for a in range(m):
        for b in range(a + 1):
            total = rest[a, b]
            for j in range(d):
                total += projected[a, j] * projected[b, j]
            moment[a, b] = total
            moment[b, a] = total
    return True


@inlined
def absorb(model, plan, reading, x, p, count, weights, unit, sigma, seen, update, out):
    """Update by one reading; (a, b) where its log likelihood is a - ½ log b.

    That is (0, 1) if it was gated; a is NaN if S or P is indefinite.
    """
    gain, innovation_cov, factored, white, left, scaled, delta, doubt = update
    lower, residual, projected, moment, rest = sigma[4], seen[3], seen[5], seen[6], seen[7]
    s, given = plan.sensor[reading], plan.noise_cov[plan.noise_row[reading]]
    m, d, rows = reading_dim(model, s), model.d, plan.rows[reading]
    if not look(model, plan, reading, x, p, count, weights, unit, sigma, seen):
        return math.nan, 1.0
    nis, log_det, determinant = gain_of(
        moment, given, 1.0, lower, projected, residual, m, d, innovation_cov, factored, gain, white
    )
    redone = nis < 0.0
    if redone:
        determinant = 1.0
        nis, log_det = redo(p, lower, projected, rest, given, 1.0, residual, m, d, left, delta, doubt)
    verdict = admit(model, plan, reading, nis, residual, innovation_cov, out)
    if verdict < 1:
        return math.nan if verdict < 0 else 0.0, 1.0
    share = 1.0
    if model.loss[s] != 0:
        share = 1.0 / loss_weight(model.loss[s], model.loss_k[s], nis / rows)
    if share > 1.0 and redone:
        redo(p, lower, projected, rest, given, share, residual, m, d, left, delta, doubt)
    elif share > 1.0:
        gain_of(moment, given, share, lower, projected, residual, m, d, innovation_cov, factored, gain, white)
    if redone:
        copy_matrix(left, p)
    else:
        correct(p, lower, projected, rest, given, share, gain, residual, m, d, left, scaled, delta)
    shift(model.flat, model.table, 0, len(model.table), model.n, x, delta)
    return -0.5 * (nis + log_det + rows * LOG_TWO_PI), determinant


@inlined
def filter_nodes(model, plan, x, p, phi, count, weights, unit, keep, sigma, seen, update, work, out):
    """The loop of `filter_sigma_points`, with every array at hand."""
    log_likelihood, logarithm, product = 0.0, 0.0, 1.0
    for node in range(len(plan.reading_ptr) - 1):
        failed = -1
        if keep != 0:
            fill_diagonal(phi, 1.0)
        if not predict(model, plan, node, x, p, phi, count, weights, unit, keep, sigma, work):
            failed = -2 - node
        if keep != 0:
            copy_vector(x, out.predicted_mean[node])
            copy_matrix(p, out.predicted_cov[node])
            copy_matrix(phi, out.transition[node])
        for reading in range(plan.reading_ptr[node], plan.reading_ptr[node + 1]):
            if failed != -1:
                break
            gained, share = absorb(
                model, plan, reading, x, p, count, weights, unit, sigma, seen, update, out
            )  # fmt: skip
            if math.isnan(gained):
                failed = reading
            log_likelihood += gained
            logarithm, product = tallied(logarithm, product * share)
        copy_vector(x, out.mean[node])
        copy_matrix(p, out.cov[node])
        if failed != -1:
            return log_likelihood, failed
    return log_likelihood - 0.5 * (logarithm + math.log(product)), -1


@njit(
    FINISHED(
        MODEL, SCHEDULE, f1, f2, f1, f2, types.int64, FILTERED, ANY_SIZE, ANY_SIZE, ANY_SIZE
    ),
    cache=True, error_model="numpy", nogil=True,
)  # fmt: skip
def filter_sigma_points(
    model, plan, prior_mean, prior_cov, weights, unit, keep, out, storage, tangent, reading
):  # fmt: skip
    """Run the filter with a set of points, see `sigma_points`.

    Returns (log likelihood, code): -1, or the reading at which S or P was not positive definite, or -2 - k
    where P was not on the way to node k.  The last three arguments are sizes, as in `kernels.sizes`.
    """
    n, d, widest = model.n, model.d, plan.z.shape[1]
    count = 2 * d if unit.shape[0] == 0 else unit.shape[0]
    points, moved, images = np.empty((count + 1, n)), np.empty((count + 1, n)), np.empty((count + 1, widest))
    sigma = (
        points, moved, np.empty((count + 1, d)), np.empty((count, d)), np.zeros((d, d)), np.empty(d),
        points.reshape(-1), moved.reshape(-1),
    )  # fmt: skip
    seen = (
        images, np.empty((count + 1, widest)), np.empty(widest), np.empty(widest), np.empty(widest),
        np.empty((widest, d)), np.empty((widest, widest)), np.empty((widest, widest)), images.reshape(-1),
    )  # fmt: skip
    update = (
        np.empty((widest, d)), np.empty((widest, widest)), np.empty((widest, widest)), np.empty(widest),
        np.empty((d, d)), np.empty((d, widest)), np.empty(d),
        (
            np.empty((widest, d)), np.empty((d, d)), np.empty((widest, d)), np.empty((widest, widest)),
            np.empty((BIERMAN_VECTORS, max(widest, d))), np.empty((widest, widest)),
        ),
    )  # fmt: skip
    work = (np.empty((d, d)), np.empty((d, d)))
    return filter_nodes(
        sized(model, storage, tangent, reading), plan, prior_mean.copy(), prior_cov.copy(), np.eye(d),
        count, weights, unit, keep, sigma, seen, update, work, out,
    )  # fmt: skip
