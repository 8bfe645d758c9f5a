"""The pose of a flat object as two modes with their weights, by integration over its tilt.

The two minima of `plane_minima` are compared by the probability around each, not by their residuals: the
density of the tilt (the other four coordinates are integrated out by Laplace's method) is summed over a
grid that covers both basins, which are parted where the line between the minima is lowest: sharply where
the valley is deep, softly where there is hardly one (a quarter of the way between them, by the odds of the
valley). Where a minimum is sharp and far from the other, Laplace's method alone does the same for less.
"""

from __future__ import annotations

import math

import numpy as np

from vision3d.kernels import inlined, kernel
from vision3d.kernels.plane_minima import two_minima
from vision3d.kernels.plane_pose import cholesky, rotate_right, solve
from vision3d.kernels.tilt_chart import log_density, moments, sight_frame, tilt_of

__all__ = ["posterior"]

DROP = 9.0  # nats below the top at which a density is over: 4.2 sigma
SHARP = 250.0  # a valley this deep parts minima that are Gaussian: 45 sigma
NARROW = 0.02  # rad: a lone minimum sharper than this is Gaussian
WIDEST = 3.0  # rad
ALONG, ACROSS, ALONE = 21, 13, 11  # nodes of a grid over both minima, and over one
MOST = ALONG * ACROSS


@inlined
def put_pose(R, t, R2, t2):
    """Copy (R, t) into (R2, t2); an assignment of slices takes Numba far longer to compile."""
    for i in range(3):
        t2[i] = t[i]
        for j in range(3):
            R2[i, j] = R[i, j]


@kernel("f8(f8[:,::1], i8, f8[:,::1], f8[:,::1], f8[::1], f8[::1])")
def inverse(H, first, C, L, g, column):
    """Fill C = H[first:, first:]⁻¹; returns log det."""
    logdet = cholesky(H, first, 0.0, L)
    for j in range(first, 6):
        for i in range(6):
            g[i] = 0.0
        g[j] = -1.0
        solve(L, g, first, column)
        for i in range(first, 6):
            C[i - first, j - first] = column[i]
    return logdet


@kernel(
    "f8(f8[:,::1], f8, f8, f8, f8, f8, f8, f8[:,::1], f8[::1], f8[:,::1], f8[:,::1], f8[:,:,::1], "
    "f8[:,:,::1], f8[:,::1], f8[:,::1])"
)
def reach(V, a, b, ua, ub, top, furthest, R, t, X, n, A, W, rows, H):
    """How far from (a, b) along (ua, ub) the density stays within DROP of `top`, rad, at most `furthest`."""
    R2, t2 = R.copy(), t.copy()
    near, far = 0.0, 0.004
    while far < furthest:
        if log_density(V, a + far * ua, b + far * ub, R2, t2, X, n, A, W, rows, H) < top - DROP:
            break
        near, far = far, 1.7 * far
    far = min(far, furthest)
    for _ in range(3):
        middle = 0.5 * (near + far)
        put_pose(R, t, R2, t2)
        if log_density(V, a + middle * ua, b + middle * ub, R2, t2, X, n, A, W, rows, H) < top - DROP:
            far = middle
        else:
            near = middle
    return far


@kernel(
    "i8(f8[:,::1], f8[::1], f8[::1], f8[::1], i8, i8, f8[:,::1], f8[::1], f8[:,::1], f8[:,::1], "
    "f8[:,:,::1], f8[:,:,::1], f8[:,::1], f8[::1], f8[::1], f8[:,:,::1], f8[:,::1], f8[:,:,::1])"
)
def grid(V, origin, u, box, along, across, R0, t0, X, n, A, W, rows, logs, places, Rs, ts, Cs):
    """Fill nodes over origin + box (u from box[0] to box[1], v from box[2] to box[3]); returns how many.

    `places` is the coordinate along u.  Nodes are midpoints, visited to and fro, each begun at the last.
    """
    R, t, H, L, g, column = R0.copy(), t0.copy(), np.empty((6, 6)), np.empty((6, 6)), np.empty(6), np.empty(6)
    count = 0
    du, dv = (box[1] - box[0]) / along, (box[3] - box[2]) / across
    for i in range(along):
        x = box[0] + (i + 0.5) * du
        for k in range(across):
            j = k if i % 2 == 0 else across - 1 - k
            y = box[2] + (j + 0.5) * dv
            a, b = origin[0] + x * u[0] - y * u[1], origin[1] + x * u[1] + y * u[0]
            f = log_density(V, a, b, R, t, X, n, A, W, rows, H)
            if not f > -math.inf:
                put_pose(R0, t0, R, t)
                continue
            logs[count], places[count] = f + math.log(du * dv), x
            put_pose(R, t, Rs[count], ts[count])
            inverse(H, 2, Cs[count], L, g, column)
            count += 1
    return count


