"""A homography's functions for the robust loop: four points, transfer errors, a least-squares step.

Rows of data are (x, y, u, v): a point and where it is seen in the other image, both centred and of about unit
size; a model is (9,) row by row, of unit norm and with a positive third coordinate where it was fitted.  The
error is the distance between (u, v) and the point carried over (Hartley, Zisserman 2004, section 4.2.2).
"""

from __future__ import annotations

import math

import numpy as np
from numba import carray

from vision3d.kernels import entry, inlined, kernel
from vision3d.kernels.arrays import b0, f1, f2, w1, w2
from vision3d.kernels.plane_pose import cholesky, solve
from vision3d.kernels.robust_calls import FIT, RESIDUALS, SOLVE

__all__ = ["homography_fit", "homography_residuals", "homography_solve", "normal_equations", "unit_step"]

FLAT = 1e-5  # twice the area of a triangle that is taken for a line
FAR = 1e30


@inlined
def fill_block(N, row, column, sign, xx, xy, yy, x, y, one):
    """Fill a symmetric block (3, 3) of N from sums of products of coordinates."""
    N[row, column], N[row, column + 1], N[row, column + 2] = sign * xx, sign * xy, sign * x
    N[row + 1, column], N[row + 1, column + 1], N[row + 1, column + 2] = sign * xy, sign * yy, sign * y
    N[row + 2, column], N[row + 2, column + 1], N[row + 2, column + 2] = sign * x, sign * y, sign * one


@inlined
def area(data, a, b, c, column):
    """Twice the signed area of three points."""
    x, y = data[a, column], data[a, column + 1]
    bx, by = data[b, column] - x, data[b, column + 1] - y
    return bx * (data[c, column + 1] - y) - by * (data[c, column] - x)


@entry(SOLVE)
def homography_solve(address, n, k, chosen, filled):
    """The homography of four points; none where three of them are on a line or its sides would differ.

    H = Σ q_i (d'_i / d_i) (p_j × p_k)ᵀ over the first three, with d_i the area of p_4, p_j, p_k.
    """
    data, s, H = carray(address, (n, k)), carray(chosen, (4,)), carray(filled, (9,))
    whole, whole_b = area(data, s[0], s[1], s[2], 0), area(data, s[0], s[1], s[2], 2)
    if not (abs(whole) > FLAT and abs(whole_b) > FLAT):
        return 0
    side = math.copysign(1.0, whole * whole_b)
    for e in range(9):
        H[e] = 0.0
    for i in range(3):
        j, l = s[(i + 1) % 3], s[(i + 2) % 3]
        part, part_b = area(data, s[3], j, l, 0), area(data, s[3], j, l, 2)
        if not (abs(part) > FLAT and part * part_b * side > FLAT * FLAT):
            return 0
        weight = part_b / part * math.copysign(1.0, whole)
        x, y = data[j, 1] - data[l, 1], data[l, 0] - data[j, 0]
        z = data[j, 0] * data[l, 1] - data[j, 1] * data[l, 0]
        u, v = weight * data[s[i], 2], weight * data[s[i], 3]
        H[0] += u * x
        H[1] += u * y
        H[2] += u * z
        H[3] += v * x
        H[4] += v * y
        H[5] += v * z
        H[6] += weight * x
        H[7] += weight * y
        H[8] += weight * z
    # the third coordinate of point i is weight_i · whole: of one sign by the checks above, made positive here
    scale = 0.0
    for e in range(9):
        scale += H[e] * H[e]
    scale = side / math.sqrt(scale)
    for e in range(9):
        H[e] *= scale
    return 1


@entry(RESIDUALS)
def homography_residuals(address, n, k, model, filled):
    """Squared distances in the second image; huge for points that come to lie behind it."""
    data, H, errors = carray(address, (n, 4)), carray(model, (9,)), carray(filled, (n,))
    h0, h1, h2, h3, h4, h5, h6, h7, h8 = H[0], H[1], H[2], H[3], H[4], H[5], H[6], H[7], H[8]
    for i in range(n):
        x, y = data[i, 0], data[i, 1]
        w = h6 * x + h7 * y + h8
        a = (h0 * x + h1 * y + h2) / w - data[i, 2]
        b = (h3 * x + h4 * y + h5) / w - data[i, 3]
        errors[i] = a * a + b * b if w > 0.0 else FAR
    return 1


