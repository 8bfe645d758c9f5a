"""Compiled: the filter whose way back is the smoother, about its own estimate or about a trajectory."""

from __future__ import annotations

import numpy as np
from numba import njit, types

from sequential.attitude.smoother_nodes_kernel import FIELD_TIME, RATE, TIME, compiled, f0, f1, f2, w1, w2
from sequential.attitude.smoother_steps_kernel import (
    BIAS,
    DELAY,
    EAST,
    GATE,
    MAG,
    MATRIX,
    MEMORY,
    PULL,
    SIZE,
    SPREAD,
    STILL_RATE,
    STILL_SPEED,
    UPRIGHT,
    VELOCITY,
    difference,
    heading_row,
    retract,
    step,
    step_noise,
)

__all__ = ["forward"]

f3 = types.Array(types.float64, 3, "C", readonly=True)
b1 = types.Array(types.boolean, 1, "C", readonly=True)
w3, c1 = types.float64[:, :, ::1], types.boolean[::1]


@njit(types.void(w2, w1, f0, f0, w1, types.int64), **compiled)
def absorb(cov, xi, e, variance, out, i):
    """Take in a reading of state i alone; `out` gets gain (23), weighted innovation and precision.

    `e` is the innovation before the deviation `xi` is taken off.
    """
    s = cov[i, i] + variance
    e -= xi[i]
    for j in range(SIZE):
        out[j] = cov[i, j] / s
        xi[j] += out[j] * e
    for a in range(SIZE):
        scale = out[a] * s
        for b in range(SIZE):
            cov[a, b] -= scale * out[b]
    out[SIZE], out[SIZE + 1] = e / s, 1.0 / s


@njit(f0(w2, w1, f0, f0, f1, w1, w1, f0), **compiled)
def absorb_field(cov, xi, e, variance, row, work, out, gate):
    """Take in a reading of the field's heading; beyond `gate` sigmas its variance grows.

    Returns the weight that this left it.
    """
    for j in range(SIZE):
        work[j] = cov[0, j] * row[0] + cov[1, j] * row[1] + cov[2, j] * row[2]
        work[j] += cov[EAST, j] * row[3] + cov[DELAY, j] * row[4]
    s = work[EAST] * row[3] + work[DELAY] * row[4]
    e -= row[3] * xi[EAST] + row[4] * xi[DELAY]
    for i in range(3):
        s += work[i] * row[i]
        e -= row[i] * xi[i]
    weight, distance = 1.0, e * e / (s + variance)
    if distance > gate * gate:
        weight = gate * gate / distance
        variance /= weight
    s += variance
    for j in range(SIZE):
        out[j] = work[j] / s
        xi[j] += out[j] * e
    for a in range(SIZE):
        gain = out[a]
        for b in range(SIZE):
            cov[a, b] -= gain * work[b]
    out[SIZE], out[SIZE + 1] = e / s, 1.0 / s
    return weight


@njit(types.void(w2, f2, f2, f0), **compiled)
def spread(cov, by_gyro, by_push, memory):
    """cov ← F cov Fᵀ; velocity before the rotation that it reads, the other triangle is copied."""
    for i in range(3):
        v = cov[VELOCITY + i]
        for m in range(3):
            a, b = by_push[i, m], by_push[i, 3 + m]
            for j in range(SIZE):
                v[j] += a * cov[m, j] + b * cov[PULL + m, j]
    for i in range(3):
        for m in range(12):
            a, row = by_gyro[i, m], cov[BIAS + m if m < 3 else MATRIX + m - 3]
            for j in range(SIZE):
                cov[i, j] += a * row[j]
    for j in range(SIZE):
        cov[EAST, j] *= memory
    for c in range(7):
        j = c if c < 3 else VELOCITY + c - 3
        row = cov[j]
        for i in range(3):
            for m in range(3):
                row[VELOCITY + i] += by_push[i, m] * row[m] + by_push[i, 3 + m] * row[PULL + m]
        for i in range(3):
            for m in range(3):
                row[i] += by_gyro[i, m] * row[BIAS + m]
            for m in range(9):
                row[i] += by_gyro[i, 3 + m] * row[MATRIX + m]
        row[EAST] *= memory
    for j in range(SIZE):
        if 3 <= j < VELOCITY or j > EAST:
            for c in range(3):
                cov[j, c], cov[j, VELOCITY + c] = cov[c, j], cov[VELOCITY + c, j]
            cov[j, EAST] = cov[EAST, j]


