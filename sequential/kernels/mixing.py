"""Moments of mixtures, of Gaussians and of particles, on a product manifold.

States are compared in the tangent at the likeliest member, so that no angle and no quaternion is ever
averaged, and each covariance is carried to the tangent at the mean before it is added.
"""

from __future__ import annotations

from numba import types

from sequential.kernels.arrays import f1, f2, f3, i0, i2, w1, w2
from sequential.kernels.call import bare, bare_as
from sequential.kernels.charts import local, retract, transport
from sequential.kernels.matrices import copy_matrix, copy_vector, fill_diagonal, push_covariance

__all__ = ["largest", "mix", "moments_of", "normalise"]

PASSES = 10  # over a mean on a manifold; the second finds a flat one settled
SETTLED = 1e-12


@bare_as(i0(f1))
def largest(values):
    """Index of the largest of some numbers."""
    best = 0
    for i in range(1, len(values)):
        if values[i] > values[best]:
            best = i
    return best


@bare_as(types.float64(w1))
def normalise(weights):
    """Divide by the sum, which is returned; nothing is divided by a sum of zero."""
    total = 0.0
    for i in range(len(weights)):
        total += weights[i]
    if total > 0.0:
        for i in range(len(weights)):
            weights[i] /= total
    return total


@bare_as(types.void(i2, f1, f2, f3, w1, w2, w1, w1, w2, w2, w2, w2))
def mix(table, weights, means, covs, mean, cov, e, move, turn, inverse, part, flipped):
    """Mean (n,) and covariance (d, d) of members (J, n), (J, d, d) with weights (J,) that add up to one.

    Σ w (P + e eᵀ), with each P seen from the mean (Bar-Shalom, Li, Kirubarajan 2001, eq. 11.6.6-9, in the
    tangent).  The last six arrays are scratch: two (d,), four (d, d).  `mean` and `cov` are no members.
    """
    blocks, d, n, best = len(table), cov.shape[0], means.shape[1], largest(weights)
    flat = means.reshape(-1)
    copy_vector(means[best], mean)
    if weights[best] >= 1.0:
        copy_matrix(covs[best], cov)
        return
    for _ in range(PASSES):
        for k in range(d):
            move[k] = 0.0
        for j in range(len(weights)):
            if weights[j] > 0.0:
                local(table, 0, blocks, mean, 0, flat, j * n, e, 0)
                for k in range(d):
                    move[k] += weights[j] * e[k]
        furthest = 0.0
        for k in range(d):
            furthest = max(furthest, abs(move[k]))
        retract(table, 0, blocks, mean, 0, move, 0, mean, 0)
        if not furthest > SETTLED:
            break
    fill_diagonal(cov, 0.0)
    for j in range(len(weights)):
        if not weights[j] > 0.0:
            continue
        transport(table, blocks, d, flat, j * n, mean, 0, e, turn, inverse)
        copy_matrix(covs[j], turn)
        push_covariance(inverse, turn, part, flipped, d)
        local(table, 0, blocks, mean, 0, flat, j * n, e, 0)
        for a in range(d):
            for b in range(d):
                cov[a, b] += weights[j] * (turn[a, b] + e[a] * e[b])


@bare
def moments_of(table, first, last, size, dim, points, weights, mean, cov, e, move):
    """Mean (size,) about the heaviest of the points (P, size or wider), covariance (dim, dim) there."""
    flat, width, count = points.reshape(-1), points.shape[1], len(weights)
    best = largest(weights)
    for i in range(size):
        mean[i] = points[best, i]
    for _ in range(PASSES):
        for k in range(dim):
            move[k] = 0.0
        for i in range(count):
            if weights[i] > 0.0:
                local(table, first, last, mean, 0, flat, i * width, e, 0)
                for k in range(dim):
                    move[k] += weights[i] * e[k]
        furthest = 0.0
        for k in range(dim):
            furthest = max(furthest, abs(move[k]))
        retract(table, first, last, mean, 0, move, 0, mean, 0)
        if not furthest > SETTLED:
            break
    for a in range(dim):
        for b in range(dim):
            cov[a, b] = 0.0
    for i in range(count):
        if weights[i] > 0.0:
            local(table, first, last, mean, 0, flat, i * width, e, 0)
            for a in range(dim):
                for b in range(a + 1):
                    cov[a, b] += weights[i] * e[a] * e[b]
    for a in range(dim):
        for b in range(a):
            cov[b, a] = cov[a, b]
