"""A fundamental matrix's functions for the robust loop: seven points, Sampson errors, a least-squares step.

Rows of data are (x, y, u, v), both images centred and divided by one scale; a model F is (9,) row by row, of
unit norm and rank 2, with (u, v, 1) F (x, y, 1)ᵀ = 0.  The error is Sampson's distance (Hartley, Zisserman
2004, section 11.4.3): to first order the distance from the nearest exact match, in units of the data.
"""

from __future__ import annotations

import math

import numpy as np
from numba import carray

from vision3d.kernels import entry, inlined, kernel
from vision3d.kernels.arrays import b0, f1, f2, w1, w2
from vision3d.kernels.plane_pose import cholesky, solve
from vision3d.kernels.robust_calls import FIT, RESIDUALS, SOLVE

__all__ = ["fundamental_fit", "fundamental_residuals", "fundamental_solve", "normal_equations", "to_rank_two"]

SINGULAR = 1e-10
REAL = 1e-9


@inlined
def null_space(A, order, N):
    """Fill N (2, 9) with a basis of what A (7, 9) takes to 0; false where that is more.  A is overwritten."""
    for j in range(9):
        order[j] = j
    first = 0.0
    for r in range(7):
        best, row, column = 0.0, r, r
        for i in range(r, 7):
            for j in range(r, 9):
                if abs(A[i, j]) > best:
                    best, row, column = abs(A[i, j]), i, j
        first = max(first, best)
        if not best > SINGULAR * first:
            return False
        for j in range(9):
            A[r, j], A[row, j] = A[row, j], A[r, j]
        for i in range(7):
            A[i, r], A[i, column] = A[i, column], A[i, r]
        order[r], order[column] = order[column], order[r]
        for i in range(7):
            if i != r:
                factor = A[i, r] / A[r, r]
                for j in range(r, 9):
                    A[i, j] -= factor * A[r, j]
    for f in range(2):
        size = 1.0
        for r in range(7):
            N[f, order[r]] = -A[r, 7 + f] / A[r, r]
            size += N[f, order[r]] ** 2
        N[f, order[7 + f]], N[f, order[8 - f]] = 1.0, 0.0
        for j in range(9):
            N[f, j] /= math.sqrt(size)
    return True


@inlined
def determinant(F):
    """Of a matrix (9,) row by row."""
    return (
        F[0] * (F[4] * F[8] - F[5] * F[7])
        - F[1] * (F[3] * F[8] - F[5] * F[6])
        + F[2] * (F[3] * F[7] - F[4] * F[6])
    )


@inlined
def cofactors(F, C):
    """Fill C (9,): the derivative of the determinant by the elements."""
    for i in range(3):
        a, b = 3 * ((i + 1) % 3), 3 * ((i + 2) % 3)
        for j in range(3):
            c, d = (j + 1) % 3, (j + 2) % 3
            C[3 * i + j] = F[a + c] * F[b + d] - F[a + d] * F[b + c]


@inlined
def to_rank_two(F, C):
    """Move F (9,) to a near matrix of determinant 0, by Newton's steps, and to unit norm; fills C (9,)."""
    for _ in range(3):
        cofactors(F, C)
        size = 0.0
        for e in range(9):
            size += C[e] * C[e]
        if not size > 0.0:
            break
        off = determinant(F) / size
        for e in range(9):
            F[e] -= off * C[e]
    norm = 0.0
    for e in range(9):
        norm += F[e] * F[e]
    for e in range(9):
        F[e] /= math.sqrt(norm)
    cofactors(F, C)


