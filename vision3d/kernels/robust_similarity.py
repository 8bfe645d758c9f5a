"""Similarities b = s R a + t, in the plane and in space, for the robust loop.

Rows of data are (a, b).  In the plane a model is (p, q, t), with s R = [[p, -q], [q, p]]; in space it is a
unit quaternion, t and s.  The error is the distance in b.  Fits are Umeyama's least squares (1991), the
rotation in space by Horn's quaternion (1987), which is never a mirror image.
"""

from __future__ import annotations

import math

import numpy as np
from numba import carray

from vision3d.kernels import entry, inlined
from vision3d.kernels.robust_calls import FIT, RESIDUALS, SOLVE
from vision3d.kernels.symmetric import diagonalise, extreme_column

__all__ = [
    "plane_similarity_fit",
    "plane_similarity_residuals",
    "plane_similarity_solve",
    "space_similarity_fit",
    "space_similarity_residuals",
    "space_similarity_solve",
]

EQUAL = 1e-12  # squared length, or area, below which points of unit size tell nothing


@inlined
def fit_in_plane(data, weights, model):
    """Fill model (4,) from weighted rows; false where the points of a are all equal."""
    total = ax = ay = bx = by = 0.0
    for i in range(data.shape[0]):
        w = weights[i]
        total += w
        ax += w * data[i, 0]
        ay += w * data[i, 1]
        bx += w * data[i, 2]
        by += w * data[i, 3]
    if not total > 0.0:
        return False
    ax, ay, bx, by = ax / total, ay / total, bx / total, by / total
    size = p = q = 0.0
    for i in range(data.shape[0]):
        w = weights[i]
        x, y, u, v = data[i, 0] - ax, data[i, 1] - ay, data[i, 2] - bx, data[i, 3] - by
        size += w * (x * x + y * y)
        p += w * (x * u + y * v)
        q += w * (x * v - y * u)
    if not size > EQUAL * total:
        return False
    p, q = p / size, q / size
    model[0], model[1], model[2], model[3] = p, q, bx - p * ax + q * ay, by - q * ax - p * ay
    return p * p + q * q > EQUAL


@entry(SOLVE)
def plane_similarity_solve(address, n, k, chosen, filled):
    """The similarity of two points; none where they coincide in a or b."""
    data, s, model = carray(address, (n, 4)), carray(chosen, (2,)), carray(filled, (4,))
    rows, ones = np.empty((2, 4)), np.ones(2)
    for i in range(2):
        rows[i] = data[s[i]]
    return 1 if fit_in_plane(rows, ones, model) else 0


@entry(RESIDUALS)
def plane_similarity_residuals(address, n, k, model, filled):
    """Squared distances in b."""
    data, m, errors = carray(address, (n, 4)), carray(model, (4,)), carray(filled, (n,))
    p, q, tx, ty = m[0], m[1], m[2], m[3]
    for i in range(n):
        x, y = data[i, 0], data[i, 1]
        u, v = p * x - q * y + tx - data[i, 2], q * x + p * y + ty - data[i, 3]
        errors[i] = u * u + v * v
    return 1


@entry(FIT)
def plane_similarity_fit(address, n, k, weight, model):
    """Least squares, at once."""
    data, weights = carray(address, (n, 4)), carray(weight, (n,))
    return 1 if fit_in_plane(data, weights, carray(model, (4,))) else 0


@inlined
def scaled_rotation(m, M):
    """Fill M (3, 3) = s R of a model (8,)."""
    w, x, y, z, s = m[0], m[1], m[2], m[3], m[7]
    M[0, 0], M[0, 1], M[0, 2] = (
        s * (1 - 2 * (y * y + z * z)),
        s * 2 * (x * y - w * z),
        s * 2 * (x * z + w * y),
    )
    M[1, 0], M[1, 1], M[1, 2] = (
        s * 2 * (x * y + w * z),
        s * (1 - 2 * (x * x + z * z)),
        s * 2 * (y * z - w * x),
    )
    M[2, 0], M[2, 1], M[2, 2] = (
        s * 2 * (x * z - w * y),
        s * 2 * (y * z + w * x),
        s * (1 - 2 * (x * x + y * y)),
    )


@inlined
def fit_in_space(data, weights, model):
    """Fill model (8,) from weighted rows; false where the points of a or b are on one line."""
    mean, total = np.zeros(6), 0.0
    for i in range(data.shape[0]):
        total += weights[i]
        for c in range(6):
            mean[c] += weights[i] * data[i, c]
    if not total > 0.0:
        return False
    mean /= total
    C, size, off = np.zeros((3, 3)), 0.0, np.empty(6)
    for i in range(data.shape[0]):
        if weights[i] > 0.0:
            for c in range(6):
                off[c] = data[i, c] - mean[c]
            for c in range(3):
                size += weights[i] * off[c] * off[c]
                for d in range(3):
                    C[c, d] += weights[i] * off[c] * off[3 + d]
    Q, V = np.empty((4, 4)), np.empty((4, 4))
    Q[0, 0] = C[0, 0] + C[1, 1] + C[2, 2]
    Q[0, 1] = Q[1, 0] = C[1, 2] - C[2, 1]
    Q[0, 2] = Q[2, 0] = C[2, 0] - C[0, 2]
    Q[0, 3] = Q[3, 0] = C[0, 1] - C[1, 0]
    for c in range(3):
        for d in range(3):
            Q[1 + c, 1 + d] = C[c, d] + C[d, c]
        Q[1 + c, 1 + c] -= Q[0, 0]
    diagonalise(Q, V)
    column = extreme_column(Q, 1.0)
    best, second = Q[column, column], -math.inf
    for c in range(4):
        if c != column:
            second = max(second, Q[c, c])
    if not (size > EQUAL * total and best - second > 1e-9 * abs(best)):
        return False
    for c in range(4):
        model[c] = math.copysign(1.0, V[0, column]) * V[c, column]
    model[7] = best / size
    M = np.empty((3, 3))
    scaled_rotation(model, M)
    for c in range(3):
        model[4 + c] = mean[3 + c] - M[c, 0] * mean[0] - M[c, 1] * mean[1] - M[c, 2] * mean[2]
    return model[7] > EQUAL


@entry(SOLVE)
def space_similarity_solve(address, n, k, chosen, filled):
    """The similarity of three points, by least squares; none where they are on one line."""
    data, s, model = carray(address, (n, 6)), carray(chosen, (3,)), carray(filled, (8,))
    rows, ones = np.empty((3, 6)), np.ones(3)
    for i in range(3):
        rows[i] = data[s[i]]
    return 1 if fit_in_space(rows, ones, model) else 0


@entry(RESIDUALS)
def space_similarity_residuals(address, n, k, model, filled):
    """Squared distances in b."""
    data, m, errors, M = carray(address, (n, 6)), carray(model, (8,)), carray(filled, (n,)), np.empty((3, 3))
    scaled_rotation(m, M)
    for i in range(n):
        x, y, z, total = data[i, 0], data[i, 1], data[i, 2], 0.0
        for c in range(3):
            off = M[c, 0] * x + M[c, 1] * y + M[c, 2] * z + m[4 + c] - data[i, 3 + c]
            total += off * off
        errors[i] = total
    return 1


@entry(FIT)
def space_similarity_fit(address, n, k, weight, model):
    """Least squares, at once."""
    data, weights = carray(address, (n, 6)), carray(weight, (n,))
    return 1 if fit_in_space(data, weights, carray(model, (8,))) else 0