@njit(types.void(w1, f2, f2, f0), **compiled)
def carry(xi, by_gyro, by_push, memory):
    """xi ← F xi."""
    for i in range(3):
        for m in range(3):
            xi[VELOCITY + i] += by_push[i, m] * xi[m] + by_push[i, 3 + m] * xi[PULL + m]
    for i in range(3):
        for m in range(3):
            xi[i] += by_gyro[i, m] * xi[BIAS + m]
        for m in range(9):
            xi[i] += by_gyro[i, 3 + m] * xi[MATRIX + m]
    xi[EAST] *= memory


@njit(
    types.void(
        f2, b1, f1, f3, f1, f2, f1, f2, types.boolean, types.boolean, w3, w2, w2, w3, w3, w3, w3, w2, w1
    ),
    **compiled,
)
def forward(
    nodes, rest, weight, fresh, p, start_r, start_x, start_cov, field, around,
    rotation, state, deviation, cov, gains, by_gyro, by_push, rows, trust,
):  # fmt: skip
    """Filter K nodes into K + 1 states.

    Parameters
    ----------
    nodes : (K, WIDTH) of `summarise`; `rest` (K,); `weight` (K,) of the field's readings, 0 leaves one out
    fresh : (K, 3, 3) rotation at the end of nodes whose gap leaves it unknown, to begin with anew; else NaN
    p : settings, as in `smoother_steps_kernel`
    start_r, start_x, start_cov : prior mean and covariance (23, 23) of the first state
    field : whether the magnetometer takes part
    around : linearise about `rotation`, `state` as given; else about the filter's own estimate, written there
    rotation, state : (K + 1, 3, 3), (K + 1, 23)
    deviation, cov : (K + 1, 23), (K + 1, 23, 23) filtered deviation from `rotation`, `state`, its covariance
    gains : (K, 7, 25) gain (23), weighted innovation and precision of each scalar reading
    by_gyro, by_push, rows : (K, 3, 12), (K, 3, 6), (K, 5) the steps and the rows of the field
    trust : (K,) weight that the gate gave to each reading of the field
    """
    count = len(nodes)
    pk, xi = np.empty((SIZE, SIZE)), np.zeros(SIZE)
    work, moved, next_x, next_r = np.empty(SIZE), np.empty(3), np.empty(SIZE), np.empty((3, 3))
    pk[:, :] = start_cov
    if around:
        difference(start_r, rotation[0], moved)
        for i in range(SIZE):
            xi[i] = start_x[i] - state[0, i] if i >= 3 else moved[i]
    else:
        rotation[0], state[0] = start_r, start_x
    for k in range(count):
        n, g, x, r = nodes[k], gains[k], state[k], rotation[k]
        g[:, :] = 0.0
        speed = (p[STILL_SPEED] if rest[k] else p[SPREAD]) ** 2 / n[TIME]
        for i in range(0 if rest[k] else 3, 6):
            if i < 3:
                at, seen, variance = BIAS + i, n[RATE + i], p[STILL_RATE] ** 2 / n[TIME]
            else:
                at, seen = VELOCITY + i - 3, 0.0
                variance = speed if i < 5 else (UPRIGHT * p[SPREAD]) ** 2 / n[TIME]
            absorb(pk, xi, seen - x[at], variance, g[i], at)
        trust[k] = 1.0
        if field and weight[k] > 0.0 and n[FIELD_TIME] > 0.0:
            e = heading_row(n, r, x, rows[k])
            variance = p[MAG] ** 2 / n[FIELD_TIME] / weight[k]
            trust[k] = absorb_field(pk, xi, e, variance, rows[k], work, g[6], np.inf if around else p[GATE])
        if not around:
            retract(r, xi[0], xi[1], xi[2])
            for i in range(3, SIZE):
                x[i] += xi[i]
            xi[:] = 0.0
        deviation[k], cov[k] = xi, pk
        step(n, rest[k], r, x, p, next_r, next_x, by_gyro[k], by_push[k])
        turn, walk, push, disturbed = step_noise(n, rest[k], p)
        memory = np.exp(-n[TIME] / p[MEMORY])
        spread(pk, by_gyro[k], by_push[k], memory)
        for i in range(3):
            pk[i, i] += turn
            pk[BIAS + i, BIAS + i] += walk
            pk[VELOCITY + i, VELOCITY + i] += push
        pk[EAST, EAST] += disturbed
        if around:
            carry(xi, by_gyro[k], by_push[k], memory)
            difference(next_r, rotation[k + 1], moved)
            for i in range(3):
                xi[i] += moved[i]
            for i in range(3, SIZE):
                xi[i] += next_x[i] - state[k + 1, i]
        else:
            rotation[k + 1], state[k + 1] = next_r, next_x
            if fresh[k, 0, 0] == fresh[k, 0, 0]:
                rotation[k + 1] = fresh[k]
    deviation[count], cov[count] = xi, pk
