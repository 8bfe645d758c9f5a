"""The pose of a flat object from a few of its points: reprojection error, and descent along a tangent.

One small object: points X (N, 3) in its own frame, their mean at the origin, all at z = 0 (nearly).  A point
p = R X + t in the camera frame was seen along a ray, and the residual of its pixel is

    r = A p / (n · p),      A (2, 3) with A ray = 0,

with n = (0, 0, 1) and A = J [I, -y] for the normalised coordinates y of the pixel and J = d pixel / d y:
exactly the reprojection error of a pinhole, and for any other lens its linearisation at the observed pixel
(the error made is of the order of (residual / focal length)²).  Past 80° from the axis n is the ray itself.
Residuals are whitened in blocks of b: W (2 N / b, b, b), lower triangular; W r has unit covariance.

The tangent of a pose is that of `sequential.manifold.SE3`: R <- R Exp(w), t <- t + R v; in it the normal
equations of a step are H ξ = -g.
"""

from __future__ import annotations

import math

import numpy as np

from vision3d.kernels import inlined, kernel

__all__ = ["cholesky", "descend", "normal_equations", "rotate_right", "solve"]


@inlined
def rotate_right(R, wx, wy, wz, out):
    """Fill out = R Exp(w), by Rodrigues' formula."""
    squared = wx * wx + wy * wy + wz * wz
    if squared < 1e-12:
        a, b = 1.0 - squared / 6.0, 0.5 - squared / 24.0
    else:
        angle = math.sqrt(squared)
        a, b = math.sin(angle) / angle, (1.0 - math.cos(angle)) / squared
    e00, e11, e22 = (
        1.0 - b * (wy * wy + wz * wz),
        1.0 - b * (wx * wx + wz * wz),
        1.0 - b * (wx * wx + wy * wy),
    )
    e01, e10 = b * wx * wy - a * wz, b * wx * wy + a * wz
    e02, e20 = b * wx * wz + a * wy, b * wx * wz - a * wy
    e12, e21 = b * wy * wz - a * wx, b * wy * wz + a * wx
    for i in range(3):
        x, y, z = R[i, 0], R[i, 1], R[i, 2]
        out[i, 0] = x * e00 + y * e10 + z * e20
        out[i, 1] = x * e01 + y * e11 + z * e21
        out[i, 2] = x * e02 + y * e12 + z * e22