@inlined
def cubic_roots(a, b, c, d, roots):
    """Fill roots with the real ones of a x³ + b x² + c x + d; returns how many."""
    if abs(a) < REAL * max(abs(b), abs(c), abs(d)):
        if abs(b) < REAL * max(abs(c), abs(d)):
            roots[0] = -d / c
            return 1
        inside = c * c - 4.0 * b * d
        if inside < 0.0:
            return 0
        q = -0.5 * (c + math.copysign(math.sqrt(inside), c))
        roots[0], roots[1] = q / b, d / q if q != 0.0 else 0.0
        return 2
    b, c, d = b / a, c / a, d / a
    q, r = (b * b - 3.0 * c) / 9.0, (2.0 * b * b * b - 9.0 * b * c + 27.0 * d) / 54.0
    count = 1
    if r * r < q * q * q:
        angle = math.acos(r / math.sqrt(q * q * q))
        for i in range(3):
            roots[i] = -2.0 * math.sqrt(q) * math.cos((angle + 2.0 * math.pi * i) / 3.0) - b / 3.0
        count = 3
    else:
        s = -math.copysign((abs(r) + math.sqrt(r * r - q * q * q)) ** (1.0 / 3.0), r)
        roots[0] = s + (q / s if s != 0.0 else 0.0) - b / 3.0
    for i in range(count):
        for _ in range(2):  # the closed form loses digits; Newton finds them again
            x = roots[i]
            slope = (3.0 * x + 2.0 * b) * x + c
            if slope != 0.0:
                roots[i] = x - (((x + b) * x + c) * x + d) / slope
    return count


@inlined
def oriented(data, s, F):
    """Whether all points of the sample lie before both cameras, or all behind (Chum, Werner, Matas 2004)."""
    # the epipole of the second image: the cross product of two columns of F
    ex, ey, ez = F[3] * F[7] - F[6] * F[4], F[6] * F[1] - F[0] * F[7], F[0] * F[4] - F[3] * F[1]
    if ex * ex + ey * ey + ez * ez < 1e-18:
        ex, ey, ez = F[3] * F[8] - F[6] * F[5], F[6] * F[2] - F[0] * F[8], F[0] * F[5] - F[3] * F[2]
    side = 0.0
    for i in range(s.shape[0]):
        x, y, u, v = data[s[i], 0], data[s[i], 1], data[s[i], 2], data[s[i], 3]
        lx, ly = F[0] * x + F[1] * y + F[2], F[3] * x + F[4] * y + F[5]
        lz = F[6] * x + F[7] * y + F[8]
        sign = (ey - ez * v) * lx + (ez * u - ex) * ly + (ex * v - ey * u) * lz
        if side * sign < 0.0:
            return False
        side = sign
    return True


@entry(SOLVE)
def fundamental_solve(address, n, k, chosen, filled):
    """The one to three fundamental matrices of seven points (Hartley, Zisserman 2004, section 11.1.2)."""
    data, s, out = carray(address, (n, 4)), carray(chosen, (7,)), carray(filled, (3, 9))
    A, N, C, order, roots = (
        np.empty((7, 9)),
        np.empty((2, 9)),
        np.empty(9),
        np.empty(9, np.int64),
        np.empty(3),
    )
    for i in range(7):
        x, y, u, v = data[s[i], 0], data[s[i], 1], data[s[i], 2], data[s[i], 3]
        A[i, 0], A[i, 1], A[i, 2] = u * x, u * y, u
        A[i, 3], A[i, 4], A[i, 5] = v * x, v * y, v
        A[i, 6], A[i, 7], A[i, 8] = x, y, 1.0
    if not null_space(A, order, N):
        return 0
    # det(N0 + t N1) is a cubic in t: its ends, and a derivative at each end
    F, G = N[0], N[1]
    a, d, b, c = determinant(G), determinant(F), 0.0, 0.0
    cofactors(F, C)
    for e in range(9):
        c += C[e] * G[e]
    cofactors(G, C)
    for e in range(9):
        b += C[e] * F[e]
    count = 0
    for i in range(cubic_roots(a, b, c, d, roots)):
        size = 0.0
        for e in range(9):
            out[count, e] = F[e] + roots[i] * G[e]
            size += out[count, e] ** 2
        for e in range(9):
            out[count, e] /= math.sqrt(size)
        count += 1 if size < math.inf and oriented(data, s, out[count]) else 0
    return count


