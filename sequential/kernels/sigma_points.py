"""Sigma points of a belief on any product manifold, and the moments of what becomes of them.

Means are sought about the image of the central point by moving to the weighted mean of the tangents that
lead to the others (Hauberg, Lauze, Pedersen 2013, Unscented Kalman filtering on Riemannian manifolds), so
that no angle is ever averaged.  On vectors and plane angles one move is exact.

A set is `weights` (4,) = [γ, weight of the central point in a mean, in a covariance, of any other] and
`unit` (c, d): where the others lie for a unit covariance, or no rows for ±γ along each axis.  Always
Σ w u = 0 and Σ w u uᵀ = 1 over the others.
"""

from __future__ import annotations

import math

from sequential.kernels.call import inlined
from sequential.kernels.charts import local, retract, wrap

__all__ = [
    "factor",
    "mean_of",
    "place",
    "project",
    "second_moment",
    "shift",
    "slope",
    "tangent_to",
    "unexplained",
]

PASSES = 10  # over a mean on a manifold; two suffice but for a spread of radians
SETTLED = 1e-9  # a correction below this is exact to rounding when subtracted from the tangents
LOST = 1e-13  # a pivot below this share of its diagonal is rounding: a direction without uncertainty
INDEFINITE = -1e-6  # and one that is this negative is not
VECTOR, SO2 = 0, 1


@inlined
def factor(p, d, lower):
    """P = L Lᵀ, a lost pivot giving a zero column; returns False where P is not positive semi-definite."""
    for j in range(d):
        s = p[j, j]
        for k in range(j):
            s -= lower[j, k] * lower[j, k]
        if not s >= INDEFINITE * p[j, j] or p[j, j] < 0.0:
            return False
        pivot = math.sqrt(s) if s > LOST * p[j, j] else 0.0
        share = 1.0 / pivot if pivot > 0.0 else 0.0
        for i in range(j):
            lower[i, j] = 0.0
        lower[j, j] = pivot
        for i in range(j + 1, d):
            s = p[i, j]
            for k in range(j):
                s -= lower[i, k] * lower[j, k]
            lower[i, j] = s * share
    return True


@inlined
def place(table, n, d, x, lower, weights, unit, steps, points):
    """Rows x, x ⊕ L u of `points` for every u of the set; `steps` holds the tangents L u."""
    count = 2 * d if unit.shape[0] == 0 else unit.shape[0]
    if unit.shape[0] == 0:
        for i in range(d):
            for j in range(d):
                s = weights[0] * lower[i, j]
                steps[j, i] = s
                steps[d + j, i] = -s
    else:
        for j in range(count):
            for i in range(d):
                s = 0.0
                for k in range(i + 1):
                    s += lower[i, k] * unit[j, k]
                steps[j, i] = s
    for i in range(n):
        points[0, i] = x[i]
    for b in range(len(table)):
        kind, s, t = table[b, 0], table[b, 1], table[b, 2]
        if kind == VECTOR:
            for i in range(table[b, 3]):
                for j in range(count):
                    points[j + 1, s + i] = x[s + i] + steps[j, t + i]
        elif kind == SO2:
            for j in range(count):
                points[j + 1, s] = near(x[s] + steps[j, t])
        else:
            flat, step = points.reshape(-1), steps.reshape(-1)
            for j in range(count):
                retract(table, b, b + 1, x, 0, step, j * d, flat, (j + 1) * n)
    return count


@inlined
def near(angle):
    """Angle in ]-π, π], quickly where it is there already."""
    return angle if -math.pi < angle <= math.pi else wrap(angle)


@inlined
def shift(table, first, last, x, xi):
    """x <- x ⊕ xi."""
    for b in range(first, last):
        kind, s, t = table[b, 0], table[b, 1], table[b, 2]
        if kind == VECTOR:
            for i in range(table[b, 3]):
                x[s + i] += xi[t + i]
        elif kind == SO2:
            x[s] = near(x[s] + xi[t])
        else:
            retract(table, b, b + 1, x, 0, xi, 0, x, 0)


@inlined
def tangent_to(table, first, last, x, y, y_at, out):
    """The tangent at x that leads to y, which begins at `y_at`."""
    for b in range(first, last):
        kind, s, t = table[b, 0], table[b, 1], table[b, 2]
        if kind == VECTOR:
            for i in range(table[b, 3]):
                out[t + i] = y[y_at + s + i] - x[s + i]
        elif kind == SO2:
            out[t] = near(y[y_at + s] - x[s])
        else:
            local(table, b, b + 1, x, 0, y, y_at, out, 0)