@kernel(
    "f8(f8[:,::1], f8[::1], f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,:,::1], f8[:,::1], f8[:,::1], f8[::1])"
)
def normal_equations(R, t, X, n, A, W, rows, H, g):
    """Fill H (6, 6) and g (6,) of a pose; returns chi squared, infinite behind the camera.

    `rows` (2 b, 7) is room for a block of residuals and their derivatives, plain and whitened.
    """
    b = W.shape[1]
    total = 0.0
    for q in range(6):
        g[q] = 0.0
        for j in range(6):
            H[q, j] = 0.0
    for block in range(W.shape[0]):
        for k in range(b // 2):
            i = block * (b // 2) + k
            px = R[0, 0] * X[i, 0] + R[0, 1] * X[i, 1] + R[0, 2] * X[i, 2] + t[0]
            py = R[1, 0] * X[i, 0] + R[1, 1] * X[i, 1] + R[1, 2] * X[i, 2] + t[1]
            pz = R[2, 0] * X[i, 0] + R[2, 1] * X[i, 1] + R[2, 2] * X[i, 2] + t[2]
            depth = n[i, 0] * px + n[i, 1] * py + n[i, 2] * pz
            if not depth > 1e-9:
                return math.inf
            for c in range(2):
                r = (A[i, c, 0] * px + A[i, c, 1] * py + A[i, c, 2] * pz) / depth
                dx = (A[i, c, 0] - r * n[i, 0]) / depth
                dy = (A[i, c, 1] - r * n[i, 1]) / depth
                dz = (A[i, c, 2] - r * n[i, 2]) / depth
                vx = dx * R[0, 0] + dy * R[1, 0] + dz * R[2, 0]
                vy = dx * R[0, 1] + dy * R[1, 1] + dz * R[2, 1]
                vz = dx * R[0, 2] + dy * R[1, 2] + dz * R[2, 2]
                row = 2 * k + c
                rows[row, 0] = X[i, 1] * vz - X[i, 2] * vy
                rows[row, 1] = X[i, 2] * vx - X[i, 0] * vz
                rows[row, 2] = X[i, 0] * vy - X[i, 1] * vx
                rows[row, 3], rows[row, 4], rows[row, 5], rows[row, 6] = vx, vy, vz, r
        for p in range(b):
            for q in range(7):
                s = 0.0
                for j in range(p + 1):
                    s += W[block, p, j] * rows[j, q]
                rows[b + p, q] = s
        for p in range(b, 2 * b):
            total += rows[p, 6] * rows[p, 6]
            for q in range(6):
                g[q] += rows[p, q] * rows[p, 6]
                for j in range(q + 1):
                    H[q, j] += rows[p, q] * rows[p, j]
    for q in range(6):
        for j in range(q):
            H[j, q] = H[q, j]
    return total


@inlined
def cholesky(H, first, damping, L):
    """Factorise H[first:, first:] with its diagonal scaled by 1 + damping; returns log det, NaN if not PD."""
    n = H.shape[0]
    logdet = 0.0
    for i in range(first, n):
        for j in range(first, i + 1):
            s = H[i, j]
            if i == j:
                s += damping * H[i, i]
            for k in range(first, j):
                s -= L[i, k] * L[j, k]
            if i == j:
                if not s > 1e-14 * H[i, i]:
                    return math.nan
                L[i, i] = math.sqrt(s)
                logdet += math.log(s)
            else:
                L[i, j] = s / L[j, j]
    return logdet


@inlined
def solve(L, g, first, step):
    """Fill step[first:] = -(L Lᵀ)⁻¹ g[first:]."""
    n = L.shape[0]
    for i in range(first, n):
        s = -g[i]
        for k in range(first, i):
            s -= L[i, k] * step[k]
        step[i] = s / L[i, i]
    for i in range(n - 1, first - 1, -1):
        s = step[i]
        for k in range(i + 1, n):
            s -= L[k, i] * step[k]
        step[i] = s / L[i, i]


@kernel(
    "f8(f8[:,::1], f8[::1], f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,:,::1], i8, i8, f8, f8[:,::1], f8[:,::1])"
)
def descend(R, t, X, n, A, W, first, iterations, enough, rows, H):
    """Move R and t to the minimum along tangent coordinates from `first` on (2: the normal stays).

    Levenberg-Marquardt, until a step promises to lower chi squared by less than `enough` (it is still made);
    returns chi squared there, and leaves the normal equations in H (6, 6).
    """
    R2, t2, H2 = np.empty((3, 3)), np.empty(3), np.empty((6, 6))
    g, g2, step, L = np.empty(6), np.empty(6), np.zeros(6), np.empty((6, 6))
    chi2 = normal_equations(R, t, X, n, A, W, rows, H, g)
    if not chi2 < math.inf:
        return math.inf
    damping = 0.0
    for _ in range(iterations):
        if math.isnan(cholesky(H, first, damping, L)):
            damping = max(10.0 * damping, 1e-6)
            continue
        solve(L, g, first, step)
        rotate_right(R, step[0], step[1], step[2], R2)
        gain = 0.0
        for i in range(first, 6):
            gain -= step[i] * g[i]
        for i in range(3):
            t2[i] = t[i] + R[i, 0] * step[3] + R[i, 1] * step[4] + R[i, 2] * step[5]
        chi2_2 = normal_equations(R2, t2, X, n, A, W, rows, H2, g2)
        if chi2_2 <= chi2 + 1e-12 * (1.0 + chi2):
            for i in range(6):
                g[i] = g2[i]
                for j in range(6):
                    H[i, j] = H2[i, j]
            for i in range(3):
                t[i] = t2[i]
                for j in range(3):
                    R[i, j] = R2[i, j]
            chi2 = chi2_2
            damping = 0.1 * damping if damping > 1e-9 else 0.0
            if gain < enough:
                break
        else:
            if gain < 1e-13:
                break
            damping = max(10.0 * damping, 1e-6)
            if damping > 1e8:
                break
    return chi2
