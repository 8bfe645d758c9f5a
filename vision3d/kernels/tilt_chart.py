"""Attitudes of a flat object by its tilt (a, b) from the line of sight, and moments of poses in their chart.

    R = V Exp([a, b, 0]) Rz(c),      V = frame of the line of sight, its z axis away from the camera

(a, b) = 0 is fronto-parallel, |(a, b)| the angle between the normal and the line of sight.  Equal areas of
attitudes are sin|ab| / |ab| da db dc.
"""

from __future__ import annotations

import math

import numpy as np

from vision3d.kernels import inlined, kernel
from vision3d.kernels.plane_pose import cholesky, descend, rotate_right

__all__ = ["log_density", "moments", "sight_frame", "tilt_of"]

STEEPEST = 1.5  # rad: nothing is read from a marker seen on its edge
TWO_LOG_TWO_PI = 2.0 * math.log(2.0 * math.pi)


@inlined
def sight_frame(t, V):
    """Fill V with a frame whose z axis points to t."""
    norm = math.sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
    z0, z1, z2 = t[0] / norm, t[1] / norm, t[2] / norm
    # x is the camera's x axis, or its y axis, made perpendicular to z
    first = 0 if abs(z0) < 0.8 else 1
    along = z0 if first == 0 else z1
    x0, x1, x2 = -along * z0, -along * z1, -along * z2
    if first == 0:
        x0 += 1.0
    else:
        x1 += 1.0
    norm = math.sqrt(x0 * x0 + x1 * x1 + x2 * x2)
    V[0, 0], V[1, 0], V[2, 0] = x0 / norm, x1 / norm, x2 / norm
    V[0, 2], V[1, 2], V[2, 2] = z0, z1, z2
    V[0, 1] = z1 * V[2, 0] - z2 * V[1, 0]
    V[1, 1] = z2 * V[0, 0] - z0 * V[2, 0]
    V[2, 1] = z0 * V[1, 0] - z1 * V[0, 0]


@inlined
def tilt_of(V, R):
    """The tilt (a, b) of an attitude."""
    x = V[0, 0] * R[0, 2] + V[1, 0] * R[1, 2] + V[2, 0] * R[2, 2]
    y = V[0, 1] * R[0, 2] + V[1, 1] * R[1, 2] + V[2, 1] * R[2, 2]
    z = V[0, 2] * R[0, 2] + V[1, 2] * R[1, 2] + V[2, 2] * R[2, 2]
    sine = math.hypot(x, y)
    scale = math.atan2(sine, z) / sine if sine > 1e-9 else 1.0
    return -scale * y, scale * x


@inlined
def set_tilt(V, a, b, R, scratch):
    """Turn R to the tilt (a, b) of V, keeping its angle about its own normal as near as may be."""
    rotate_right(V, a, b, 0.0, scratch)
    cosine = sine = 0.0
    for i in range(3):
        cosine += scratch[i, 0] * R[i, 0] + scratch[i, 1] * R[i, 1]
        sine += scratch[i, 1] * R[i, 0] - scratch[i, 0] * R[i, 1]
    norm = math.hypot(cosine, sine)
    cosine, sine = cosine / norm, sine / norm
    for i in range(3):
        x, y = scratch[i, 0], scratch[i, 1]
        R[i, 0], R[i, 1], R[i, 2] = cosine * x + sine * y, cosine * y - sine * x, scratch[i, 2]


@kernel(
    "f8(f8[:,::1], f8, f8, f8[:,::1], f8[::1], f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,:,::1], "
    "f8[:,::1], f8[:,::1])"
)
def log_density(V, a, b, R, t, X, n, A, W, rows, H):
    """Logarithm of the posterior density of a tilt, the angle about the normal and the place integrated out.

    R and t are where the descent begins, and hold the best pose of that tilt afterwards; H its normal
    equations.  The prior is flat over attitudes and places.
    """
    angle = math.hypot(a, b)
    if angle > STEEPEST:
        return -math.inf
    L = np.empty((6, 6))
    set_tilt(V, a, b, R, L[:3, :3])
    chi2 = descend(R, t, X, n, A, W, 2, 4, 3e-3, rows, H)
    if not chi2 < math.inf:
        return -math.inf
    logdet = cholesky(H, 2, 0.0, L)
    if math.isnan(logdet):
        return -math.inf
    area = math.log(math.sin(angle) / angle) if angle > 1e-6 else 0.0
    return -0.5 * chi2 - 0.5 * logdet + area + TWO_LOG_TWO_PI