@inlined
def tangents_from(table, first, last, count, mean, points, tangents):
    """Rows of tangents that lead from a mean to every point."""
    for b in range(first, last):
        kind, s, t = table[b, 0], table[b, 1], table[b, 2]
        if kind == VECTOR:
            for i in range(table[b, 3]):
                for j in range(count + 1):
                    tangents[j, t + i] = points[j, s + i] - mean[s + i]
        elif kind == SO2:
            for j in range(count + 1):
                tangents[j, t] = near(points[j, s] - mean[s])
        else:
            flat, out = points.reshape(-1), tangents.reshape(-1)
            width, wide = points.shape[1], tangents.shape[1]
            for j in range(count + 1):
                local(table, b, b + 1, mean, 0, flat, j * width, out, j * wide)


@inlined
def mean_of(table, first, last, size, dim, count, points, weights, mean, tangents, move):
    """Mean of `count` + 1 points (row 0 central) about the central one, and the tangents there to all."""
    curved, central, each = False, weights[1], weights[3]
    for b in range(first, last):
        curved = curved or table[b, 0] > SO2
    for i in range(size):
        mean[i] = points[0, i]
    for _ in range(PASSES):
        tangents_from(table, first, last, count, mean, points, tangents)
        largest = 0.0
        for k in range(dim):
            total = 0.0
            for j in range(1, count + 1):
                total += tangents[j, k]
            move[k] = each * total + central * tangents[0, k]
            largest = max(largest, abs(move[k]))
        shift(table, first, last, mean, move)
        if not curved or not largest > SETTLED:
            break
    wrapped = False
    for k in range(dim):
        for j in range(count + 1):
            tangents[j, k] -= move[k]
            wrapped = wrapped or abs(tangents[j, k]) > math.pi
    if wrapped and not curved:  # an angle may have come round
        tangents_from(table, first, last, count, mean, points, tangents)


@inlined
def second_moment(tangents, weights, count, dim, out):
    """out = Σ w e eᵀ over the central point and `count` others."""
    central, each = weights[2], weights[3]
    for a in range(dim):
        for b in range(a + 1):
            total = 0.0
            for j in range(1, count + 1):
                total += tangents[j, a] * tangents[j, b]
            total = each * total + central * tangents[0, a] * tangents[0, b]
            out[a, b] = total
            out[b, a] = total


@inlined
def project(tangents, weights, unit, d, dim, out):
    """Regression on the unit points: D (dim, d) = Σ w e uᵀ, so that y ≈ D L⁻¹ (x - mean) + rest."""
    if unit.shape[0] == 0:
        share = weights[3] * weights[0]
        for a in range(dim):
            for j in range(d):
                out[a, j] = share * (tangents[1 + j, a] - tangents[1 + d + j, a])
        return
    for a in range(dim):
        for j in range(d):
            s = 0.0
            for i in range(unit.shape[0]):
                s += tangents[1 + i, a] * unit[i, j]
            out[a, j] = weights[3] * s


@inlined
def unexplained(tangents, weights, unit, d, dim, projected, out):
    """Ω = Σ w r rᵀ of what the regression leaves, r = e - D u: zero to the square of rounding if linear."""
    central, each = weights[2], weights[3]
    if unit.shape[0] == 0:
        each *= 0.5
        for a in range(dim):
            for b in range(a + 1):
                total = 0.0
                for j in range(1, d + 1):
                    left = tangents[j, a] + tangents[d + j, a]
                    total += left * (tangents[j, b] + tangents[d + j, b])
                total = each * total + central * tangents[0, a] * tangents[0, b]
                out[a, b] = total
                out[b, a] = total
        return
    for a in range(dim):
        for b in range(a + 1):
            total = 0.0
            for i in range(unit.shape[0]):
                left, right = tangents[1 + i, a], tangents[1 + i, b]
                for j in range(d):
                    left -= projected[a, j] * unit[i, j]
                    right -= projected[b, j] * unit[i, j]
                total += left * right
            total = each * total + central * tangents[0, a] * tangents[0, b]
            out[a, b] = total
            out[b, a] = total


@inlined
def slope(projected, lower, d, dim, out):
    """A (dim, d) = D L⁻¹; a direction without uncertainty gets a zero column."""
    for a in range(dim):
        for j in range(d - 1, -1, -1):
            s = projected[a, j]
            for k in range(j + 1, d):
                s -= out[a, k] * lower[k, j]
            out[a, j] = s / lower[j, j] if lower[j, j] > 0.0 else 0.0
