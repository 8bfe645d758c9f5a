"""A homography's functions for the robust loop where both images are noisy: Sampson's error.

Rows and models are those of `robust_homography`.  A point carried over is as uncertain as (u, v) and (x, y)
together: the error r there has covariance σ² (I + J Jᵀ), J being how the carried point moves with (x, y), and
rᵀ (I + J Jᵀ)⁻¹ r is to first order the squared distance in four dimensions from the nearest exact match
(Hartley, Zisserman 2004, section 4.2.6; Chum, Pajdla, Sturm 2005).
"""

from __future__ import annotations

import numpy as np
from numba import carray

from vision3d.kernels import entry, inlined, kernel
from vision3d.kernels.arrays import b0, f1, f2, w1, w2
from vision3d.kernels.robust_calls import FIT, RESIDUALS
from vision3d.kernels.robust_homography import unit_step

__all__ = ["sampson_fit", "sampson_normal_equations", "sampson_residuals"]

FAR = 1e30


@inlined
def precision(H, u, v, w):
    """The elements xx, xy, yy of (I + J Jᵀ)⁻¹ at a point carried to (u, v), of third coordinate w."""
    a, b = (H[0] - u * H[6]) / w, (H[1] - u * H[7]) / w
    c, d = (H[3] - v * H[6]) / w, (H[4] - v * H[7]) / w
    xx, xy, yy = 1.0 + a * a + b * b, a * c + b * d, 1.0 + c * c + d * d
    whole = xx * yy - xy * xy
    return yy / whole, -xy / whole, xx / whole


@entry(RESIDUALS)
def sampson_residuals(address, n, k, model, filled):
    """Squared Sampson distances; huge for points that come to lie behind the second image."""
    data, H, errors = carray(address, (n, 4)), carray(model, (9,)), carray(filled, (n,))
    for i in range(n):
        x, y = data[i, 0], data[i, 1]
        w = H[6] * x + H[7] * y + H[8]
        u, v = (H[0] * x + H[1] * y + H[2]) / w, (H[3] * x + H[4] * y + H[5]) / w
        xx, xy, yy = precision(H, u, v, w)
        a, b = u - data[i, 2], v - data[i, 3]
        errors[i] = xx * a * a + 2.0 * xy * a * b + yy * b * b if w > 0.0 else FAR
    return 1


@kernel(b0(f2, f1, f1, w2, w1), inline="never")
def sampson_normal_equations(data, weights, H, N, g):
    """Fill N (9, 9) and g (9,), the precision held; false for fewer than four points."""
    N[:], g[:] = 0.0, 0.0
    M, q, p, points = np.empty((3, 3)), np.empty(3), np.empty(3), 0
    for i in range(data.shape[0]):
        if not weights[i] > 0.0:
            continue
        points += 1
        p[0], p[1], p[2] = data[i, 0], data[i, 1], 1.0
        w = H[6] * p[0] + H[7] * p[1] + H[8]
        u, v = (H[0] * p[0] + H[1] * p[1] + H[2]) / w, (H[3] * p[0] + H[4] * p[1] + H[5]) / w
        xx, xy, yy = precision(H, u, v, w)
        a, b = u - data[i, 2], v - data[i, 3]
        # the carried point moves by G dH p / w with G = [1 0 -u; 0 1 -v]
        s = weights[i] / (w * w)
        M[0, 0], M[0, 1], M[1, 1] = s * xx, s * xy, s * yy
        M[0, 2], M[1, 2] = -u * M[0, 0] - v * M[0, 1], -u * M[0, 1] - v * M[1, 1]
        M[2, 2] = -u * M[0, 2] - v * M[1, 2]
        t = weights[i] / w
        q[0], q[1] = t * (xx * a + xy * b), t * (xy * a + yy * b)
        q[2] = -u * q[0] - v * q[1]
        for r in range(3):
            for j in range(3):
                g[3 * r + j] += q[r] * p[j]
                for c in range(r, 3):
                    m = M[r, c] * p[j]
                    for l in range(3):
                        N[3 * r + j, 3 * c + l] += m * p[l]
    for r in range(9):
        for c in range(r):
            N[r, c] = N[c, r]
    return points >= 4


@entry(FIT)
def sampson_fit(address, n, k, weight, model):
    """One Gauss-Newton step of the weighted squared Sampson distances."""
    data, weights, H = carray(address, (n, 4)), carray(weight, (n,)), carray(model, (9,))
    N, g = np.empty((9, 9)), np.empty(9)
    return 1 if sampson_normal_equations(data, weights, H, N, g) and unit_step(N, g, H) else 0
