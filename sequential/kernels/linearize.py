"""The whole chain linearised at a trajectory, as whitened rows: what a sparse least-squares solver eats.

Unknowns are tangent steps δ_k of the moving directions at each node and one step σ of the static ones.
Rows of node k read  before δ_{k-1} + here δ_k + fixed σ = right.  Node 0 holds the prior.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit, types

from sequential.kernels.arrays import f1, f2, i1
from sequential.kernels.call import bare, inlined
from sequential.kernels.matrices import cholesky, solve_lower
from sequential.kernels.moving import linearise_move, linearise_prior
from sequential.kernels.records import MODEL, SCHEDULE
from sequential.kernels.sensing import loss_weight, measure, scratch_size, sensor_jacobian

__all__ = ["ROWS", "Rows", "linearise_chain"]

CAUCHY = 2


class Rows(NamedTuple):
    """Whitened rows, node after node (`first[k]` is where node k begins)."""

    first: Any  # (K+1,)
    before: Any  # (rows, moving)
    here: Any  # (rows, moving)
    fixed: Any  # (rows, max(1, static))
    right: Any  # (rows,)


_f1, _f2, _f3 = types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1]
ROWS = types.NamedTuple([i1, _f2, _f2, _f2, _f1], Rows)
RESULT = types.Tuple([types.float64, types.int64])


@bare
def loss_cost(kind, k, squared):
    """Half the squared norm, or what a robust loss makes of it."""
    if kind == 0:
        return 0.5 * squared
    if kind == CAUCHY:
        return 0.5 * k * k * math.log1p(squared / (k * k))
    r = math.sqrt(squared)
    return 0.5 * squared if r <= k else k * (r - 0.5 * k)


@inlined
def write_reading(model, plan, reading, states, at, row, moving, static, update, rows):
    """Whitened rows of one reading; returns its cost."""
    s = plan.sensor[reading]
    m = model.z_dim[s]
    h, flat, lower, expected, residual, white = update
    measure(model, plan, reading, states, at, expected, residual)
    sensor_jacobian(model, plan, reading, states, at, expected, flat, h)
    cholesky(plan.noise_cov[plan.noise_row[reading]], lower, m, False)
    solve_lower(lower, h, m, model.d)
    for i in range(m):
        white[i, 0] = residual[i]
    solve_lower(lower, white, m, 1)
    squared = 0.0
    for i in range(m):
        squared += white[i, 0] * white[i, 0]
    root = math.sqrt(loss_weight(model.loss[s], model.loss_k[s], squared))
    for i in range(m):
        for j in range(len(moving)):
            rows.before[row + i, j] = 0.0
            rows.here[row + i, j] = root * h[i, moving[j]]
        for j in range(len(static)):
            rows.fixed[row + i, j] = root * h[i, static[j]]
        rows.right[row + i] = root * white[i, 0]
    return loss_cost(model.loss[s], model.loss_k[s], squared)


@bare
def write_motion(phi, q, e, inverse, row, moving, static, lower, block, square, rows):
    """Whitened rows of one move δ_k = Φ δ_{k-1} - J⁻¹ e + w; returns its cost, negative if Q is singular."""
    p, d = len(moving), len(e)
    width = 2 * p + len(static) + 1
    for i in range(p):
        for j in range(p):
            square[i, j] = q[moving[i], moving[j]]
    if cholesky(square, lower, p, False) > 0:
        return -1.0
    for i in range(p):
        a = moving[i]
        for j in range(p):
            block[i, j] = -phi[a, moving[j]]
            block[i, p + j] = 1.0 if i == j else 0.0
        for j in range(len(static)):
            block[i, 2 * p + j] = -phi[a, static[j]]
        s = 0.0
        for k in range(d):
            s -= inverse[a, k] * e[k]
        block[i, width - 1] = s
    solve_lower(lower, block, p, width)
    cost = 0.0
    for i in range(p):
        for j in range(p):
            rows.before[row + i, j] = block[i, j]
            rows.here[row + i, j] = block[i, p + j]
        for j in range(len(static)):
            rows.fixed[row + i, j] = block[i, 2 * p + j]
        rows.right[row + i] = block[i, width - 1]
        cost += 0.5 * block[i, width - 1] ** 2
    return cost


@bare
def write_prior(cov, e, inverse, moving, static, lower, block, rows):
    """Whitened rows of the prior, all directions; returns its cost."""
    d, p = len(e), len(moving)
    cholesky(cov, lower, d, False)
    for i in range(d):
        for j in range(d):
            block[i, j] = 1.0 if i == j else 0.0
        s = 0.0
        for k in range(d):
            s -= inverse[i, k] * e[k]
        block[i, d] = s
    solve_lower(lower, block, d, d + 1)
    cost = 0.0
    for i in range(d):
        for j in range(p):
            rows.before[i, j] = 0.0
            rows.here[i, j] = block[i, moving[j]]
        for j in range(len(static)):
            rows.fixed[i, j] = block[i, static[j]]
        rows.right[i] = block[i, d]
        cost += 0.5 * block[i, d] ** 2
    return cost


@bare
def linearise_nodes(
    model,
    plan,
    prior,
    trajectory,
    states,
    moving,
    static,
    belief,
    x,
    q,
    frames,
    e,
    work,
    update,
    rows,
):
    """The loop of `linearise_chain`, with every array at hand."""
    n, d = model.n, model.d
    phi, turn, inverse, lower, block = frames
    cost = 0.0
    for node in range(len(plan.reading_ptr) - 1):
        row = rows.first[node]
        if node == 0:
            linearise_prior(model, prior, states, x, q, e, turn, inverse, work)
            cost += write_prior(q, e, inverse, moving, static, lower, block, rows)
            row += d
        else:
            linearise_move(model, plan, node, trajectory, states, belief, x, q, phi, e, turn, inverse, work)
            moved = write_motion(phi, q, e, inverse, row, moving, static, lower, block, work[1], rows)
            if moved < 0.0:
                return cost, node
            cost += moved
            row += len(moving)
        for reading in range(plan.reading_ptr[node], plan.reading_ptr[node + 1]):
            cost += write_reading(model, plan, reading, states, node * n, row, moving, static, update, rows)
            row += model.z_dim[plan.sensor[reading]]
    return cost, -1


@njit(RESULT(MODEL, SCHEDULE, f1, f2, f2, i1, i1, ROWS), cache=True, error_model="numpy")
def linearise_chain(model, plan, prior_mean, prior_cov, trajectory, moving, static, rows):
    """Fill `rows`; returns (cost, -1 or the node whose process noise is singular)."""
    n, d, widest = model.n, model.d, plan.z.shape[1]
    belief = np.empty(n + d * d)
    x, q = belief[:n], belief[n:].reshape((d, d))
    frames = (
        np.empty((d, d)),
        np.empty((d, d)),
        np.empty((d, d)),
        np.empty((d, d)),
        np.empty((d, 2 * d + 1)),
    )
    work = (np.empty((d, d)), np.empty((d, d)), np.empty(n), np.empty((d, d)))
    flat = np.empty(scratch_size(n, d, widest))
    update = (
        np.empty((widest, d)), flat, np.zeros((widest, widest)), np.empty(widest),
        np.empty(widest), np.empty((widest, 1)),
    )  # fmt: skip
    states = trajectory.reshape(-1)
    return linearise_nodes(
        model, plan, (prior_mean, prior_cov), trajectory, states, moving, static, belief, x, q, frames,
        np.empty(d), work, update, rows,
    )  # fmt: skip
