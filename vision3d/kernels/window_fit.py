"""Fit a model of the light to the pixels of a window, by Levenberg-Marquardt with one bounded parameter.

A model is an inlined function ``model(q, a, b, x, y, row) -> light`` of the parameters q, two given numbers
and a pixel; it writes the derivatives by q into row.  It comes as an argument, so that one loop serves every
model and is compiled with each.
"""

from __future__ import annotations

import math

from vision3d.kernels import inlined

__all__ = ["covariance", "fit_window"]

ITERATIONS = 50
SETTLED = 1e-4  # px


@inlined
def factor(A, L):
    """Cholesky factor of A; False where it is not positive definite."""
    for i in range(len(A)):
        for j in range(i + 1):
            total = A[i, j]
            for k in range(j):
                total -= L[i, k] * L[j, k]
            if i == j:
                if not total > 0.0:
                    return False
                L[i, i] = math.sqrt(total)
            else:
                L[i, j] = total / L[j, j]
    return True


@inlined
def solve(L, g, x):
    """Solve L Lᵀ x = g."""
    p = len(g)
    for i in range(p):
        total = g[i]
        for k in range(i):
            total -= L[i, k] * x[k]
        x[i] = total / L[i, i]
    for i in range(p - 1, -1, -1):
        total = x[i]
        for k in range(i + 1, p):
            total -= L[k, i] * x[k]
        x[i] = total / L[i, i]


@inlined
def hold(k, A, g):
    """Keep a parameter where it is: at a bound it would drag the others along."""
    for i in range(len(g)):
        if i > k:
            A[i, k] = 0.0
        else:
            A[k, i] = 0.0
    A[k, k] = 1.0
    g[k] = 0.0


@inlined
def cost_of(model, q, a, b, n, px, py, value, row):
    """Sum of squared residuals."""
    total = 0.0
    for i in range(n):
        r = value[i] - model(q, a, b, px[i], py[i], row)
        total += r * r
    return total


@inlined
def normal(model, q, a, b, n, px, py, value, row, A, g):
    """Fill the lower half of A = JᵀJ, and g = Jᵀr."""
    p = len(q)
    for i in range(p):
        g[i] = 0.0
        for j in range(p):
            A[i, j] = 0.0
    for k in range(n):
        r = value[k] - model(q, a, b, px[k], py[k], row)
        for i in range(p):
            g[i] += row[i] * r
            for j in range(i + 1):
                A[i, j] += row[i] * row[j]


@inlined
def fit_window(model, q, a, b, n, px, py, value, bounded, low, high, reach, work, A, D, L):
    """Move q to the least squares; the sum of squares, or -1 where it does not settle.

    The parameter `bounded` stays between low and high; q[0], q[1] within `reach` of where they began.
    `work` is (4, p) scratch, A, D, L are (p, p).
    """
    p = len(q)
    row, g, step, tried = work[0], work[1], work[2], work[3]
    x0, y0 = q[0], q[1]
    cost = cost_of(model, q, a, b, n, px, py, value, row)
    damping = 1e-3
    for _ in range(ITERATIONS):
        normal(model, q, a, b, n, px, py, value, row, A, g)
        if q[bounded] <= low and g[bounded] < 0.0:
            hold(bounded, A, g)
        for i in range(p):
            for j in range(i + 1):
                D[i, j] = A[i, j]
            D[i, i] = A[i, i] * (1.0 + damping) + 1e-12
        if not factor(D, L):
            return -1.0
        solve(L, g, step)
        for i in range(p):
            tried[i] = q[i] + step[i]
        tried[bounded] = min(max(tried[bounded], low), high)
        new = cost_of(model, tried, a, b, n, px, py, value, row)
        if new <= cost:
            gain = cost - new
            cost = new
            for i in range(p):
                q[i] = tried[i]
            damping = max(damping * 0.2, 1e-6)
            moved = abs(step[0]) + abs(step[1])
            if moved < SETTLED or (moved < 10.0 * SETTLED and gain <= 1e-6 * cost + 1e-9):
                return cost
        else:
            damping *= 8.0
            if damping > 1e6:
                return cost
        if math.hypot(q[0] - x0, q[1] - y0) > reach:
            return -1.0
    return -1.0


@inlined
def covariance(model, q, a, b, n, px, py, value, bounded, low, variance, work, A, L, out):
    """Covariance of q[0], q[1] as out = (xx, xy, yy); False where the window does not determine them."""
    row, g, step = work[0], work[1], work[2]
    normal(model, q, a, b, n, px, py, value, row, A, g)
    if q[bounded] <= low:
        hold(bounded, A, g)
    if not factor(A, L):
        return False
    for axis in range(2):
        for i in range(len(q)):
            g[i] = 0.0
        g[axis] = variance
        solve(L, g, step)
        if axis == 0:
            out[0], out[1] = step[0], step[1]
        else:
            out[2] = step[1]
    return True
