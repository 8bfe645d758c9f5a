"""One step and one update of a linear model, whose matrices are looked up once for each interval that occurs.

x' = F(dt) x + c(u, dt) and z = H x + h; matrices are kept as lists of what is not zero in their rows, since
most of a motion model is zero.
"""

from __future__ import annotations

import math

import numpy as np

from sequential.kernels.belief import LOG_TWO_PI, admit
from sequential.kernels.call import call, inlined, owning
from sequential.kernels.correcting import DOUBTFUL, doubt_scratch, redo
from sequential.kernels.matrices import copy_matrix, fill_diagonal, multiply
from sequential.kernels.rows import factor_innovation, gather_rows, project_rows, update_rows
from sequential.kernels.sensing import loss_weight

__all__ = ["absorb", "expect", "linear_scratch", "move"]


@inlined
def look_up_step(model, plan, s, d, unit, matrix, rows, noise, offset):
    """F as rows, Q and c of one step."""
    u, dt = plan.step_input[s] * plan.inputs.shape[1], plan.step_dt[s]
    for i in range(d):
        unit[i] = 0.0
    call(model.step, unit, 0, plan.inputs, u, dt, model.params, 0, offset, 0)
    if model.jacobian != 0:
        call(model.jacobian, unit, 0, plan.inputs, u, dt, model.params, 0, matrix, 0)
    else:
        for j in range(d):
            unit[j] = 1.0
            call(model.step, unit, 0, plan.inputs, u, dt, model.params, 0, noise, 0)
            unit[j] = 0.0
            for i in range(d):
                matrix[i, j] = noise[0, i] - offset[i]
    fill_diagonal(noise, 0.0)
    call(model.noise, unit, 0, plan.inputs, u, dt, model.params, 0, noise, 0)
    gather_rows(matrix, d, d, rows)


@inlined
def look_up_sensor(model, plan, reading, d, m, unit, flat, rows, matrix, offset):
    """H, also as rows, and h of the sensor of a reading; rows of missing components are zero."""
    s, c = plan.sensor[reading], reading * plan.context.shape[1]
    at = model.sensor_params_at[s]
    for i in range(d):
        unit[i] = 0.0
    call(model.observe[s], unit, 0, plan.context, c, 0.0, model.sensor_params, at, offset, 0)
    if model.observe_jacobian[s] != 0:
        call(model.observe_jacobian[s], unit, 0, plan.context, c, 0.0, model.sensor_params, at, flat, 0)
        for i in range(m):
            for j in range(d):
                matrix[i, j] = flat[i * d + j]
    else:
        for j in range(d):
            unit[j] = 1.0
            call(model.observe[s], unit, 0, plan.context, c, 0.0, model.sensor_params, at, flat, 0)
            unit[j] = 0.0
            for i in range(m):
                matrix[i, j] = flat[i] - offset[i]
    for i in range(m):
        if math.isnan(plan.z[reading, i]):
            for j in range(d):
                matrix[i, j] = 0.0
    gather_rows(matrix, m, d, rows)


@inlined
def expect(plan, reading, x, m, rows, offset, residual):
    """Residual of a reading, zero where a component is missing."""
    count, column, value = rows
    for i in range(m):
        s = plan.z[reading, i] - offset[i]
        for k in range(count[i]):
            s -= value[i, k] * x[column[i, k]]
        residual[i] = 0.0 if math.isnan(plan.z[reading, i]) else s


