"""Lines in the plane and planes in space for the robust loop: total least squares.

Rows of data are points (x, y) or (x, y, z); a model is the unit normal n and the offset d of n · x = d; the
error is the distance from the line or plane.
"""

from __future__ import annotations

import math

import numpy as np
from numba import carray

from vision3d.kernels import entry, inlined
from vision3d.kernels.robust_calls import FIT, RESIDUALS, SOLVE
from vision3d.kernels.symmetric import diagonalise, extreme_column

__all__ = ["flat_fit", "flat_residuals", "line_solve", "plane_solve"]

EQUAL = 1e-9  # sine of an angle, or distance, below which points of unit size tell nothing


@entry(SOLVE)
def line_solve(address, n, k, chosen, filled):
    """The line through two points; none where they coincide."""
    data, s, model = carray(address, (n, 2)), carray(chosen, (2,)), carray(filled, (3,))
    x, y = data[s[0], 1] - data[s[1], 1], data[s[1], 0] - data[s[0], 0]
    length = math.sqrt(x * x + y * y)
    if not length > EQUAL:
        return 0
    model[0], model[1] = x / length, y / length
    model[2] = model[0] * data[s[0], 0] + model[1] * data[s[0], 1]
    return 1


@entry(SOLVE)
def plane_solve(address, n, k, chosen, filled):
    """The plane through three points; none where they are on a line."""
    data, s, model = carray(address, (n, 3)), carray(chosen, (3,)), carray(filled, (4,))
    ax, ay, az = data[s[1], 0] - data[s[0], 0], data[s[1], 1] - data[s[0], 1], data[s[1], 2] - data[s[0], 2]
    bx, by, bz = data[s[2], 0] - data[s[0], 0], data[s[2], 1] - data[s[0], 1], data[s[2], 2] - data[s[0], 2]
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    length = math.sqrt(x * x + y * y + z * z)
    if not length > EQUAL * math.sqrt((ax * ax + ay * ay + az * az) * (bx * bx + by * by + bz * bz)):
        return 0
    model[0], model[1], model[2] = x / length, y / length, z / length
    model[3] = model[0] * data[s[0], 0] + model[1] * data[s[0], 1] + model[2] * data[s[0], 2]
    return 1


@entry(RESIDUALS)
def flat_residuals(address, n, k, flat, filled):
    """Squared distances of points."""
    errors = carray(filled, (n,))
    if k == 2:
        model, plane = carray(flat, (3,)), carray(address, (n, 2))
        a, b, d = model[0], model[1], model[2]
        for i in range(n):
            off = a * plane[i, 0] + b * plane[i, 1] - d
            errors[i] = off * off
        return 1
    model, space = carray(flat, (4,)), carray(address, (n, 3))
    a, b, c, d = model[0], model[1], model[2], model[3]
    for i in range(n):
        off = a * space[i, 0] + b * space[i, 1] + c * space[i, 2] - d
        errors[i] = off * off
    return 1


@inlined
def weighted_mean(data, weights, mean):
    """Fill mean (k,); returns the sum of the weights."""
    total = 0.0
    mean[:] = 0.0
    for i in range(data.shape[0]):
        total += weights[i]
        for c in range(data.shape[1]):
            mean[c] += weights[i] * data[i, c]
    for c in range(data.shape[1]):
        mean[c] /= total
    return total


@entry(FIT)
def flat_fit(address, n, k, weight, flat):
    """The line or plane of least squared distances; its normal keeps to the side it is on."""
    data, weights, model = carray(address, (n, k)), carray(weight, (n,)), carray(flat, (k + 1,))
    mean, A, V = np.empty(k), np.zeros((k, k)), np.empty((k, k))
    if not weighted_mean(data, weights, mean) > 0.0:
        return 0
    for i in range(n):
        if weights[i] > 0.0:
            for c in range(k):
                off = weights[i] * (data[i, c] - mean[c])
                for d in range(c + 1):
                    A[c, d] += off * (data[i, d] - mean[d])
    for c in range(k):
        for d in range(c):
            A[d, c] = A[c, d]
    diagonalise(A, V)
    column = extreme_column(A, -1.0)
    side = 0.0
    for c in range(k):
        side += V[c, column] * model[c]
    model[k] = 0.0
    for c in range(k):
        model[c] = math.copysign(1.0, side) * V[c, column]
        model[k] += model[c] * mean[c]
    return 1
