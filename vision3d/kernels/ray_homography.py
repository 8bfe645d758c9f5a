"""Pairs of rays that a homography takes to each other: b ~ H a, of a plane, or of a camera that only turns.

A pair is a row of 18 numbers, as in `vision3d.kernels.essential`: a, b, A (3, 2), B (3, 2).  With y = H a and
P = (B'B)⁻¹ B' the image of the ray in standard deviations of b's pixel is e = P y / (b · y), whose covariance
is I + M M', M = P H A / (b · y).  Sampson's distance is sqrt(e' (I + M M')⁻¹ e), through any lens.

Three kinds of parameters: 3, a rotation R (9 numbers); 8, a plane seen after a motion, H = R + t n' (R, then
t of length one, then n, the normal over the distance in baselines: 15 numbers); 9, any H of Frobenius norm 1.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import f0, f1, f2, i0, w1, w2
from vision3d.kernels.essential import loss_of, tangent_basis
from vision3d.kernels.plane_pose import cholesky, rotate_right, solve

__all__ = ["homography_residuals", "refine_homography"]

BEHIND = 1e12
"""Squared distance of a pair that the homography takes behind the camera."""


@inlined
def whitened(data, n, H, P, e, L):
    """Fill P (2, 3), the whitened residual e (2,), the Cholesky factor L (3,); gives b · H a."""
    g00 = data[n, 12] ** 2 + data[n, 14] ** 2 + data[n, 16] ** 2
    g01 = data[n, 12] * data[n, 13] + data[n, 14] * data[n, 15] + data[n, 16] * data[n, 17]
    g11 = data[n, 13] ** 2 + data[n, 15] ** 2 + data[n, 17] ** 2
    det = g00 * g11 - g01 * g01
    for i in range(3):
        P[0, i] = (g11 * data[n, 12 + 2 * i] - g01 * data[n, 13 + 2 * i]) / det
        P[1, i] = (g00 * data[n, 13 + 2 * i] - g01 * data[n, 12 + 2 * i]) / det
    ax, ay, az = data[n, 0], data[n, 1], data[n, 2]
    depth = 0.0
    e[0], e[1], m00, m01, m10, m11 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        h0, h1, h2 = H[3 * i], H[3 * i + 1], H[3 * i + 2]
        y = h0 * ax + h1 * ay + h2 * az
        depth += data[n, 3 + i] * y
        e[0] += P[0, i] * y
        e[1] += P[1, i] * y
        c0 = h0 * data[n, 6] + h1 * data[n, 8] + h2 * data[n, 10]
        c1 = h0 * data[n, 7] + h1 * data[n, 9] + h2 * data[n, 11]
        m00 += P[0, i] * c0
        m01 += P[0, i] * c1
        m10 += P[1, i] * c0
        m11 += P[1, i] * c1
    square = depth * depth + 1e-300
    L[0] = math.sqrt(1.0 + (m00 * m00 + m01 * m01) / square)
    L[1] = (m00 * m10 + m01 * m11) / (square * L[0])
    L[2] = math.sqrt(1.0 + (m10 * m10 + m11 * m11) / square - L[1] * L[1])
    e[0] /= depth * L[0]
    e[1] = (e[1] / depth - L[1] * e[0]) / L[2]
    return depth


@kernel(types.void(f2, f1, w1))
def homography_residuals(data, H, out):
    """Fill out (N,) with squared Sampson distances to H (9,), in standard deviations."""
    P, e, L = np.empty((2, 3)), np.empty(2), np.empty(3)
    for n in range(data.shape[0]):
        depth = whitened(data, n, H, P, e, L)
        out[n] = e[0] * e[0] + e[1] * e[1] if depth > 0.0 else BEHIND


@inlined
def matrix_and_directions(kind, p, basis, H, D):
    """Fill H (9,) of parameters p, and how it moves along their tangent, D (9, 9)."""
    if kind == 9:
        for i in range(9):
            H[i] = p[i]
            for j in range(9):
                D[i, j] = 1.0 if i == j else 0.0
        return
    for i in range(3):
        x, y, z = p[3 * i], p[3 * i + 1], p[3 * i + 2]
        H[3 * i], H[3 * i + 1], H[3 * i + 2] = x, y, z
        D[0, 3 * i], D[0, 3 * i + 1], D[0, 3 * i + 2] = 0.0, z, -y
        D[1, 3 * i], D[1, 3 * i + 1], D[1, 3 * i + 2] = -z, 0.0, x
        D[2, 3 * i], D[2, 3 * i + 1], D[2, 3 * i + 2] = y, -x, 0.0
    if kind == 8:
        tangent_basis(p[9:12], basis)
        for i in range(3):
            for j in range(3):
                H[3 * i + j] += p[9 + i] * p[12 + j]
                D[3, 3 * i + j] = basis[0, i] * p[12 + j]
                D[4, 3 * i + j] = basis[1, i] * p[12 + j]
                for k in range(3):
                    D[5 + k, 3 * i + j] = p[9 + i] if j == k else 0.0


@inlined
def normal_equations(data, weights, loss, scale, kind, p, basis, M, g):
    """Fill M (k, k) and g (k,) of a homography's parameters; gives its robust cost."""
    H, D, rows = np.empty(9), np.empty((9, 9)), np.empty((2, 9))
    P, e, L = np.empty((2, 3)), np.empty(2), np.empty(3)
    matrix_and_directions(kind, p, basis, H, D)
    M[:, :] = 0.0
    g[:] = 0.0
    total = 0.0
    for n in range(data.shape[0]):
        if not weights[n] > 0.0:
            continue
        depth = whitened(data, n, H, P, e, L)
        cost, weight = loss_of(loss, scale, e[0] * e[0] + e[1] * e[1] if depth > 0.0 else BEHIND)
        total += weights[n] * cost
        weight *= weights[n]
        if weight == 0.0 or not depth > 0.0:
            continue
        e0, e1 = e[0] * L[0], L[1] * e[0] + L[2] * e[1]
        for k in range(kind):
            d0, d1, along = 0.0, 0.0, 0.0
            for i in range(3):
                dy = D[k, 3 * i] * data[n, 0] + D[k, 3 * i + 1] * data[n, 1] + D[k, 3 * i + 2] * data[n, 2]
                d0 += P[0, i] * dy
                d1 += P[1, i] * dy
                along += data[n, 3 + i] * dy
            d0, d1 = (d0 - e0 * along) / depth, (d1 - e1 * along) / depth
            rows[0, k] = d0 / L[0]
            rows[1, k] = (d1 - L[1] * rows[0, k]) / L[2]
            g[k] += weight * (rows[0, k] * e[0] + rows[1, k] * e[1])
            for j in range(k + 1):
                M[k, j] += weight * (rows[0, k] * rows[0, j] + rows[1, k] * rows[1, j])
    if kind == 9:  # the scale of H is free: hold it
        trace = 0.0
        for k in range(9):
            trace += M[k, k]
        for k in range(9):
            for j in range(k + 1):
                M[k, j] += trace * H[k] * H[j]
    for k in range(kind):
        for j in range(k):
            M[j, k] = M[k, j]
    return total


