"""Compiled: the attitude smoother's chain as whitened rows, for a solver of sparse least squares."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from sequential.attitude.smoother_forward_kernel import b1, f3, w3
from sequential.attitude.smoother_nodes_kernel import FIELD_TIME, RATE, TIME, compiled, f1, f2, w2
from sequential.attitude.smoother_steps_kernel import (
    BIAS,
    DELAY,
    EAST,
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

__all__ = ["MOVING", "ROWS", "STATIC", "move", "whitened_rows"]

MOVING, STATIC, ROWS = (
    10,
    13,
    17,
)  # rows of a node: step from the node before (10), rest (3), speed (3), field


@njit(types.void(f2, b1, f1, f1, types.boolean, f3, f2, w3, w3, w3, w2), **compiled)
def whitened_rows(nodes, rest, weight, p, field, rotation, state, before, here, static, right):
    """Fill the rows of all nodes; of the first one only those of its readings.

    With δ the deviation of node k from `rotation`, `state` in its ten moving directions and s that of the
    constants: before δ(k-1) + here δ(k) + static s = right.  Shapes (K + 1, 17, 10), (K + 1, 17, 10),
    (K + 1, 17, 13), (K + 1, 17); rows without a reading are zero.
    """
    next_r, next_x, moved = np.empty((3, 3)), np.empty(SIZE), np.empty(3)
    by_gyro, by_push, row = np.empty((3, 12)), np.empty((3, 6)), np.empty(5)
    before[:], here[:], static[:], right[:] = 0.0, 0.0, 0.0, 0.0
    for k in range(len(nodes)):
        n, r, x = nodes[k], rotation[k], state[k]
        own, fixed, value = here[k], static[k], right[k]
        if rest[k]:
            scale = math.sqrt(n[TIME]) / p[STILL_RATE]
            for i in range(3):
                own[10 + i, BIAS + i], value[10 + i] = scale, scale * (n[RATE + i] - x[BIAS + i])
        scale = math.sqrt(n[TIME]) / (p[STILL_SPEED] if rest[k] else p[SPREAD])
        for i in range(3):
            if i == 2:
                scale = math.sqrt(n[TIME]) / (UPRIGHT * p[SPREAD])
            own[13 + i, VELOCITY + i], value[13 + i] = scale, -scale * x[VELOCITY + i]
        if field and weight[k] > 0.0 and n[FIELD_TIME] > 0.0:
            scale = math.sqrt(n[FIELD_TIME] * weight[k]) / p[MAG]
            value[16] = scale * heading_row(n, r, x, row)
            own[16, EAST] = scale * row[3]
            for i in range(3):
                own[16, i] = scale * row[i]
            fixed[16, DELAY - MOVING] = scale * row[4]
        step(n, rest[k], r, x, p, next_r, next_x, by_gyro, by_push)
        turn, walk, push, disturbed = step_noise(n, rest[k], p)
        memory = math.exp(-n[TIME] / p[MEMORY])
        difference(next_r, rotation[k + 1], moved)
        last, own, fixed, value = before[k + 1], here[k + 1], static[k + 1], right[k + 1]
        for i in range(3):
            s = 1.0 / math.sqrt(turn)
            own[i, i], last[i, i], value[i] = s, -s, s * moved[i]
            for m in range(3):
                last[i, BIAS + m] = -s * by_gyro[i, m]
            for m in range(9):
                fixed[i, MATRIX - MOVING + m] = -s * by_gyro[i, 3 + m]
            s, j = 1.0 / math.sqrt(walk), BIAS + i
            own[j, j], last[j, j], value[j] = s, -s, s * (next_x[j] - state[k + 1, j])
            s, j = 1.0 / math.sqrt(push), VELOCITY + i
            own[j, j], last[j, j], value[j] = s, -s, s * (next_x[j] - state[k + 1, j])
            for m in range(3):
                last[j, m] = -s * by_push[i, m]
                fixed[j, PULL - MOVING + m] = -s * by_push[i, 3 + m]
        s = 1.0 / math.sqrt(disturbed)
        own[EAST, EAST], last[EAST, EAST] = s, -s * memory
        value[EAST] = s * (next_x[EAST] - state[k + 1, EAST])


@njit(types.void(w3, w2, f2, f1), **compiled)
def move(rotation, state, deviation, constants):
    """Go by a deviation (K + 1, 10) of the nodes and one (13,) of the constants, in place."""
    for k in range(len(state)):
        retract(rotation[k], deviation[k, 0], deviation[k, 1], deviation[k, 2])
        for i in range(3, MOVING):
            state[k, i] += deviation[k, i]
        for i in range(STATIC):
            state[k, MOVING + i] += constants[i]
