"""Real roots of a polynomial, found degree by degree: the roots of a derivative separate those above it.

Coefficients ascend: p(x) = c[0] + c[1] x + … + c[n] xⁿ.
"""

from __future__ import annotations

import math

import numpy as np

from vision3d.kernels import inlined, kernel

__all__ = ["real_roots", "roots_of"]

NEWTON_MAX = 60


@inlined
def value_and_slope(c, row, degree, x):
    """Horner's scheme on row `row` of c."""
    value, slope = c[row, degree], 0.0
    for i in range(degree - 1, -1, -1):
        slope = slope * x + value
        value = value * x + c[row, i]
    return value, slope


@inlined
def bracketed_root(c, row, degree, low, high, rising):
    """The root between low and high, where the polynomial changes its sign once: Newton kept inside."""
    x = 0.5 * (low + high)
    for _ in range(NEWTON_MAX):
        value, slope = value_and_slope(c, row, degree, x)
        if (value > 0.0) == rising:
            high = x
        else:
            low = x
        ahead = x - value / slope if slope != 0.0 else math.inf
        if not (low <= ahead <= high):
            ahead = 0.5 * (low + high)
        if abs(ahead - x) <= 4e-16 * (1e-3 + abs(x)):
            return ahead
        x = ahead
    return x


def roots_inside(c, n, ends, roots):
    """Fill `roots` with the simple real roots of row n of c in [-1, 1], ascending; gives their number.

    Rows n-1, n-2 … of c become the derivatives; `ends` is room for n + 2 numbers.
    """
    for d in range(n - 1, 0, -1):
        for i in range(d + 1):
            c[d, i] = (i + 1.0) * c[d + 1, i + 1]
    count = 0
    for d in range(1, n + 1):
        ends[0] = -1.0
        for i in range(count):
            ends[1 + i] = roots[i]
        ends[1 + count] = 1.0
        intervals, count = count + 1, 0
        before, _ = value_and_slope(c, d, d, -1.0)
        for i in range(intervals):
            after, _ = value_and_slope(c, d, d, ends[i + 1])
            if (before < 0.0 and after >= 0.0) or (before > 0.0 and after <= 0.0):
                roots[count] = bracketed_root(c, d, d, ends[i], ends[i + 1], before < 0.0)
                count += 1
            before = after
    return count


_roots_inside = kernel("i8(f8[:,::1], i8, f8[::1], f8[::1])")(roots_inside)


@inlined
def roots_of(coefficients, n, table, ends, some, roots):
    """Fill `roots` (n,) with the simple real roots of a polynomial of degree n; gives their number.

    Those outside [-1, 1] come from the polynomial backwards, whose roots are their inverses.  `table`
    (n + 1, n + 1), `ends` (n + 2,) and `some` (n,) are room to work in.
    """
    largest = 0.0
    for i in range(n + 1):
        largest = max(largest, abs(coefficients[i]))
    if not (0.0 < largest < math.inf):
        return 0
    for i in range(n + 1):
        table[n, i] = coefficients[i] / largest
    count = _roots_inside(table, n, ends, some)
    for i in range(count):
        roots[i] = some[i]
    for i in range(n + 1):
        table[n, i] = coefficients[n - i] / largest
    outside = _roots_inside(table, n, ends, some)
    for i in range(outside):
        if 0.0 < abs(some[i]) < 1.0 and count < n:
            roots[count] = 1.0 / some[i]
            count += 1
    return count


@kernel("i8(f8[::1], f8[::1])")
def real_roots(coefficients, roots):
    """Fill `roots` with the simple real roots of a polynomial with ascending coefficients."""
    n = coefficients.shape[0] - 1
    if n < 1:
        return 0
    table, ends, some = np.zeros((n + 1, n + 1)), np.empty(n + 2), np.empty(n)
    return roots_of(coefficients, n, table, ends, some, roots)