@inlined
def moved(kind, p, basis, step, ahead):
    """Fill the parameters after a step along their tangent."""
    norm = 0.0
    if kind == 9:
        for i in range(9):
            ahead[i] = p[i] + step[i]
            norm += ahead[i] ** 2
        for i in range(9):
            ahead[i] /= math.sqrt(norm)
        return
    R, turned = np.empty((3, 3)), np.empty((3, 3))
    for i in range(9):
        R[i // 3, i % 3] = p[i]
    rotate_right(R, step[0], step[1], step[2], turned)
    for i in range(9):
        ahead[i] = turned[i // 3, i % 3]
    if kind == 8:
        size = math.sqrt(step[3] ** 2 + step[4] ** 2)
        along, across = math.cos(size), math.sin(size) / size if size > 1e-12 else 1.0
        for i in range(3):
            ahead[9 + i] = along * p[9 + i] + across * (step[3] * basis[0, i] + step[4] * basis[1, i])
            ahead[12 + i] = p[12 + i] + step[5 + i]
            norm += ahead[9 + i] ** 2
        for i in range(3):
            ahead[9 + i] /= math.sqrt(norm)


@kernel(types.Tuple((f0, i0))(f2, f1, i0, f0, i0, i0, w1, w2))
def refine_homography(data, weights, loss, scale, iterations_max, kind, p, M):
    """Improve a homography's parameters p in place: Levenberg-Marquardt on Sampson distances.

    `loss` and `scale` are those of `refine_essential`; `kind` is 3, 8 or 9, the number of tangent directions.
    Fills the information M (kind, kind); gives the cost and the iterations.
    """
    g, g2, M2, L = np.zeros(kind), np.zeros(kind), np.empty((kind, kind)), np.zeros((kind, kind))
    step, ahead, basis = np.zeros(kind), p.copy(), np.zeros((2, 3))
    basis2 = np.zeros((2, 3))
    cost = normal_equations(data, weights, loss, scale, kind, p, basis, M, g)
    damping, iteration = 1e-4, 0
    while iteration < iterations_max:
        iteration += 1
        if math.isnan(cholesky(M, 0, damping, L)):
            damping *= 10.0
            if damping > 1e10:
                break
            continue
        solve(L, g, 0, step)
        fall = 0.0
        for i in range(kind):
            fall -= step[i] * g[i]
        moved(kind, p, basis, step, ahead)
        cost_ahead = normal_equations(data, weights, loss, scale, kind, ahead, basis2, M2, g2)
        if cost_ahead <= cost:
            p[:], M[:, :], g[:], basis[:, :] = ahead, M2, g2, basis2
            cost = cost_ahead
            damping = max(0.1 * damping, 1e-12)
        else:
            damping *= 10.0
        if fall <= 1e-10 * (1.0 + cost) or damping > 1e10:
            break
    return cost, iteration
