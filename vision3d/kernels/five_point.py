"""Essential matrices of five pairs of rays: Nistér 2004, "An efficient solution to the five-point problem".

Of the ten cubics of `essential_cubics` elimination leaves three, linear in x and y with polynomials in z for
coefficients, whose determinant has degree ten in z.  Each root is polished by Gauss-Newton steps on all ten
cubics, where the elimination has lost digits.
"""

from __future__ import annotations

import math

import numpy as np

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import f2, i0, i1, w2
from vision3d.kernels.essential_cubics import constraints, null_space, polished
from vision3d.kernels.polynomials import roots_of

__all__ = ["solve_essential", "solve_five_point"]

POLISH_ABOVE = 1e-13
ESSENTIAL_WITHIN = 1e-6


@inlined
def eliminate(C):
    """Make the first ten columns of C (10, 20) the identity from row 4 on; False where they are singular."""
    for k in range(10):
        pivot = k
        for i in range(k + 1, 10):
            if abs(C[i, k]) > abs(C[pivot, k]):
                pivot = i
        if not abs(C[pivot, k]) > 1e-14:
            return False
        for j in range(k, 20):
            C[k, j], C[pivot, j] = C[pivot, j], C[k, j]
        inverse = 1.0 / C[k, k]
        for j in range(k, 20):
            C[k, j] *= inverse
        for i in range(4 if k >= 4 else k + 1, 10):
            factor = C[i, k]
            if i != k and factor != 0.0:
                for j in range(k, 20):
                    C[i, j] -= factor * C[k, j]
    return True


@inlined
def multiply_add(a, na, b, nb, factor, out):
    """Add to `out` the product of polynomials a and b of degrees na and nb."""
    for i in range(na + 1):
        for j in range(nb + 1):
            out[i + j] += factor * a[i] * b[j]


@inlined
def pencil(C, X, Y, W, p):
    """Fill the rows X, Y (3, 4), W (3, 5) linear in x, y, 1, and their determinant p (11,), all in z."""
    for r in range(3):
        e, f = 4 + 2 * r, 5 + 2 * r
        for B, first in ((X, 10), (Y, 13)):
            B[r, 0], B[r, 3] = C[e, first + 2], -C[f, first]
            B[r, 1] = C[e, first + 1] - C[f, first + 2]
            B[r, 2] = C[e, first] - C[f, first + 1]
        W[r, 0], W[r, 4] = C[e, 19], -C[f, 16]
        for i in range(1, 4):
            W[r, i] = C[e, 19 - i] - C[f, 20 - i]
    p[:] = 0.0
    minor = np.empty(7)
    for r in range(3):
        a, b = (r + 1) % 3, (r + 2) % 3
        minor[:] = 0.0
        multiply_add(X[a], 3, Y[b], 3, 1.0, minor)
        multiply_add(Y[a], 3, X[b], 3, -1.0, minor)
        multiply_add(minor, 6, W[r], 4, 1.0, p)


@inlined
def cross_rows(X, Y, W, z, point):
    """Fill x and y of the root z: two of the three rows give them, the pair with the largest determinant."""
    best = 0.0
    for r in range(3):
        s = (r + 1) % 3
        a = ((X[r, 3] * z + X[r, 2]) * z + X[r, 1]) * z + X[r, 0]
        b = ((Y[r, 3] * z + Y[r, 2]) * z + Y[r, 1]) * z + Y[r, 0]
        c = (((W[r, 4] * z + W[r, 3]) * z + W[r, 2]) * z + W[r, 1]) * z + W[r, 0]
        d = ((X[s, 3] * z + X[s, 2]) * z + X[s, 1]) * z + X[s, 0]
        e = ((Y[s, 3] * z + Y[s, 2]) * z + Y[s, 1]) * z + Y[s, 0]
        f = (((W[s, 4] * z + W[s, 3]) * z + W[s, 2]) * z + W[s, 1]) * z + W[s, 0]
        across = a * e - b * d
        if abs(across) > best:
            best = abs(across)
            point[0], point[1] = (b * f - c * e) / across, (c * d - a * f) / across
    point[2] = z
    return best > 0.0


@inlined
def essential_at(basis, v, E):
    """Fill E (9,) from its coordinates, of Frobenius norm √2; gives how far it is from essential."""
    norm = 0.0
    for i in range(9):
        E[i] = v[0] * basis[0, i] + v[1] * basis[1, i] + v[2] * basis[2, i] + basis[3, i]
        norm += E[i] * E[i]
    scale = math.sqrt(2.0 / norm)
    for i in range(9):
        E[i] *= scale
    # with two singular values 1 and one 0, E E' E = E
    worst = 0.0
    for i in range(3):
        a = E[3 * i] * E[0] + E[3 * i + 1] * E[1] + E[3 * i + 2] * E[2]
        b = E[3 * i] * E[3] + E[3 * i + 1] * E[4] + E[3 * i + 2] * E[5]
        c = E[3 * i] * E[6] + E[3 * i + 1] * E[7] + E[3 * i + 2] * E[8]
        for j in range(3):
            worst = max(worst, abs(a * E[j] + b * E[3 + j] + c * E[6 + j] - E[3 * i + j]))
    return worst


def solve_essential(data, sample, out):
    """Fill out (S, 9) with the essential matrices of five pairs of rays, row by row; gives their number.

    `data` (N, 6 or more) begins with the rays a and b of a pair, b' E a = 0; `sample` (5,) are rows of it;
    S >= 10.  Matrices have Frobenius norm √2.
    """
    Q, basis = np.empty((5, 9)), np.empty((4, 9))
    for k in range(5):
        n = sample[k]
        for i in range(3):
            for j in range(3):
                Q[k, 3 * i + j] = data[n, 3 + i] * data[n, j]
    null_space(Q, basis)
    C, reduced = np.empty((10, 20)), np.empty((10, 20))
    constraints(basis, C)
    reduced[:, :] = C
    if not eliminate(reduced):
        return 0
    X, Y, W, p = np.empty((3, 4)), np.empty((3, 4)), np.empty((3, 5)), np.empty(11)
    pencil(reduced, X, Y, W, p)
    roots, table, ends, some = np.empty(10), np.zeros((11, 11)), np.empty(12), np.empty(10)
    found = roots_of(p, 10, table, ends, some, roots)
    v, before, powers, count = np.empty(3), np.empty(3), np.empty((3, 4)), 0
    for k in range(found):
        if not cross_rows(X, Y, W, roots[k], v):
            continue
        off = essential_at(basis, v, out[count])
        for _ in range(2):
            if off <= POLISH_ABOVE:
                break
            before[:] = v
            better = polished(C, v, powers) and essential_at(basis, v, out[count]) < off
            if not better:
                v[:] = before
            off = essential_at(basis, v, out[count])
            if not better:
                break
        if off < ESSENTIAL_WITHIN:
            count += 1
    return count


solve_five_point = kernel((i0)(f2, i1, w2))(solve_essential)
