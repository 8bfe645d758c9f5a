"""What the robust loop calls for pairs of rays: essential matrices, homographies and rotations.

Rows are the 18 numbers of `vision3d.kernels.essential`; models are (9,), row by row; errors are Sampson
distances in standard deviations.
"""

from __future__ import annotations

import math

import numpy as np
from numba import carray

from vision3d.kernels import entry, inlined
from vision3d.kernels.essential import essential_residuals, motion_of, refine_essential
from vision3d.kernels.five_point import solve_five_point
from vision3d.kernels.ray_homography import homography_residuals, refine_homography
from vision3d.kernels.robust_calls import FIT, RESIDUALS, SOLVE

__all__ = [
    "essential_error",
    "essential_fit",
    "essential_solve",
    "homography_error",
    "homography_fit",
    "homography_solve",
    "rotation_fit",
    "rotation_solve",
]

STEPS = 2
FLAT = 1e-10


@inlined
def enough(weights, fewest):
    """Whether at least so many rows have a weight."""
    count = 0
    for i in range(weights.shape[0]):
        count += 1 if weights[i] > 0.0 else 0
    return count >= fewest


@entry(SOLVE)
def essential_solve(address, n, k, chosen, filled):
    """The essential matrices of five pairs."""
    return solve_five_point(carray(address, (n, k)), carray(chosen, (5,)), carray(filled, (10, 9)))


@entry(RESIDUALS)
def essential_error(address, n, k, model, filled):
    """Squared Sampson distances to an essential matrix."""
    essential_residuals(carray(address, (n, k)), carray(model, (9,)), carray(filled, (n,)))
    return 1


@entry(FIT)
def essential_fit(address, n, k, weight, model):
    """Two steps of weighted least squares on the motion of an essential matrix."""
    weights, E = carray(weight, (n,)), carray(model, (9,))
    R, t, H = np.empty((3, 3)), np.empty(3), np.empty((5, 5))
    if not enough(weights, 6) or not motion_of(E, R, t):
        return 0
    cost, _ = refine_essential(carray(address, (n, k)), weights, 0, 1.0, STEPS, R, t, H)
    for j in range(3):
        E[j] = t[1] * R[2, j] - t[2] * R[1, j]
        E[3 + j] = t[2] * R[0, j] - t[0] * R[2, j]
        E[6 + j] = t[0] * R[1, j] - t[1] * R[0, j]
    return 1 if cost < math.inf else 0


@inlined
def volume(data, i, j, k, side):
    """Determinant of three rays of a side, 0 or 3."""
    a, b, c = data[i, side], data[i, side + 1], data[i, side + 2]
    x = data[j, side + 1] * data[k, side + 2] - data[j, side + 2] * data[k, side + 1]
    y = data[j, side + 2] * data[k, side] - data[j, side] * data[k, side + 2]
    z = data[j, side] * data[k, side + 1] - data[j, side + 1] * data[k, side]
    return a * x + b * y + c * z


@entry(SOLVE)
def homography_solve(address, n, k, chosen, filled):
    """The homography of four pairs of rays; none where three lie in a plane, or it turns some behind.

    H = Σ b_i (v'_i / v_i) (a_j × a_l)ᵀ over the first three, with v_i the volume of a_4, a_j, a_l.
    """
    data, s, H = carray(address, (n, k)), carray(chosen, (4,)), carray(filled, (9,))
    whole, whole_b = volume(data, s[0], s[1], s[2], 0), volume(data, s[0], s[1], s[2], 3)
    if not (abs(whole) > FLAT and abs(whole_b) > FLAT):
        return 0
    side = math.copysign(1.0, whole * whole_b)
    for e in range(9):
        H[e] = 0.0
    for i in range(3):
        j, l = s[(i + 1) % 3], s[(i + 2) % 3]
        part, part_b = volume(data, s[3], j, l, 0), volume(data, s[3], j, l, 3)
        if not (abs(part) > FLAT and part * part_b * side > FLAT * FLAT):
            return 0
        weight = part_b / part
        x = data[j, 1] * data[l, 2] - data[j, 2] * data[l, 1]
        y = data[j, 2] * data[l, 0] - data[j, 0] * data[l, 2]
        z = data[j, 0] * data[l, 1] - data[j, 1] * data[l, 0]
        for r in range(3):
            H[3 * r] += weight * data[s[i], 3 + r] * x
            H[3 * r + 1] += weight * data[s[i], 3 + r] * y
            H[3 * r + 2] += weight * data[s[i], 3 + r] * z
    norm, depth = 0.0, 0.0
    for r in range(3):
        for c in range(3):
            norm += H[3 * r + c] ** 2
            depth += data[s[0], 3 + r] * H[3 * r + c] * data[s[0], c]
    scale = math.copysign(1.0, depth) / math.sqrt(norm)
    for e in range(9):
        H[e] *= scale
    return 1


@entry(RESIDUALS)
def homography_error(address, n, k, model, filled):
    """Squared Sampson distances to a homography of rays."""
    homography_residuals(carray(address, (n, k)), carray(model, (9,)), carray(filled, (n,)))
    return 1


@entry(FIT)
def homography_fit(address, n, k, weight, model):
    """Two steps of weighted least squares on a homography of rays."""
    weights, M = carray(weight, (n,)), np.empty((9, 9))
    if not enough(weights, 5):
        return 0
    cost, _ = refine_homography(carray(address, (n, k)), weights, 0, 1.0, STEPS, 9, carray(model, (9,)), M)
    return 1 if cost < math.inf else 0


@entry(SOLVE)
def rotation_solve(address, n, k, chosen, filled):
    """The rotation that takes two rays a to their rays b, as nearly as one can.

    The frames of bisector, normal and their product are brought to each other: Horn 1987's closed form for
    two directions of equal weight.
    """
    data, sample, out = carray(address, (n, k)), carray(chosen, (2,)), carray(filled, (1, 9))
    frames = np.empty((2, 3, 3))
    for side in range(2):
        p, q = data[sample[0], 3 * side : 3 * side + 3], data[sample[1], 3 * side : 3 * side + 3]
        F = frames[side]
        first, second = 0.0, 0.0
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            F[0, i] = p[i] + q[i]
            F[1, i] = p[j] * q[k] - p[k] * q[j]
            first += F[0, i] ** 2
            second += F[1, i] ** 2
        if not (first > 1e-12 and second > 1e-12):
            return 0
        for i in range(3):
            F[0, i] /= math.sqrt(first)
            F[1, i] /= math.sqrt(second)
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            F[2, i] = F[0, j] * F[1, k] - F[0, k] * F[1, j]
    for i in range(3):
        for j in range(3):
            out[0, 3 * i + j] = (
                frames[1, 0, i] * frames[0, 0, j]
                + frames[1, 1, i] * frames[0, 1, j]
                + frames[1, 2, i] * frames[0, 2, j]
            )
    return 1


@entry(FIT)
def rotation_fit(address, n, k, weight, model):
    """Two steps of weighted least squares on a rotation of rays."""
    weights, M = carray(weight, (n,)), np.empty((3, 3))
    if not enough(weights, 3):
        return 0
    cost, _ = refine_homography(carray(address, (n, k)), weights, 0, 1.0, STEPS, 3, carray(model, (9,)), M)
    return 1 if cost < math.inf else 0
