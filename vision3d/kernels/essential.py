"""Sampson distances of pairs of rays to an essential matrix, and the relative pose that makes them least.

A pair is a row of 18 numbers: the unit rays a and b, then how each moves with its own pixel, A (3, 2) and
B (3, 2), per standard deviation of a coordinate.  To first order the algebraic error e = b' E a then has the
variance |A' E' b|² + |B' E a|², and

    s = e / sqrt(|A' E' b|² + |B' E a|²)

is in standard deviations: Sampson's distance through the true lens, fisheyes included.

The tangent of a relative pose (R, t), |t| = 1, is that of GTSAM's EssentialMatrix: R <- R Exp(w), and t moves
along the great circle through its tangent plane's basis.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import f0, f1, f2, i0, w1, w2
from vision3d.kernels.plane_pose import cholesky, rotate_right, solve

__all__ = [
    "essential_information",
    "essential_residuals",
    "loss_of",
    "motion_of",
    "refine_essential",
    "sampson_one",
    "tangent_basis",
]

PLAIN, HUBER, CAUCHY, TRUNCATED = 0, 1, 2, 3
SETTLED = 1e-10


@inlined
def sampson_one(data, n, E):
    """Signed Sampson distance of pair n to E (9,), in standard deviations."""
    ax, ay, az = data[n, 0], data[n, 1], data[n, 2]
    bx, by, bz = data[n, 3], data[n, 4], data[n, 5]
    u0 = E[0] * ax + E[1] * ay + E[2] * az
    u1 = E[3] * ax + E[4] * ay + E[5] * az
    u2 = E[6] * ax + E[7] * ay + E[8] * az
    v0 = E[0] * bx + E[3] * by + E[6] * bz
    v1 = E[1] * bx + E[4] * by + E[7] * bz
    v2 = E[2] * bx + E[5] * by + E[8] * bz
    p = v0 * data[n, 6] + v1 * data[n, 8] + v2 * data[n, 10]
    q = v0 * data[n, 7] + v1 * data[n, 9] + v2 * data[n, 11]
    r = u0 * data[n, 12] + u1 * data[n, 14] + u2 * data[n, 16]
    s = u0 * data[n, 13] + u1 * data[n, 15] + u2 * data[n, 17]
    return (bx * u0 + by * u1 + bz * u2) / math.sqrt(p * p + q * q + r * r + s * s + 1e-300)


@kernel(types.void(f2, f1, w1))
def essential_residuals(data, E, out):
    """Fill out (N,) with squared Sampson distances to E (9,)."""
    for n in range(data.shape[0]):
        s = sampson_one(data, n, E)
        out[n] = s * s


@inlined
def essential_of(R, t, E):
    """Fill E (9,) = [t]x R."""
    for j in range(3):
        E[j] = t[1] * R[2, j] - t[2] * R[1, j]
        E[3 + j] = t[2] * R[0, j] - t[0] * R[2, j]
        E[6 + j] = t[0] * R[1, j] - t[1] * R[0, j]


@inlined
def motion_of(E, R, t):
    """Fill R (3, 3) and t (3,) of one of the motions of E (9,); False where it is none.

    t is across the columns of E; of the two rotations, Horn's closed form takes cofactors(E) - [t]x E.  Horn
    1990, "Recovering baseline and orientation from essential matrix".
    """
    best = 0.0
    for i in range(3):
        j = (i + 1) % 3
        x = E[3 + i] * E[6 + j] - E[6 + i] * E[3 + j]
        y = E[6 + i] * E[j] - E[i] * E[6 + j]
        z = E[i] * E[3 + j] - E[3 + i] * E[j]
        size = x * x + y * y + z * z
        if size > best:
            best = size
            t[0], t[1], t[2] = x, y, z
    if not (1e-300 < best < math.inf):
        return False
    length, norm = math.sqrt(best), 0.0
    for i in range(3):
        t[i] /= length
    for i in range(9):
        norm += E[i] * E[i]
    scale = math.sqrt(2.0 / norm)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for c in range(3):
            d, e = (c + 1) % 3, (c + 2) % 3
            cofactor = E[3 * j + d] * E[3 * k + e] - E[3 * j + e] * E[3 * k + d]
            across = t[j] * E[3 * k + c] - t[k] * E[3 * j + c]
            R[i, c] = scale * (scale * cofactor - across)
    # rows made orthonormal: E may be essential only nearly
    for i in range(2):
        norm = math.sqrt(R[i, 0] ** 2 + R[i, 1] ** 2 + R[i, 2] ** 2)
        for c in range(3):
            R[i, c] /= norm
        if i == 0:
            dot = R[0, 0] * R[1, 0] + R[0, 1] * R[1, 1] + R[0, 2] * R[1, 2]
            for c in range(3):
                R[1, c] -= dot * R[0, c]
    for c in range(3):
        d, e = (c + 1) % 3, (c + 2) % 3
        R[2, c] = R[0, d] * R[1, e] - R[0, e] * R[1, d]
    return True


@inlined
def tangent_basis(t, basis):
    """Fill basis (2, 3), orthonormal and across the unit vector t, as GTSAM's Unit3 chooses it."""
    x, y, z = abs(t[0]), abs(t[1]), abs(t[2])
    axis = 0 if x <= y and x <= z else (1 if y <= z else 2)
    a, b, c = 1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0
    basis[0, 0], basis[0, 1], basis[0, 2] = t[1] * c - t[2] * b, t[2] * a - t[0] * c, t[0] * b - t[1] * a
    norm = math.sqrt(basis[0, 0] ** 2 + basis[0, 1] ** 2 + basis[0, 2] ** 2)
    for i in range(3):
        basis[0, i] /= norm
    basis[1, 0] = t[1] * basis[0, 2] - t[2] * basis[0, 1]
    basis[1, 1] = t[2] * basis[0, 0] - t[0] * basis[0, 2]
    basis[1, 2] = t[0] * basis[0, 1] - t[1] * basis[0, 0]