@inlined
def absorb(model, plan, reading, x, p, d, m, sights, constant, fresh, update, doubt, out):
    """Update the belief by one reading; returns its log likelihood, 0 if gated, NaN if S is indefinite."""
    s = plan.sensor[reading]
    rows, matrix, offset = (sights[0][s], sights[1][s], sights[2][s]), sights[3][s], sights[4][s]
    unit, flat, residual, white, projected, innovation_cov, lower, gain, spread, work, delta = update
    noise = plan.noise_cov[plan.noise_row[reading]]
    whole = plan.rows[reading] == m
    if fresh[s] == 0 or not whole:
        look_up_sensor(model, plan, reading, d, m, unit, flat, rows, matrix, offset)
        fresh[s] = constant[s] if whole else 0
    expect(plan, reading, x, m, rows, offset, residual)
    project_rows(rows, p, noise, 1.0, m, d, projected, innovation_cov)
    nis, log_det, least = factor_innovation(innovation_cov, residual, m, lower, white)
    doubtful = not least > DOUBTFUL
    if doubtful:
        nis, log_det = redo(p, matrix, noise, 1.0, residual, m, d, work, delta, doubt)
    verdict = admit(model, plan, reading, nis, residual, innovation_cov, out)
    if verdict < 1:
        return math.nan if verdict < 0 else 0.0
    log_likelihood = -0.5 * (nis + log_det + plan.rows[reading] * LOG_TWO_PI)
    weight = loss_weight(model.loss[s], model.loss_k[s], nis / plan.rows[reading])
    if weight < 1.0:
        project_rows(rows, p, noise, weight, m, d, projected, innovation_cov)
        least = factor_innovation(innovation_cov, residual, m, lower, white)[2]
        doubtful = doubtful or not least > DOUBTFUL
    if not doubtful:
        doubtful = not update_rows(
            rows, p, noise, weight, m, d, projected, lower, gain, spread, work, delta, white
        )
    if doubtful and redo(p, matrix, noise, weight, residual, m, d, work, delta, doubt)[0] < 0.0:
        return math.nan
    for i in range(d):
        x[i] += delta[i]
        for j in range(d):
            p[i, j] = work[i, j]
    return log_likelihood


@inlined
def move(model, plan, node, x, p, phi, d, driven, last, steps, work, keep):
    """Carry the belief (and phi with `keep`) along the steps that lead to a node."""
    unit, matrix, rows, noise, offset, after = steps
    for s in range(plan.step_ptr[node], plan.step_ptr[node + 1]):
        if plan.step_dt[s] != last[0] or (driven != 0 and plan.step_input[s] != last[1]):
            look_up_step(model, plan, s, d, unit, matrix, rows, noise, offset)
            last[0], last[1] = plan.step_dt[s], plan.step_input[s]
        count, column, value = rows
        for i in range(d):
            total = offset[i]
            for k in range(count[i]):
                total += value[i, k] * x[column[i, k]]
            after[i] = total
        for i in range(d):
            x[i] = after[i]
        project_rows(rows, p, noise, 1.0, d, d, work, p)
        if keep != 0:
            multiply(matrix, phi, work, d, d, d)
            copy_matrix(work, phi)


@owning
def linear_scratch(d, widest, sensors):
    """What `move` and `absorb` work in: (x, P), of a step, of the sensors, of an update, and two marks."""
    steps = (
        np.empty(d), np.empty((d, d)),
        (np.empty(d, dtype=np.int64), np.empty((d, d), dtype=np.int64), np.empty((d, d))),
        np.empty((d, d)), np.empty(d), np.empty(d),
    )  # fmt: skip
    sights = (
        np.empty((sensors, widest), dtype=np.int64), np.empty((sensors, widest, d), dtype=np.int64),
        np.empty((sensors, widest, d)), np.empty((sensors, widest, d)), np.empty((sensors, widest)),
    )  # fmt: skip
    update = (
        np.empty(d), np.empty(widest * d), np.empty(widest), np.empty(widest), np.empty((widest, d)),
        np.empty((widest, widest)), np.empty((widest, widest)), np.empty((widest, d)), np.empty((d, widest)),
        np.empty((d, d)), np.empty(d),
    )  # fmt: skip
    marks = np.zeros(sensors, dtype=np.int64), np.full(2, np.nan)
    return (np.empty(d), np.empty((d, d))), steps, sights, (update, doubt_scratch(d, widest)), marks