@inlined
def rotation_log(R, centre, phi):
    """Fill phi = Log(centreᵀ R), for angles below pi."""
    trace = 0.0
    for i in range(3):
        for j in range(3):
            trace += centre[i, j] * R[i, j]
    for k in range(3):
        p, q = (k + 1) % 3, (k + 2) % 3
        s = 0.0
        for i in range(3):
            s += centre[i, q] * R[i, p] - centre[i, p] * R[i, q]
        phi[k] = 0.5 * s
    sine = math.sqrt(phi[0] * phi[0] + phi[1] * phi[1] + phi[2] * phi[2])
    angle = math.atan2(sine, 0.5 * (trace - 1.0))
    scale = angle / sine if sine > 1e-9 else 1.0
    for k in range(3):
        phi[k] *= scale


@inlined
def inverse_left(phi, J):
    """Fill J = Jl(phi)⁻¹ = I - phi^ / 2 + c phi^²; Jr⁻¹ is its transpose."""
    squared = phi[0] * phi[0] + phi[1] * phi[1] + phi[2] * phi[2]
    if squared < 1e-6:
        c = 1.0 / 12.0 + squared / 720.0
    else:
        half = 0.5 * math.sqrt(squared)
        c = (1.0 - half / math.tan(half)) / squared
    for i in range(3):
        for j in range(3):
            J[i, j] = c * phi[i] * phi[j]
        J[i, i] += 1.0 - c * squared
    J[0, 1] += 0.5 * phi[2]
    J[0, 2] -= 0.5 * phi[1]
    J[1, 2] += 0.5 * phi[0]
    J[1, 0] -= 0.5 * phi[2]
    J[2, 0] += 0.5 * phi[1]
    J[2, 1] -= 0.5 * phi[0]


@kernel("void(i8, f8[::1], f8[:,:,::1], f8[:,::1], f8[:,:,::1], f8[:,::1], f8[::1], f8[::1], f8[:,::1])")
def moments(count, weights, Rs, ts, Cs, R, t, mean, cov):
    """Mean (6,) and second moment (6, 6) of Log(T⁻¹ T_k) over `count` weighted poses, T = (R, t).

    Each T_k has a covariance Cs[k] (4, 4) of its angle about the normal and its place, in its own tangent.
    """
    phi, xi, J, D = np.empty(3), np.empty(6), np.empty((3, 3)), np.zeros((6, 4))
    mean[:] = 0.0
    cov[:] = 0.0
    for k in range(count):
        rotation_log(Rs[k], R, phi)
        inverse_left(phi, J)
        D[:] = 0.0
        xi[:3] = phi
        for i in range(3):
            D[i, 0] = J[2, i]
            s = 0.0
            for j in range(3):
                for m in range(3):
                    s += J[i, j] * R[m, j] * (ts[k, m] - t[m])
            xi[3 + i] = s
        for i in range(3):  # a step of place in the tangent of T_k, seen from T
            for c in range(3):
                s = 0.0
                for j in range(3):
                    turned = 0.0
                    for m in range(3):
                        turned += R[m, j] * Rs[k, m, c]
                    s += J[i, j] * turned
                D[3 + i, 1 + c] = s
        w = weights[k]
        for i in range(6):
            mean[i] += w * xi[i]
            for j in range(i + 1):
                s = xi[i] * xi[j]
                for p in range(4):
                    for q in range(4):
                        s += D[i, p] * Cs[k, p, q] * D[j, q]
                cov[i, j] += w * s
    for i in range(6):
        for j in range(i):
            cov[j, i] = cov[i, j]