@kernel(b0(f2, f1, f1, w2, w1), fastmath={"reassoc", "contract", "nsz"}, inline="never")
def normal_equations(data, weights, H, N, g):
    """Fill N (9, 9) and g (9,) of the weighted transfer errors; false for fewer than four points.

    N is made of sums of (1, u, v, u² + v²) p pᵀ / w² over points p, seen at (u, v): 24 numbers.
    """
    a0 = a1 = a2 = a3 = a4 = a5 = b0 = b1 = b2 = b3 = b4 = b5 = 0.0
    c0 = c1 = c2 = c3 = c4 = c5 = d0 = d1 = d2 = d3 = d4 = d5 = 0.0
    g0 = g1 = g2 = g3 = g4 = g5 = g6 = g7 = g8 = 0.0
    h0, h1, h2, h3, h4, h5, h6, h7, h8 = H[0], H[1], H[2], H[3], H[4], H[5], H[6], H[7], H[8]
    points = 0
    for i in range(data.shape[0]):
        x, y = data[i, 0], data[i, 1]
        part = weights[i] > 0.0
        points += 1 if part else 0
        w = 1.0 / (h6 * x + h7 * y + h8 if part else 1.0)
        u, v = (h0 * x + h1 * y + h2) * w, (h3 * x + h4 * y + h5) * w
        z = weights[i] * w
        a, b = z * (u - data[i, 2]), z * (v - data[i, 3])
        c = u * a + v * b
        z *= w
        zx, zy, r = z * x, z * y, u * u + v * v
        xx, xy, yy = zx * x, zx * y, zy * y
        a0 += xx
        a1 += xy
        a2 += yy
        a3 += zx
        a4 += zy
        a5 += z
        b0 += u * xx
        b1 += u * xy
        b2 += u * yy
        b3 += u * zx
        b4 += u * zy
        b5 += u * z
        c0 += v * xx
        c1 += v * xy
        c2 += v * yy
        c3 += v * zx
        c4 += v * zy
        c5 += v * z
        d0 += r * xx
        d1 += r * xy
        d2 += r * yy
        d3 += r * zx
        d4 += r * zy
        d5 += r * z
        g0 += a * x
        g1 += a * y
        g2 += a
        g3 += b * x
        g4 += b * y
        g5 += b
        g6 -= c * x
        g7 -= c * y
        g8 -= c
    N[:] = 0.0
    fill_block(N, 0, 0, 1.0, a0, a1, a2, a3, a4, a5)
    fill_block(N, 3, 3, 1.0, a0, a1, a2, a3, a4, a5)
    fill_block(N, 6, 0, -1.0, b0, b1, b2, b3, b4, b5)
    fill_block(N, 0, 6, -1.0, b0, b1, b2, b3, b4, b5)
    fill_block(N, 6, 3, -1.0, c0, c1, c2, c3, c4, c5)
    fill_block(N, 3, 6, -1.0, c0, c1, c2, c3, c4, c5)
    fill_block(N, 6, 6, 1.0, d0, d1, d2, d3, d4, d5)
    g[0], g[1], g[2], g[3], g[4], g[5], g[6], g[7], g[8] = g0, g1, g2, g3, g4, g5, g6, g7, g8
    return points >= 4


@inlined
def fix_scale(N, H):
    """Add weight along H itself, in which the errors do not change."""
    mean = 0.0
    for e in range(9):
        mean += N[e, e] / 9.0
    for row in range(9):
        for column in range(9):
            N[row, column] += mean * H[row] * H[column]


@inlined
def unit_step(N, g, H):
    """Solve the normal equations and step, at right angles to the scale of H; false where singular."""
    L, step = np.empty((9, 9)), np.empty(9)
    fix_scale(N, H)
    if math.isnan(cholesky(N, 0, 0.0, L)):
        return False
    solve(L, g, 0, step)
    size = 0.0
    for e in range(9):
        step[e] += H[e]
        size += step[e] * step[e]
    for e in range(9):
        H[e] = step[e] / math.sqrt(size)
    return True


@entry(FIT)
def homography_fit(address, n, k, weight, model):
    """One Gauss-Newton step of the weighted squared transfer errors."""
    data, weights, H = carray(address, (n, 4)), carray(weight, (n,)), carray(model, (9,))
    N, g = np.empty((9, 9)), np.empty(9)
    return 1 if normal_equations(data, weights, H, N, g) and unit_step(N, g, H) else 0