@inlined
def directions(R, t, E, basis, D):
    """Fill D (5, 9): how E moves with the rotation, E [e]x, and with t, [basis]x R."""
    tangent_basis(t, basis)
    for i in range(3):
        x, y, z = E[3 * i], E[3 * i + 1], E[3 * i + 2]
        D[0, 3 * i], D[0, 3 * i + 1], D[0, 3 * i + 2] = 0.0, z, -y
        D[1, 3 * i], D[1, 3 * i + 1], D[1, 3 * i + 2] = -z, 0.0, x
        D[2, 3 * i], D[2, 3 * i + 1], D[2, 3 * i + 2] = y, -x, 0.0
    for k in range(2):
        essential_of(R, basis[k], D[3 + k])


@inlined
def loss_of(kind, scale, squared):
    """Robust cost and weight of a squared distance; both in units where a plain one costs itself."""
    if kind == HUBER and squared > scale * scale:
        size = math.sqrt(squared)
        return scale * (2.0 * size - scale), scale / size
    if kind == CAUCHY:
        share = squared / (scale * scale)
        return scale * scale * math.log1p(share), 1.0 / (1.0 + share)
    if kind == TRUNCATED and squared > scale * scale:
        return scale * scale, 0.0
    return squared, 1.0


@inlined
def normal_equations(data, weights, kind, scale, R, t, basis, D, H, g):
    """Fill H (5, 5) and g (5,) of a relative pose; gives its robust cost."""
    E, row = np.empty(9), np.empty(5)
    essential_of(R, t, E)
    directions(R, t, E, basis, D)
    H[:, :] = 0.0
    g[:] = 0.0
    total = 0.0
    for n in range(data.shape[0]):
        if not weights[n] > 0.0:
            continue
        ax, ay, az = data[n, 0], data[n, 1], data[n, 2]
        bx, by, bz = data[n, 3], data[n, 4], data[n, 5]
        u0 = E[0] * ax + E[1] * ay + E[2] * az
        u1 = E[3] * ax + E[4] * ay + E[5] * az
        u2 = E[6] * ax + E[7] * ay + E[8] * az
        v0 = E[0] * bx + E[3] * by + E[6] * bz
        v1 = E[1] * bx + E[4] * by + E[7] * bz
        v2 = E[2] * bx + E[5] * by + E[8] * bz
        p = v0 * data[n, 6] + v1 * data[n, 8] + v2 * data[n, 10]
        q = v0 * data[n, 7] + v1 * data[n, 9] + v2 * data[n, 11]
        r = u0 * data[n, 12] + u1 * data[n, 14] + u2 * data[n, 16]
        s = u0 * data[n, 13] + u1 * data[n, 15] + u2 * data[n, 17]
        variance = p * p + q * q + r * r + s * s + 1e-300
        inverse = 1.0 / math.sqrt(variance)
        distance = (bx * u0 + by * u1 + bz * u2) * inverse
        cost, weight = loss_of(kind, scale, distance * distance)
        total += weights[n] * cost
        weight *= weights[n]
        if weight == 0.0:
            continue
        # d distance / dE = b l' - m a'
        c = distance / variance
        l0 = ax * inverse - c * (p * data[n, 6] + q * data[n, 7])
        l1 = ay * inverse - c * (p * data[n, 8] + q * data[n, 9])
        l2 = az * inverse - c * (p * data[n, 10] + q * data[n, 11])
        m0 = c * (r * data[n, 12] + s * data[n, 13])
        m1 = c * (r * data[n, 14] + s * data[n, 15])
        m2 = c * (r * data[n, 16] + s * data[n, 17])
        for k in range(5):
            d0 = D[k, 0] * l0 + D[k, 1] * l1 + D[k, 2] * l2
            d1 = D[k, 3] * l0 + D[k, 4] * l1 + D[k, 5] * l2
            d2 = D[k, 6] * l0 + D[k, 7] * l1 + D[k, 8] * l2
            e0 = D[k, 0] * ax + D[k, 1] * ay + D[k, 2] * az
            e1 = D[k, 3] * ax + D[k, 4] * ay + D[k, 5] * az
            e2 = D[k, 6] * ax + D[k, 7] * ay + D[k, 8] * az
            row[k] = bx * d0 + by * d1 + bz * d2 - (m0 * e0 + m1 * e1 + m2 * e2)
            g[k] += weight * row[k] * distance
            for j in range(k + 1):
                H[k, j] += weight * row[k] * row[j]
    for k in range(5):
        for j in range(k):
            H[j, k] = H[k, j]
    return total