@entry(RESIDUALS)
def fundamental_residuals(address, n, k, model, filled):
    """Squared Sampson distances."""
    data, F, errors = carray(address, (n, 4)), carray(model, (9,)), carray(filled, (n,))
    f0, f1, f2, f3, f4, f5, f6, f7, f8 = F[0], F[1], F[2], F[3], F[4], F[5], F[6], F[7], F[8]
    for i in range(n):
        x, y, u, v = data[i, 0], data[i, 1], data[i, 2], data[i, 3]
        lx, ly = f0 * x + f1 * y + f2, f3 * x + f4 * y + f5
        mx, my = f0 * u + f3 * v + f6, f1 * u + f4 * v + f7
        e = u * lx + v * ly + f6 * x + f7 * y + f8
        errors[i] = e * e / (lx * lx + ly * ly + mx * mx + my * my)
    return 1


@kernel(b0(f2, f1, f1, w2, w1), inline="never")
def normal_equations(data, weights, F, N, g):
    """Fill N (9, 9) and g (9,) of the weighted Sampson distances; false for fewer than seven points."""
    N[:], g[:] = 0.0, 0.0
    J, points = np.empty(9), 0
    for i in range(data.shape[0]):
        w = weights[i]
        if not w > 0.0:
            continue
        points += 1
        x, y, u, v = data[i, 0], data[i, 1], data[i, 2], data[i, 3]
        lx, ly = F[0] * x + F[1] * y + F[2], F[3] * x + F[4] * y + F[5]
        mx, my = F[0] * u + F[3] * v + F[6], F[1] * u + F[4] * v + F[7]
        e = u * lx + v * ly + F[6] * x + F[7] * y + F[8]
        size = max(lx * lx + ly * ly + mx * mx + my * my, 1e-300)
        root = 1.0 / math.sqrt(size)
        off = e / size
        a, b = u - off * lx, v - off * ly
        # derivative of e / √size: each element of F enters e, and size through lx, ly, mx or my
        J[0], J[1], J[2] = a * x - off * mx * u, a * y - off * my * u, a
        J[3], J[4], J[5] = b * x - off * mx * v, b * y - off * my * v, b
        J[6], J[7], J[8] = x - off * mx, y - off * my, 1.0
        r = w * e * root * root
        w *= root * root
        for p in range(9):
            g[p] += r * J[p]
            h = w * J[p]
            for q in range(p + 1):
                N[p, q] += h * J[q]
    for p in range(9):
        for q in range(p):
            N[q, p] = N[p, q]
    return points >= 7


@inlined
def hold(N, g, q):
    """Take the direction q (of unit norm) out of the equations: no step goes along it."""
    s, n, mean, along = np.zeros(9), 0.0, 0.0, 0.0
    for i in range(9):
        along += q[i] * g[i]
        mean += N[i, i] / 9.0
        for j in range(9):
            s[i] += N[i, j] * q[j]
    for i in range(9):
        n += s[i] * q[i]
        g[i] -= along * q[i]
    for i in range(9):
        for j in range(9):
            N[i, j] += (n + mean) * q[i] * q[j] - s[i] * q[j] - q[i] * s[j]


@entry(FIT)
def fundamental_fit(address, n, k, weight, model):
    """One Gauss-Newton step of the weighted squared Sampson distances, within unit norm and rank 2."""
    data, weights, F = carray(address, (n, 4)), carray(weight, (n,)), carray(model, (9,))
    N, L, g, step, C = np.empty((9, 9)), np.empty((9, 9)), np.empty(9), np.empty(9), np.empty(9)
    to_rank_two(F, C)
    if not normal_equations(data, weights, F, N, g):
        return 0
    size = 0.0
    for e in range(9):
        size += C[e] * C[e]
    for e in range(9):
        C[e] /= math.sqrt(size)
    hold(N, g, F)
    hold(N, g, C)
    if math.isnan(cholesky(N, 0, 0.0, L)):
        return 0
    solve(L, g, 0, step)
    for e in range(9):
        F[e] += step[e]
    to_rank_two(F, C)
    return 1
