"""A linear filter whose covariance has settled: only the mean moves on, by the gain that it settled at."""

from __future__ import annotations

import math

from sequential.kernels.belief import LOG_TWO_PI, admit
from sequential.kernels.call import inlined
from sequential.kernels.correcting import DOUBTFUL
from sequential.kernels.linear_steps import expect

__all__ = ["alike", "coast", "has_settled", "log_normaliser"]


@inlined
def alike(plan, node, last, constant):
    """Whether a node is reached and read as the one before it: one step as long, one reading of its kind."""
    step, reading = plan.step_ptr[node], plan.reading_ptr[node]
    if plan.step_ptr[node + 1] - step != 1 or plan.reading_ptr[node + 1] - reading != 1 or reading == 0:
        return False
    return (
        plan.step_dt[step] == last[0]
        and plan.sensor[reading] == plan.sensor[reading - 1]
        and plan.noise_row[reading] == plan.noise_row[reading - 1]
        and constant[plan.sensor[reading]] == 1
    )


@inlined
def has_settled(model, plan, node, p, before, d, m, freeze, innovation_cov, lower, accepted):
    """Whether P has changed by less than `freeze` of itself in a node that ended in a plain update."""
    reading = plan.reading_ptr[node + 1] - 1
    s = plan.sensor[reading]
    if accepted[reading] == 0 or plan.rows[reading] < m or model.loss[s] != 0:
        return False
    for i in range(m):
        if not DOUBTFUL * innovation_cov[i, i] * lower[i, i] * lower[i, i] < 1.0:
            return False
    for i in range(d):
        for j in range(i + 1):
            if not abs(p[i, j] - before[i, j]) <= freeze * math.sqrt(p[i, i] * p[j, j]):
                return False
    return True


@inlined
def log_normaliser(lower, m):
    """log det 2π S from its factor, whose diagonal holds inverses."""
    total = m * LOG_TWO_PI
    for i in range(m):
        total -= 2.0 * math.log(lower[i, i])
    return total


@inlined
def coast(model, plan, node, x, d, m, sights, steps, update, normaliser, out):
    """Move the mean to a node and correct it there; NaN, with x as it was, where the gate is shut."""
    count, column, value = steps[2]
    reading = plan.reading_ptr[node]
    s = plan.sensor[reading]
    rows, shift = (sights[0][s], sights[1][s], sights[2][s]), sights[4][s]
    residual, white, innovation_cov, lower, gain, after = (
        update[2], update[3], update[5], update[6], update[7], steps[5],
    )  # fmt: skip
    for i in range(d):
        total = steps[4][i]
        for k in range(count[i]):
            total += value[i, k] * x[column[i, k]]
        after[i] = total
    expect(plan, reading, after, m, rows, shift, residual)
    nis = 0.0
    for i in range(m):
        t = residual[i]
        for k in range(i):
            t -= lower[i, k] * white[k]
        white[i] = t * lower[i, i]
        nis += white[i] * white[i]
    if admit(model, plan, reading, nis, residual, innovation_cov, out) < 1:
        return math.nan
    for i in range(d):
        total = after[i]
        for a in range(m):
            total += gain[a, i] * residual[a]
        x[i] = total
    return -0.5 * (nis + normaliser)
