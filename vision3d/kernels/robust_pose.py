"""What the robust loop calls for a pose from points and rays: three points, reprojection errors, a fit.

Rows are 12 numbers: a point (3,), the unit ray it was seen along, and A (2, 3), how its pixel moves with a
point at the ray, per standard deviation; A ray = 0.  The error of p = R X + t, A p over its depth in rays, is
the reprojection error of a pinhole exactly, and of other lenses to first order; beyond 80° from the axis
depths are along the ray.  A model is a pose (7,).
"""

from __future__ import annotations

import math

import numpy as np
from numba import carray

from vision3d.kernels import entry, inlined
from vision3d.kernels.p3p import solve_p3p
from vision3d.kernels.pose_refinement import moved, solve_damped, turn_matrix
from vision3d.kernels.robust_calls import FIT, RESIDUALS, SOLVE

__all__ = ["pose_error", "pose_fit", "pose_solve"]

BEHIND = 1e30
WIDE = 0.17  # cosine of the angle from the axis beyond which depths are along the ray
STEPS = 2


@inlined
def seen_at(data, n, R, pose, p):
    """Fill p (3,), the point in the camera's frame over its depth; gives the depth, over the ray's."""
    for i in range(3):
        p[i] = R[i, 0] * data[n, 0] + R[i, 1] * data[n, 1] + R[i, 2] * data[n, 2] + pose[4 + i]
    if data[n, 5] > WIDE:
        depth = p[2] / data[n, 5]
    else:
        depth = data[n, 3] * p[0] + data[n, 4] * p[1] + data[n, 5] * p[2]
    for i in range(3):
        p[i] /= depth
    return depth


@entry(SOLVE)
def pose_solve(address, n, k, chosen, filled):
    """The poses of three points."""
    return solve_p3p(carray(address, (n, k)), carray(chosen, (3,)), carray(filled, (4, 7)))


@entry(RESIDUALS)
def pose_error(address, n, k, model, filled):
    """Squared reprojection errors, in standard deviations."""
    data, pose, errors = carray(address, (n, 12)), carray(model, (7,)), carray(filled, (n,))
    R, p = np.empty((3, 3)), np.empty(3)
    turn_matrix(pose, R)
    for i in range(n):
        depth = seen_at(data, i, R, pose, p)
        u = data[i, 6] * p[0] + data[i, 7] * p[1] + data[i, 8] * p[2]
        v = data[i, 9] * p[0] + data[i, 10] * p[1] + data[i, 11] * p[2]
        errors[i] = u * u + v * v if depth > 1e-12 else BEHIND
    return 1


@inlined
def normal_equations(data, weights, pose, R, H, g):
    """Fill H (6, 6) and g (6,) of the weighted errors; gives how many rows have a weight."""
    turn_matrix(pose, R)
    H[:, :] = 0.0
    g[:] = 0.0
    p, row = np.empty(3), np.empty(6)
    count = 0
    for n in range(data.shape[0]):
        if not weights[n] > 0.0:
            continue
        depth = seen_at(data, n, R, pose, p)
        if not depth > 1e-12:
            continue
        count += 1
        axis = data[n, 5] > WIDE
        for c in range(2):
            a, b, e = data[n, 6 + 3 * c], data[n, 7 + 3 * c], data[n, 8 + 3 * c]
            error = a * p[0] + b * p[1] + e * p[2]
            x = (a - (0.0 if axis else error * data[n, 3])) / depth
            y = (b - (0.0 if axis else error * data[n, 4])) / depth
            z = (e - (error / data[n, 5] if axis else error * data[n, 5])) / depth
            for j in range(3):
                row[3 + j] = x * R[0, j] + y * R[1, j] + z * R[2, j]
            row[0] = data[n, 1] * row[5] - data[n, 2] * row[4]
            row[1] = data[n, 2] * row[3] - data[n, 0] * row[5]
            row[2] = data[n, 0] * row[4] - data[n, 1] * row[3]
            for i in range(6):
                g[i] -= weights[n] * row[i] * error
                for j in range(i + 1):
                    H[i, j] += weights[n] * row[i] * row[j]
    for i in range(6):
        for j in range(i):
            H[j, i] = H[i, j]
    return count


@entry(FIT)
def pose_fit(address, n, k, weight, model):
    """Two Gauss-Newton steps on the weighted squared reprojection errors."""
    data, weights, pose = carray(address, (n, 12)), carray(weight, (n,)), carray(model, (7,))
    R, H, L, g, step, ahead = (
        np.empty((3, 3)), np.empty((6, 6)), np.zeros((6, 6)), np.empty(6), np.empty(6), np.empty(7),
    )  # fmt: skip
    for _ in range(STEPS):
        if normal_equations(data, weights, pose, R, H, g) < 4 or not solve_damped(H, g, 0.0, L, step):
            return 0
        moved(pose, R, step, ahead)
        pose[:] = ahead
        if not math.isfinite(pose[4] + pose[5] + pose[6]):
            return 0
    return 1