@inlined
def moved(R, t, basis, step, R_ahead, t_ahead):
    """Fill the relative pose after a step along its tangent."""
    rotate_right(R, step[0], step[1], step[2], R_ahead)
    size = math.sqrt(step[3] ** 2 + step[4] ** 2)
    along, across = math.cos(size), math.sin(size) / size if size > 1e-12 else 1.0
    norm = 0.0
    for i in range(3):
        t_ahead[i] = along * t[i] + across * (step[3] * basis[0, i] + step[4] * basis[1, i])
        norm += t_ahead[i] ** 2
    for i in range(3):
        t_ahead[i] /= math.sqrt(norm)


@kernel(types.Tuple((f0, i0))(f2, f1, i0, f0, i0, w2, w1, w2))
def refine_essential(data, weights, kind, scale, iterations_max, R, t, H):
    """Improve a relative pose, R (3, 3) and t (3,), in place: Levenberg-Marquardt on Sampson distances.

    `kind` is the loss (0 plain, 1 Huber, 2 Cauchy, 3 truncated) and `scale` its parameter in standard
    deviations; `weights` (N,) are relative 1 / σ².  Fills the information H (5, 5); gives the cost and the
    iterations.
    """
    g, g2, H2, L, step = np.empty(5), np.empty(5), np.empty((5, 5)), np.zeros((5, 5)), np.zeros(5)
    R2, t2, D = np.empty((3, 3)), np.empty(3), np.empty((5, 9))
    basis, basis2 = np.empty((2, 3)), np.empty((2, 3))
    cost = normal_equations(data, weights, kind, scale, R, t, basis, D, H, g)
    damping, iteration = 1e-4, 0
    while iteration < iterations_max:
        iteration += 1
        if math.isnan(cholesky(H, 0, damping, L)):
            damping *= 10.0
            if damping > 1e10:
                break
            continue
        solve(L, g, 0, step)
        fall = 0.0
        for i in range(5):
            fall -= step[i] * g[i]
        moved(R, t, basis, step, R2, t2)
        ahead = normal_equations(data, weights, kind, scale, R2, t2, basis2, D, H2, g2)
        if ahead <= cost:
            R[:, :], t[:], H[:, :], g[:], basis[:, :] = R2, t2, H2, g2, basis2
            cost = ahead
            damping = max(0.1 * damping, 1e-12)
        else:
            damping *= 10.0
        if fall <= SETTLED * (1.0 + cost) or damping > 1e10:
            break
    return cost, iteration


@kernel(types.boolean(f2, f1, f1, w2, w2))
def essential_information(data, weights, E, H, D):
    """Fill the information H (5, 5) of E's motion, and D (5, 9), how E moves along its tangent."""
    R, t, g, basis = np.empty((3, 3)), np.empty(3), np.empty(5), np.empty((2, 3))
    if not motion_of(E, R, t):
        return False
    normal_equations(data, weights, PLAIN, 1.0, R, t, basis, D, H, g)
    return True
