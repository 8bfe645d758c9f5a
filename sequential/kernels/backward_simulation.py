"""Trajectories drawn backwards through the particles of a filter (Godsill, Doucet, West 2004)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from sequential.kernels.arrays import f2, f3, i0, w2, w3
from sequential.kernels.call import bare
from sequential.kernels.charts import local
from sequential.kernels.matrices import cholesky, copy_matrix, copy_vector, fill_diagonal
from sequential.kernels.mixing import moments_of, normalise
from sequential.kernels.moving import predict
from sequential.kernels.records import MODEL, SCHEDULE
from sequential.kernels.resampling import find

__all__ = ["draw_backwards", "summarise"]


@bare
def arrive(model, plan, node, states, belief, arrived, factors, logs, scratch):
    """Where every particle leads on the way to a node, with the factor of the noise; False if singular."""
    n, d = model.n, model.d
    x, p = belief[:n], belief[n:].reshape((d, d))
    phi, lower, _, _, moving = scratch
    for i in range(len(states)):
        copy_vector(states[i], x)
        fill_diagonal(p, 0.0)
        predict(model, plan, node, belief, x, p, phi, 0, moving)
        copy_vector(x, arrived[i])
        if cholesky(p, lower, d, False) > 0:
            return False
        copy_matrix(lower, factors[i])
        logs[i] = 0.0
        for a in range(d):
            logs[i] -= math.log(lower[a, a])
    return True


@bare
def link(model, arrived, factors, logs, ahead, ahead_at, weights, sums, scratch):
    """Running sums (P,) of the chance that a particle led to a state of the next node."""
    n, d, flat, best = model.n, model.d, arrived.reshape(-1), -math.inf
    _, _, e, chance, _ = scratch
    for i in range(len(weights)):
        chance[i] = -math.inf
        if not weights[i] > 0.0:
            continue
        local(model.table, 0, len(model.table), flat, i * n, ahead, ahead_at, e, 0)
        chance[i] = math.log(weights[i]) + logs[i]
        for a in range(d):
            s = e[a]
            for b in range(a):
                s -= factors[i, a, b] * e[b]
            e[a] = s / factors[i, a, a]
            chance[i] -= 0.5 * e[a] * e[a]
        best = max(best, chance[i])
    for i in range(len(weights)):
        chance[i] = math.exp(chance[i] - best)
    normalise(chance)
    total = 0.0
    for i in range(len(weights)):
        total += chance[i]
        sums[i] = total


@bare
def draw_nodes(model, plan, states, weights, uniforms, out, belief, arrived, factors, logs, sums, scratch):
    """The loop of `draw_backwards`, with every array at hand."""
    nodes, count, n = len(states), out.shape[1], model.n
    flat = out.reshape(-1)
    for node in range(nodes - 1, -1, -1):
        if node == nodes - 1:
            total = 0.0
            for i in range(len(sums)):
                total += weights[node, i]
                sums[i] = total
        elif not arrive(model, plan, node + 1, states[node], belief, arrived, factors, logs, scratch):
            return node + 1
        for t in range(count):
            if node < nodes - 1:
                at = ((node + 1) * count + t) * n
                link(model, arrived, factors, logs, flat, at, weights[node], sums, scratch)
            chosen = find(sums, uniforms[node, t] * sums[len(sums) - 1])
            copy_vector(states[node, chosen], out[node, t])
    return -1


@njit(i0(MODEL, SCHEDULE, f3, f2, f2, w3), cache=True, error_model="numpy")
def draw_backwards(model, plan, states, weights, uniforms, out):
    """Draw trajectories `out` (K, T, n) from particles (K, P, n) with weights (K, P) and uniforms (K, T).

    Returns -1, or the node on the way to which the process noise was singular.
    """
    n, d, count = model.n, model.d, states.shape[1]
    moving = (np.empty((d, d)), np.empty((d, d)), np.empty(n), np.empty((d, d)))
    scratch = (np.empty((d, d)), np.empty((d, d)), np.empty(d), np.empty(count), moving)
    return draw_nodes(
        model, plan, states, weights, uniforms, out, np.empty(n + d * d), np.empty((count, n)),
        np.empty((count, d, d)), np.empty(count), np.empty(count), scratch,
    )  # fmt: skip


@njit(types.void(MODEL, f3, f2, w2, w3), cache=True, error_model="numpy")
def summarise(model, states, weights, mean, cov):
    """Mean (K, n) and covariance (K, d, d) of clouds (K, P, n) with weights (K, P)."""
    e, move, blocks = np.empty(model.d), np.empty(model.d), len(model.table)
    for node in range(len(states)):
        moments_of(
            model.table, 0, blocks, model.n, model.d, states[node], weights[node], mean[node], cov[node], e,
            move,
        )  # fmt: skip
