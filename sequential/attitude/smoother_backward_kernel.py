"""Compiled: the way back of the smoother, after Bryson and Frazier: no covariance is inverted.

With λ and Λ the score and the information that the future holds about a state, the smoothed deviation is
x + P λ and its covariance P - P Λ P; a reading with row h, gain K, innovation e and variance s takes them
from after to before itself by λ ← λ - h (Kᵀ λ - e/s), Λ ← (I - K h)ᵀ Λ (I - K h) + hᵀ h/s, and a step F by
λ ← Fᵀ λ, Λ ← Fᵀ Λ F.  Bierman 1973, Fixed interval smoothing with discrete measurements.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from sequential.attitude.smoother_forward_kernel import b1, f3, w3
from sequential.attitude.smoother_nodes_kernel import TIME, compiled, f0, f1, f2, w1, w2
from sequential.attitude.smoother_steps_kernel import (
    BIAS,
    EAST,
    MATRIX,
    MEMORY,
    PULL,
    SIZE,
    VELOCITY,
    retract,
)

__all__ = ["backward"]


@njit(f0(w2, f1, w1), **compiled)
def weigh(info, gain, work):
    """work ← Λ K; returns Kᵀ Λ K + 1/s."""
    work[:] = 0.0
    for j in range(SIZE):
        k = gain[j]
        for a in range(SIZE):
            work[a] += info[j, a] * k
    inner = gain[SIZE + 1]
    for a in range(SIZE):
        inner += gain[a] * work[a]
    return inner


@njit(types.void(w1, w2, f1, f1, types.boolean, w1), **compiled)
def before_field(score, info, row, gain, wanted, work):
    """Take λ, Λ back over a reading of the field."""
    push = gain[SIZE]
    for j in range(SIZE):
        push -= gain[j] * score[j]
    for a in range(5):
        score[a if a < 3 else EAST + a - 3] += row[a] * push
    if not wanted:
        return
    inner = weigh(info, gain, work)
    for a in range(5):
        i = a if a < 3 else EAST + a - 3
        for j in range(SIZE):
            info[i, j] -= row[a] * work[j]
        for j in range(SIZE):
            info[j, i] -= row[a] * work[j]
    for a in range(5):
        i = a if a < 3 else EAST + a - 3
        for b in range(5):
            info[i, b if b < 3 else EAST + b - 3] += row[a] * row[b] * inner


@njit(types.void(w1, w2, types.int64, f1, types.boolean, w1), **compiled)
def before_single(score, info, i, gain, wanted, work):
    """Take λ, Λ back over a reading of state i alone."""
    push = gain[SIZE]
    for j in range(SIZE):
        push -= gain[j] * score[j]
    score[i] += push
    if not wanted:
        return
    inner = weigh(info, gain, work)
    for j in range(SIZE):
        info[i, j] -= work[j]
    for j in range(SIZE):
        info[j, i] -= work[j]
    info[i, i] += inner


@njit(types.void(w1, f2, f2, f0), **compiled)
def before_step(score, by_gyro, by_push, memory):
    """λ ← Fᵀ λ."""
    for m in range(12):
        for i in range(3):
            score[BIAS + m if m < 3 else MATRIX + m - 3] += by_gyro[i, m] * score[i]
    for m in range(6):
        for i in range(3):
            score[m if m < 3 else PULL + m - 3] += by_push[i, m] * score[VELOCITY + i]
    score[EAST] *= memory


@njit(types.void(w2, f2, f2, f0), **compiled)
def before_step_both(info, by_gyro, by_push, memory):
    """Λ ← Fᵀ Λ F: on the left by whole rows, on the right row by row."""
    for m in range(12):
        at = BIAS + m if m < 3 else MATRIX + m - 3
        for i in range(3):
            a = by_gyro[i, m]
            for j in range(SIZE):
                info[at, j] += a * info[i, j]
    for m in range(6):
        at = m if m < 3 else PULL + m - 3
        for i in range(3):
            a = by_push[i, m]
            for j in range(SIZE):
                info[at, j] += a * info[VELOCITY + i, j]
    for j in range(SIZE):
        info[EAST, j] *= memory
    for j in range(SIZE):
        before_step(info[j], by_gyro, by_push, memory)


@njit(types.void(f2, b1, f1, f3, f3, f3, f2, types.boolean, w3, w2, w2, f3, w3, w2), **compiled)
def backward(
    nodes, rest, p, gains, by_gyro, by_push, rows, wanted, rotation, state, deviation, cov, smoothed, end
):  # fmt: skip
    """Smooth in place: `rotation` (K + 1, 3, 3) and `state` (K + 1, 23) move to the smoothed estimate.

    `deviation` becomes the smoothed one; if `wanted`, `smoothed` (K + 1, 6, 6) gets the covariance of
    rotation and bias, and `end` (23, 23) the one of the first state.
    """
    count = len(nodes)
    score, info, work = np.zeros(SIZE), np.zeros((SIZE, SIZE)), np.empty(SIZE)
    wide = np.empty((SIZE, SIZE))
    for k in range(count, -1, -1):
        c = cov[k]
        if k < count:
            memory = np.exp(-nodes[k, TIME] / p[MEMORY])
            before_step(score, by_gyro[k], by_push[k], memory)
            if wanted:
                before_step_both(info, by_gyro[k], by_push[k], memory)
        for i in range(SIZE):
            total = 0.0
            for j in range(SIZE):
                total += c[i, j] * score[j]
            deviation[k, i] += total
        if wanted:
            high = SIZE if k == 0 else 6
            for i in range(high):
                wide[i, :] = 0.0
                for m in range(SIZE):
                    for j in range(SIZE):
                        wide[i, j] += c[i, m] * info[m, j]
            for i in range(high):
                for j in range(i + 1):
                    total = c[i, j]
                    for m in range(SIZE):
                        total -= wide[i, m] * c[j, m]
                    if i < 6:
                        smoothed[k, i, j] = smoothed[k, j, i] = total
                    if k == 0:
                        end[i, j] = end[j, i] = total
        retract(rotation[k], deviation[k, 0], deviation[k, 1], deviation[k, 2])
        for i in range(3, SIZE):
            state[k, i] += deviation[k, i]
        if k < count:
            # the readings of a node come before its filtered state
            if gains[k, 6, SIZE + 1] > 0.0:
                before_field(score, info, rows[k], gains[k, 6], wanted, work)
            for i in range(5, -1, -1):
                if gains[k, i, SIZE + 1] > 0.0:
                    at = VELOCITY + i - 3 if i >= 3 else BIAS + i
                    before_single(score, info, at, gains[k, i], wanted, work)
