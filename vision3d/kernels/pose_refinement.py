"""The pose that brings points of an object nearest to their pixels: damped Gauss-Newton on six numbers."""

from __future__ import annotations

import math

import numpy as np
from numba import types

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import f0, f1, f2, i0, w1, w2
from vision3d.kernels.lenses import project_point_one

__all__ = ["refine_pose"]

ITERATIONS_MAX = 100
SETTLED = 1e-12
"""Predicted fall of the cost, relative, at which the iteration ends."""
DAMPING_MIN, DAMPING_MAX = 1e-12, 1e12


@inlined
def turn_matrix(pose, R):
    """Fill R (3, 3) from the quaternion of a pose."""
    w, x, y, z = pose[0], pose[1], pose[2], pose[3]
    R[0, 0], R[0, 1], R[0, 2] = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
    R[1, 0], R[1, 1], R[1, 2] = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
    R[2, 0], R[2, 1], R[2, 2] = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)


@inlined
def moved(pose, R, step, ahead):
    """Fill `ahead` with the pose after a step (rotation, translation) in its own frame, to first order."""
    angle = math.sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2)
    s = math.sin(0.5 * angle) / angle if angle > 1e-12 else 0.5
    w, x, y, z = math.cos(0.5 * angle), s * step[0], s * step[1], s * step[2]
    a, b, c, d = pose[0], pose[1], pose[2], pose[3]
    ahead[0], ahead[1] = a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y
    ahead[2], ahead[3] = a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w
    norm = math.sqrt(ahead[0] ** 2 + ahead[1] ** 2 + ahead[2] ** 2 + ahead[3] ** 2)
    for i in range(4):
        ahead[i] /= norm
    for i in range(3):
        ahead[4 + i] = pose[4 + i] + R[i, 0] * step[3] + R[i, 1] * step[4] + R[i, 2] * step[5]


@inlined
def cost_and_slope(code, p, points, pixels, weights, huber, pose, R, H, g):
    """Robust cost at a pose, infinite behind the lens; fills its information H (6, 6) and slope g (6,)."""
    turn_matrix(pose, R)
    H[:, :] = 0.0
    g[:] = 0.0
    d_point, row = np.empty((2, 3)), np.empty(6)
    cost = 0.0
    for n in range(points.shape[0]):
        a, b, c = points[n, 0], points[n, 1], points[n, 2]
        x = R[0, 0] * a + R[0, 1] * b + R[0, 2] * c + pose[4]
        y = R[1, 0] * a + R[1, 1] * b + R[1, 2] * c + pose[5]
        z = R[2, 0] * a + R[2, 1] * b + R[2, 2] * c + pose[6]
        u, v = project_point_one(code, p, math.inf, x, y, z, d_point)
        if math.isnan(u) or math.isnan(v):
            return math.inf
        eu, ev = weights[n] * (pixels[n, 0] - u), weights[n] * (pixels[n, 1] - v)
        size = math.sqrt(eu * eu + ev * ev)
        share = 1.0 if size <= huber else huber / size
        cost += size * size if size <= huber else huber * (2.0 * size - huber)
        for k in range(2):
            for j in range(3):
                row[3 + j] = d_point[k, 0] * R[0, j] + d_point[k, 1] * R[1, j] + d_point[k, 2] * R[2, j]
            # the point moves by R (rotation × point + translation)
            row[0] = row[5] * b - row[4] * c
            row[1] = row[3] * c - row[5] * a
            row[2] = row[4] * a - row[3] * b
            error = eu if k == 0 else ev
            for i in range(6):
                row[i] *= weights[n]
                g[i] += share * row[i] * error
                for j in range(i + 1):
                    H[i, j] += share * row[i] * row[j]
    for i in range(6):
        for j in range(i):
            H[j, i] = H[i, j]
    return cost


@inlined
def solve_damped(H, g, damping, L, step):
    """Solve (H + damping diag H) step = g by Cholesky; False where it is not positive definite."""
    for i in range(6):
        for j in range(i + 1):
            total = H[i, j] * (1.0 + damping) if i == j else H[i, j]
            for k in range(j):
                total -= L[i, k] * L[j, k]
            if i == j:
                if not total > 1e-14 * H[i, i]:
                    return False
                L[i, i] = math.sqrt(total)
            else:
                L[i, j] = total / L[j, j]
    for i in range(6):
        total = g[i]
        for k in range(i):
            total -= L[i, k] * step[k]
        step[i] = total / L[i, i]
    for i in range(5, -1, -1):
        total = step[i]
        for k in range(i + 1, 6):
            total -= L[k, i] * step[k]
        step[i] = total / L[i, i]
    return True


@kernel(types.Tuple((f0, i0))(i0, f1, f2, f2, f1, f0, w1, w2))
def refine_pose(code, p, points, pixels, weights, huber, pose, information):
    """Improve a pose (7,) in place, and fill its information (6, 6); gives the cost and the iterations.

    Weights (N,) are 1 / sigma, px⁻¹; `huber` is in sigmas, np.inf for plain least squares.  The cost is
    infinite where the first pose has a point behind the camera.
    """
    R, ahead, L, step = np.empty((3, 3)), np.empty(7), np.zeros((6, 6)), np.empty(6)
    g, H_ahead, g_ahead = np.empty(6), np.empty((6, 6)), np.empty(6)
    cost = cost_and_slope(code, p, points, pixels, weights, huber, pose, R, information, g)
    damping, iterations = 1e-3, 0
    while iterations < ITERATIONS_MAX and cost < math.inf:
        iterations += 1
        if not solve_damped(information, g, damping, L, step):
            damping *= 10.0
            if damping > DAMPING_MAX:
                break
            continue
        fall = 0.0
        for i in range(6):
            fall += step[i] * g[i]
        turn_matrix(pose, R)
        moved(pose, R, step, ahead)
        cost_ahead = cost_and_slope(code, p, points, pixels, weights, huber, ahead, R, H_ahead, g_ahead)
        if cost_ahead <= cost:
            pose[:] = ahead
            information[:, :] = H_ahead
            g[:] = g_ahead
            cost = cost_ahead
            damping = max(0.1 * damping, DAMPING_MIN)
            if fall <= SETTLED * (1.0 + cost):
                break
        else:
            if fall <= SETTLED * (1.0 + cost):
                break
            damping *= 10.0
            if damping > DAMPING_MAX:
                break
    return cost, iterations