@kernel(
    "f8(i8, f8[::1], f8[::1], i8, f8, f8, f8[::1], f8[:,:,::1], f8[:,::1], f8[:,:,::1], f8[:,::1], f8[::1], "
    "f8[:,::1], f8[::1])"
)
def summed(count, logs, places, side, cut, width, weights, Rs, ts, Cs, R, t, cov, mean):
    """Sum the nodes into log Z, and move (R, t) to their mean, cov about it.

    A node belongs to both minima: `side` 1 is the one before the cut, -1 the one behind, 0 takes all.
    """
    top = -math.inf
    for k in range(count):
        top = max(top, logs[k])
    if not top > -math.inf:
        return -math.inf
    total = 0.0
    for k in range(count):
        belongs = 1.0 if side == 0 else 1.0 / (1.0 + math.exp(min(side * (places[k] - cut) / width, 500.0)))
        weights[k] = belongs * math.exp(logs[k] - top)
        total += weights[k]
    for k in range(count):
        weights[k] /= total
    turned = np.empty((3, 3))
    for _ in range(2):
        moments(count, weights, Rs, ts, Cs, R, t, mean, cov)
        # T Exp(mean), whose translation V(phi) rho is rho + phi x rho / 2 to the second order
        a, b, c = mean[0], mean[1], mean[2]
        x = mean[3] + 0.5 * (b * mean[5] - c * mean[4])
        y = mean[4] + 0.5 * (c * mean[3] - a * mean[5])
        z = mean[5] + 0.5 * (a * mean[4] - b * mean[3])
        for i in range(3):
            t[i] += R[i, 0] * x + R[i, 1] * y + R[i, 2] * z
        rotate_right(R, a, b, c, turned)
        put_pose(turned, t, R, t)
    moments(count, weights, Rs, ts, Cs, R, t, mean, cov)
    return top + math.log(total)


@kernel(
    "void(f8[:,::1], f8[:,::1], f8[::1], i8, f8, f8, f8, f8[:,:,::1], f8[:,::1], f8[:,::1], f8[:,::1], "
    "f8[:,:,::1], f8[:,:,::1], f8[:,::1], f8[:,::1], f8[:,:,::1], f8[::1])"
)
def integrate(V, tilt, f, count, separation, cut, floor, R, t, X, n, A, W, rows, H, cov, log_z):
    """Replace Laplace's means, covariances and probabilities of the modes by sums over grids of tilts."""
    logs, places, weights, mean = np.empty(MOST), np.empty(MOST), np.empty(MOST), np.empty(6)
    Rs, ts, Cs = np.empty((MOST, 3, 3)), np.empty((MOST, 3)), np.empty((MOST, 4, 4))
    box, u, reaches = np.empty(4), np.empty(2), np.zeros((2, 4))
    joined = count == 2 and min(f[0], f[1]) - floor < DROP
    u[0], u[1] = 1.0, 0.0
    if count == 2:
        u[0], u[1] = (tilt[1, 0] - tilt[0, 0]) / separation, (tilt[1, 1] - tilt[0, 1]) / separation
    for m in range(count):
        for k in range(4):  # back, ahead, right, left of the direction from the first minimum to the second
            away = math.inf
            if k == (1 if m == 0 else 0):
                away = 0.0 if joined else cut if m == 0 else separation - cut
            sign = -1.0 if k % 2 == 0 else 1.0
            ua, ub = (sign * u[0], sign * u[1]) if k < 2 else (-sign * u[1], sign * u[0])
            if away > 0.0:
                away = min(away, WIDEST)
                reaches[m, k] = reach(
                    V, tilt[m, 0], tilt[m, 1], ua, ub, f[m], away, R[m], t[m], X, n, A, W, rows, H
                )
    if joined:
        box[0], box[1] = -reaches[0, 0], separation + reaches[1, 1]
        box[2], box[3] = -max(reaches[0, 2], reaches[1, 2]), max(reaches[0, 3], reaches[1, 3])
        nodes = grid(
            V, tilt[0], u, box, ALONG, ACROSS, R[0], t[0], X, n, A, W, rows, logs, places, Rs, ts, Cs
        )  # fmt: skip
    for m in range(count):
        side = 0
        width = 0.25 * separation * math.exp(min(floor - min(f[0], f[1]), 0.0)) + 1e-9 if count == 2 else 1.0
        if joined:
            side = 1 if m == 0 else -1
        else:
            box[0], box[1], box[2], box[3] = -reaches[m, 0], reaches[m, 1], -reaches[m, 2], reaches[m, 3]
            nodes = grid(
                V, tilt[m], u, box, ALONE, ALONE, R[m], t[m], X, n, A, W, rows, logs, places, Rs, ts, Cs
            )  # fmt: skip
        log_z[m] = summed(
            nodes, logs, places, side, cut, width, weights, Rs, ts, Cs, R[m], t[m], cov[m], mean
        )


