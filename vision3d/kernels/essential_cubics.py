"""The cubics that five pairs of rays and the essential constraints leave.

Five equations b' E a = 0 leave E = x X + y Y + z Z + W.  That E has two equal singular values and a zero
one is ten cubics in x, y, z: det E = 0 and 2 E E' E = tr(E E') E.

Monomials of degree three are in Nistér's order: x³ y³ x²y xy² x²z x² y²z y² xyz xy, then xz² xz x, yz² yz y,
z³ z² z 1; of degree two: x² xy y² xz yz z² x y z 1.
"""

from __future__ import annotations

import math

import numpy as np

from vision3d.kernels import inlined, kernel

__all__ = ["constraints", "null_space", "polished"]

QUADRATIC = np.array([[0, 1, 3, 6], [1, 2, 4, 7], [3, 4, 5, 8], [6, 7, 8, 9]])
"""Which monomial of degree two the product of two of (x, y, z, 1) is."""
CUBIC = np.array(
    [
        [0, 2, 4, 5], [2, 3, 8, 9], [3, 1, 6, 7], [4, 8, 10, 11], [8, 6, 13, 14],
        [10, 13, 16, 17], [5, 9, 11, 12], [9, 7, 14, 15], [11, 14, 17, 18], [12, 15, 18, 19],
    ]
)  # fmt: skip
"""Which monomial of degree three the product of one of degree two and one of (x, y, z, 1) is."""
POWERS = np.array(
    [
        [3, 0, 0], [0, 3, 0], [2, 1, 0], [1, 2, 0], [2, 0, 1], [2, 0, 0], [0, 2, 1], [0, 2, 0], [1, 1, 1],
        [1, 1, 0], [1, 0, 2], [1, 0, 1], [1, 0, 0], [0, 1, 2], [0, 1, 1], [0, 1, 0], [0, 0, 3], [0, 0, 2],
        [0, 0, 1], [0, 0, 0],
    ]
)  # fmt: skip
"""Exponents of x, y, z."""


@inlined
def null_space(Q, basis):
    """Fill basis (4, 9), orthonormal, with what the rows of Q (5, 9) leave: Householder's QR of Q'."""
    for k in range(5):
        norm = 0.0
        for i in range(k, 9):
            norm += Q[k, i] * Q[k, i]
        norm = math.copysign(math.sqrt(norm), Q[k, k])
        Q[k, k] += norm
        size = 0.0
        for i in range(k, 9):
            size += Q[k, i] * Q[k, i]
        scale = 2.0 / size if size > 0.0 else 0.0
        for j in range(k + 1, 5):
            dot = 0.0
            for i in range(k, 9):
                dot += Q[k, i] * Q[j, i]
            for i in range(k, 9):
                Q[j, i] -= scale * dot * Q[k, i]
    for v in range(4):
        for i in range(9):
            basis[v, i] = 1.0 if i == 5 + v else 0.0
        for k in range(4, -1, -1):
            size, dot = 0.0, 0.0
            for i in range(k, 9):
                size += Q[k, i] * Q[k, i]
                dot += Q[k, i] * basis[v, i]
            scale = 2.0 * dot / size if size > 0.0 else 0.0
            for i in range(k, 9):
                basis[v, i] -= scale * Q[k, i]


@inlined
def times_linear(E, i, j, quadratic, factor, row):
    """Add to `row` (20,) the product of entry E[i, j], linear, and a quadratic (10,)."""
    for m in range(10):
        for v in range(4):
            row[CUBIC[m, v]] += factor * quadratic[m] * E[v, 3 * i + j]


@inlined
def add_product(E, i, j, k, m, factor, quadratic):
    """Add to `quadratic` (10,) the product of entries E[i, j] and E[k, m]."""
    for u in range(4):
        for v in range(4):
            quadratic[QUADRATIC[u, v]] += factor * E[u, 3 * i + j] * E[v, 3 * k + m]


@kernel("void(f8[:,::1], f8[:,::1])")
def constraints(E, C):
    """Fill C (10, 20) with the cubics that make E (4, 9 coefficients of x, y, z, 1) essential."""
    C[:, :] = 0.0
    products = np.zeros((3, 3, 10))
    for i in range(3):
        for k in range(i, 3):
            for j in range(3):
                add_product(E, i, j, k, j, 1.0, products[i, k])
            products[k, i] = products[i, k]
    half_trace = 0.5 * (products[0, 0] + products[1, 1] + products[2, 2])
    for i in range(3):
        for m in range(10):
            products[i, i, m] -= half_trace[m]
    for i in range(3):
        for j in range(3):
            for k in range(3):
                times_linear(E, k, j, products[i, k], 1.0, C[3 * i + j])
    minor = np.empty(10)
    for j in range(3):
        a, b = (j + 1) % 3, (j + 2) % 3
        minor[:] = 0.0
        add_product(E, 1, a, 2, b, 1.0, minor)
        add_product(E, 1, b, 2, a, -1.0, minor)
        times_linear(E, 0, j, minor, 1.0, C[9])


@inlined
def polished(C, v, powers):
    """Move v = (x, y, z) by one Gauss-Newton step on the cubics C (10, 20); False where it has no step."""
    for k in range(3):
        powers[k, 0], powers[k, 1], powers[k, 2] = 1.0, v[k], v[k] * v[k]
        powers[k, 3] = powers[k, 2] * v[k]
    H, g, row = np.zeros((3, 3)), np.zeros(3), np.empty(3)
    for i in range(10):
        value = 0.0
        row[:] = 0.0
        for m in range(20):
            a, b, c = POWERS[m, 0], POWERS[m, 1], POWERS[m, 2]
            x, y, z = powers[0, a], powers[1, b], powers[2, c]
            value += C[i, m] * x * y * z
            if a > 0:
                row[0] += C[i, m] * a * powers[0, a - 1] * y * z
            if b > 0:
                row[1] += C[i, m] * b * x * powers[1, b - 1] * z
            if c > 0:
                row[2] += C[i, m] * c * x * y * powers[2, c - 1]
        for j in range(3):
            g[j] += row[j] * value
            for k in range(3):
                H[j, k] += row[j] * row[k]
    c0 = H[1, 1] * H[2, 2] - H[1, 2] * H[2, 1]
    c1 = H[1, 2] * H[2, 0] - H[1, 0] * H[2, 2]
    c2 = H[1, 0] * H[2, 1] - H[1, 1] * H[2, 0]
    det = H[0, 0] * c0 + H[0, 1] * c1 + H[0, 2] * c2
    if not abs(det) > 1e-300:
        return False
    d0 = g[0] * c0 + g[1] * c1 + g[2] * c2
    d1 = (g[0] * (H[0, 2] * H[2, 1] - H[0, 1] * H[2, 2]) + g[1] * (H[0, 0] * H[2, 2] - H[0, 2] * H[2, 0])
          + g[2] * (H[0, 1] * H[2, 0] - H[0, 0] * H[2, 1]))  # fmt: skip
    d2 = (g[0] * (H[0, 1] * H[1, 2] - H[0, 2] * H[1, 1]) + g[1] * (H[0, 2] * H[1, 0] - H[0, 0] * H[1, 2])
          + g[2] * (H[0, 0] * H[1, 1] - H[0, 1] * H[1, 0]))  # fmt: skip
    v[0], v[1], v[2] = v[0] - d0 / det, v[1] - d1 / det, v[2] - d2 / det
    return True
