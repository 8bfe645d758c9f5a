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
from sequential.kernels.flat import ANGLES, GENERAL

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
VECTOR = 0


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
def place(flat, table, n, d, count, x, lower, weights, unit, steps, points, points_flat):
    """Rows x, x ⊕ L u of `points` for each of `count` u of the set; `steps` holds the tangents L u."""
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
    if flat == GENERAL:
        step = steps.reshape(-1)
        for j in range(count):
            retract(table, 0, len(table), x, 0, step, j * d, points_flat, (j + 1) * n)
        return
    for j in range(count):
        for i in range(n):
            points[j + 1, i] = x[i] + steps[j, i]
    if flat == ANGLES:
        for b in range(len(table)):
            if table[b, 0] != VECTOR:
                at = table[b, 1]
                for j in range(count):
                    points[j + 1, at] = wrap(points[j + 1, at])


@inlined
def shift(flat, table, first, last, size, x, xi):
    """x <- x ⊕ xi."""
    if flat == GENERAL:
        retract(table, first, last, x, 0, xi, 0, x, 0)
        return
    for i in range(size):
        x[i] += xi[i]
    if flat == ANGLES:
        for b in range(first, last):
            if table[b, 0] != VECTOR:
                x[table[b, 1]] = wrap(x[table[b, 1]])


@inlined
def tangent_to(flat, table, first, last, dim, x, y, y_at, out):
    """The tangent at x that leads to y, which begins at `y_at`."""
    if flat == GENERAL:
        local(table, first, last, x, 0, y, y_at, out, 0)
        return
    for i in range(dim):
        out[i] = y[y_at + i] - x[i]
    if flat == ANGLES:
        for b in range(first, last):
            if table[b, 0] != VECTOR:
                out[table[b, 2]] = wrap(out[table[b, 2]])


@inlined
def tangents_from(flat, table, first, last, dim, count, mean, points, tangents, points_flat):
    """Rows of tangents that lead from a mean to every point."""
    if flat == GENERAL:
        out, width, wide = tangents.reshape(-1), points.shape[1], tangents.shape[1]
        for j in range(count + 1):
            local(table, first, last, mean, 0, points_flat, j * width, out, j * wide)
        return
    for j in range(count + 1):
        for i in range(dim):
            tangents[j, i] = points[j, i] - mean[i]
    if flat == ANGLES:
        for b in range(first, last):
            if table[b, 0] != VECTOR:
                at = table[b, 2]
                for j in range(count + 1):
                    tangents[j, at] = wrap(tangents[j, at])


@inlined
def mean_of(
    flat, table, first, last, size, dim, count, points, weights, mean, tangents, move, points_flat
):  # fmt: skip
    """Mean of `count` + 1 points (row 0 central) about the central one, and the tangents there to all."""
    central, each = weights[1], weights[3]
    for i in range(size):
        mean[i] = points[0, i]
    for _ in range(PASSES):
        tangents_from(flat, table, first, last, dim, count, mean, points, tangents, points_flat)
        largest = 0.0
        for k in range(dim):
            total = 0.0
            for j in range(1, count + 1):
                total += tangents[j, k]
            move[k] = each * total + central * tangents[0, k]
            largest = max(largest, abs(move[k]))
        shift(flat, table, first, last, size, mean, move)
        if flat != GENERAL or not largest > SETTLED:
            break
    for j in range(count + 1):
        for k in range(dim):
            tangents[j, k] -= move[k]
    if flat == ANGLES:  # one may have come round
        for b in range(first, last):
            if table[b, 0] != VECTOR:
                at = table[b, 2]
                for j in range(count + 1):
                    tangents[j, at] = wrap(tangents[j, at])


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