@kernel(
    "f8(f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,::1], f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,:,::1], "
    "f8[:,::1], f8[:,::1], f8[::1], f8[::1])"
)
def valley(V, tilt, R, t, X, n, A, W, rows, H, u, told):
    """Look along the line between two minima: fills u, its direction, and told, where and how low it is.

    Returns the angle between the minima.
    """
    R1, t1 = R[0].copy(), t[0].copy()
    u[0], u[1] = tilt[1, 0] - tilt[0, 0], tilt[1, 1] - tilt[0, 1]
    separation = math.hypot(u[0], u[1])
    u[0], u[1] = u[0] / separation, u[1] / separation
    told[0], told[1] = 0.5 * separation, math.inf
    for k in range(1, 16):
        s = separation * k / 16.0
        f = log_density(V, tilt[0, 0] + s * u[0], tilt[0, 1] + s * u[1], R1, t1, X, n, A, W, rows, H)
        if f < told[1]:
            told[0], told[1] = s, f
    return separation


@kernel(
    "i8(f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,:,::1], f8, f8[:,:,::1], f8[:,::1], f8[:,:,::1], "
    "f8[:,::1], f8[:,:,::1], f8[::1], f8[::1])"
)
def posterior(X, n, A, W, limit, R, t, best_R, best_t, cov, log_z, chi2):
    """Fill both modes; returns how many there are (0: the descent from R[0], t[0] failed).

    R (2, 3, 3) and t (2, 3) are the means, best_R and best_t the minima, cov (2, 6, 6), log_z (2,) the
    logarithms of the probability of each, chi2 (2,).  Where the better chi2 exceeds `limit`, the corners
    do not fit a rigid object as well as they claim, and all covariances grow by chi2 / limit: W is scaled.
    """
    H2 = np.empty((2, 6, 6))
    count = two_minima(X, n, A, W, R, t, chi2, H2)
    if count == 0:
        return 0
    scale = max(1.0, chi2[0] / limit)
    if scale > 1.0:
        for i in range(W.shape[0]):
            for j in range(W.shape[1]):
                for k in range(W.shape[2]):
                    W[i, j, k] /= math.sqrt(scale)
    rows, H, L, g = np.empty((2 * W.shape[1], 7)), np.empty((6, 6)), np.empty((6, 6)), np.empty(6)
    mean, V = np.empty(6), np.empty((3, 3))
    tilt, f = np.zeros((2, 2)), np.empty(2)
    sight_frame(t[0], V)
    for m in range(count):
        logdet = inverse(H2[m], 0, cov[m], L, g, mean)
        for i in range(6):
            for j in range(6):
                cov[m, i, j] *= scale
        log_z[m] = -0.5 * chi2[m] / scale - 0.5 * logdet + 3.0 * math.log(2.0 * math.pi * scale)
        tilt[m, 0], tilt[m, 1] = tilt_of(V, R[m])
        put_pose(R[m], t[m], best_R[m], best_t[m])
        f[m] = log_density(V, tilt[m, 0], tilt[m, 1], best_R[m], best_t[m], X, n, A, W, rows, H)
        put_pose(R[m], t[m], best_R[m], best_t[m])
    if count == 1:
        if max(cov[0, 0, 0], cov[0, 1, 1]) > NARROW * NARROW:
            integrate(V, tilt, f, 1, 0.0, math.inf, -math.inf, R, t, X, n, A, W, rows, H, cov, log_z)
        return 1
    u, told = np.empty(2), np.empty(2)
    separation = valley(V, tilt, R, t, X, n, A, W, rows, H, u, told)
    if f[0] - told[1] < SHARP:
        integrate(V, tilt, f, 2, separation, told[0], told[1], R, t, X, n, A, W, rows, H, cov, log_z)
    return 2
