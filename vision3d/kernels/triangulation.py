"""Points of space from their pixels in two or more images, thousands at a time.

A point is homogeneous, X = (x, y, z, w) of unit length, so that one at infinity (w = 0) is a point like any
other.  The start is linear (Hartley and Zisserman 2004, section 12.2), its smallest singular vector found by
one-sided Jacobi rotations, which do not square the condition.  The optimum has the least whitened
reprojection error through the real lenses, by Levenberg-Marquardt on the sphere of unit X.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import b0, f2, f3, i1, w2, w3
from vision3d.kernels.lenses import FISHEYE4, project_point_one

__all__ = ["ANGLE", "CHI2", "IN_FRONT", "RMS", "STATS", "VIEWS", "triangulate"]

RMS, CHI2, ANGLE, VIEWS, IN_FRONT = range(5)
STATS = 5
SWEEPS, TRIES = 30, 40
CONVERGED = 1e-13


@inlined
def smallest_vector(a, rows, basis, x):
    """The unit vector x (4,) that makes `a` x shortest, of the first rows of `a` (rows, 4); spoils a."""
    for i in range(4):
        for j in range(4):
            basis[i, j] = 1.0 if i == j else 0.0
    for _ in range(SWEEPS):
        turned = False
        for p in range(3):
            for q in range(p + 1, 4):
                alpha, beta, gamma = 0.0, 0.0, 0.0
                for k in range(rows):
                    alpha += a[k, p] * a[k, p]
                    beta += a[k, q] * a[k, q]
                    gamma += a[k, p] * a[k, q]
                if abs(gamma) <= 1e-16 * math.sqrt(alpha * beta) or gamma == 0.0:
                    continue
                turned = True
                zeta = (beta - alpha) / (2.0 * gamma)
                t = (1.0 if zeta >= 0.0 else -1.0) / (abs(zeta) + math.sqrt(1.0 + zeta * zeta))
                c = 1.0 / math.sqrt(1.0 + t * t)
                s = c * t
                for k in range(rows):
                    u, v = a[k, p], a[k, q]
                    a[k, p], a[k, q] = c * u - s * v, s * u + c * v
                for k in range(4):
                    u, v = basis[k, p], basis[k, q]
                    basis[k, p], basis[k, q] = c * u - s * v, s * u + c * v
        if not turned:
            break
    best, shortest = 3, math.inf
    for j in range(4):
        length = 0.0
        for k in range(rows):
            length += a[k, j] * a[k, j]
        if length < shortest:
            best, shortest = j, length
    for i in range(4):
        x[i] = basis[i, best]


@inlined
def tangent(x, b):
    """Unit vectors (4, 3) across x and each other, columns of the reflection that takes x to the w axis."""
    sign = 1.0 if x[3] >= 0.0 else -1.0
    scale = 1.0 / (1.0 + sign * x[3])
    for i in range(4):
        v = x[i] + (sign if i == 3 else 0.0)
        for j in range(3):
            b[i, j] = (1.0 if i == j else 0.0) - scale * v * x[j]


@inlined
def seen_at(projection, x, d):
    """The point in the frame of a camera, up to a positive scale."""
    for i in range(3):
        d[i] = (
            projection[i, 0] * x[0]
            + projection[i, 1] * x[1]
            + projection[i, 2] * x[2]
            + projection[i, 3] * x[3]
        )


@inlined
def whitened(given, n, x, room):
    """Normal equations h (3, 3), g (3,) on the tangent `b` at x; sums: whitened and plain squares."""
    codes, params, projections, pixels, whiten, rays = given
    b, h, g, d, d_point, jacobian, sums = room
    chi2, plain = 0.0, 0.0
    h[:, :] = 0.0
    g[:] = 0.0
    for v in range(codes.shape[0]):
        if math.isnan(rays[v, n, 0]):
            continue
        seen_at(projections[v], x, d)
        pu, pv = project_point_one(codes[v], params[v], math.inf, d[0], d[1], d[2], d_point)
        ru, rv = pixels[v, n, 0] - pu, pixels[v, n, 1] - pv
        if math.isnan(ru + rv):
            chi2 = math.inf
            break
        w00, w01, w10, w11 = whiten[v, n, 0], whiten[v, n, 1], whiten[v, n, 2], whiten[v, n, 3]
        eu, ev = w00 * ru + w01 * rv, w10 * ru + w11 * rv
        plain += ru * ru + rv * rv
        chi2 += eu * eu + ev * ev
        p = projections[v]
        jacobian[:, :] = 0.0
        for k in range(4):
            mu = d_point[0, 0] * p[0, k] + d_point[0, 1] * p[1, k] + d_point[0, 2] * p[2, k]
            mv = d_point[1, 0] * p[0, k] + d_point[1, 1] * p[1, k] + d_point[1, 2] * p[2, k]
            for i in range(3):
                jacobian[0, i] += (w00 * mu + w01 * mv) * b[k, i]
                jacobian[1, i] += (w10 * mu + w11 * mv) * b[k, i]
        for i in range(3):
            g[i] += jacobian[0, i] * eu + jacobian[1, i] * ev
            for k in range(i + 1):
                h[i, k] += jacobian[0, i] * jacobian[0, k] + jacobian[1, i] * jacobian[1, k]
    sums[0], sums[1] = chi2, plain


@inlined
def inverted(h, damping, c):
    """The inverse c (3, 3) of the lower half h with its diagonal enlarged; False where it has none."""
    l00 = h[0, 0] * (1.0 + damping)
    if not l00 > 0.0:
        return False
    l00 = math.sqrt(l00)
    l10, l20 = h[1, 0] / l00, h[2, 0] / l00
    l11 = h[1, 1] * (1.0 + damping) - l10 * l10
    if not l11 > 0.0:
        return False
    l11 = math.sqrt(l11)
    l21 = (h[2, 1] - l20 * l10) / l11
    l22 = h[2, 2] * (1.0 + damping) - l20 * l20 - l21 * l21
    if not l22 > 0.0:
        return False
    l22 = math.sqrt(l22)
    # the inverse of the triangle, then its transpose times itself
    i00, i11, i22 = 1.0 / l00, 1.0 / l11, 1.0 / l22
    i10 = -l10 * i00 * i11
    i21 = -l21 * i11 * i22
    i20 = -(l20 * i00 + l21 * i10) * i22
    c[0, 0], c[1, 1], c[2, 2] = i00 * i00 + i10 * i10 + i20 * i20, i11 * i11 + i21 * i21, i22 * i22
    c[0, 1] = c[1, 0] = i10 * i11 + i20 * i21
    c[0, 2] = c[2, 0] = i20 * i22
    c[1, 2] = c[2, 1] = i21 * i22
    return True


@inlined
def constraints(codes, projections, rays, n, a):
    """Fill `a` with two rows for each image of point n that a point on its ray makes zero; how many."""
    rows = 0
    for v in range(codes.shape[0]):
        r = rays[v, n]
        if math.isnan(r[0]):
            continue
        p = projections[v]
        if codes[v] == FISHEYE4:
            # two directions across the ray, which may look sideways
            k = 0 if abs(r[0]) <= min(abs(r[1]), abs(r[2])) else (1 if abs(r[1]) <= abs(r[2]) else 2)
            ex = -r[k] * r[0] + (1.0 if k == 0 else 0.0)
            ey = -r[k] * r[1] + (1.0 if k == 1 else 0.0)
            ez = -r[k] * r[2] + (1.0 if k == 2 else 0.0)
            fx, fy, fz = r[1] * ez - r[2] * ey, r[2] * ex - r[0] * ez, r[0] * ey - r[1] * ex
            for j in range(4):
                a[rows, j] = ex * p[0, j] + ey * p[1, j] + ez * p[2, j]
                a[rows + 1, j] = fx * p[0, j] + fy * p[1, j] + fz * p[2, j]
        else:
            for j in range(4):
                a[rows, j] = r[0] / r[2] * p[2, j] - p[0, j]
                a[rows + 1, j] = r[1] / r[2] * p[2, j] - p[1, j]
        rows += 2
    return rows


@inlined
def surveyed(projections, centres, rays, n, x, d, ways):
    """Whether point n lies ahead of every camera that sees it, and the widest angle between their rays."""
    front, widest, count = x[3] > 0.0, 0.0, 0
    for v in range(projections.shape[0]):
        r = rays[v, n]
        if math.isnan(r[0]):
            continue
        seen_at(projections[v], x, d)
        front = front and r[0] * d[0] + r[1] * d[1] + r[2] * d[2] > 0.0
        for i in range(3):
            ways[count, i] = x[i] - x[3] * centres[v, i]
        for k in range(count):
            cx = ways[k, 1] * ways[count, 2] - ways[k, 2] * ways[count, 1]
            cy = ways[k, 2] * ways[count, 0] - ways[k, 0] * ways[count, 2]
            cz = ways[k, 0] * ways[count, 1] - ways[k, 1] * ways[count, 0]
            dot = ways[k, 0] * ways[count, 0] + ways[k, 1] * ways[count, 1] + ways[k, 2] * ways[count, 2]
            widest = max(widest, math.atan2(math.sqrt(cx * cx + cy * cy + cz * cz), dot))
        count += 1
    return front, widest


@kernel(types.void(i1, f2, f3, f2, f3, f3, f3, b0, w2, w3, w2))
def triangulate(codes, params, projections, centres, pixels, rays, whiten, refine, points, covs, stats):
    """Fill points (N, 4) of unit length, their covariances (N, 4, 4) across it, and stats (N, STATS).

    `codes` (V,), `params` (V, k) of the lenses; `projections` (V, 3, 4) take X to each camera's frame,
    `centres` (V, 3); `pixels` (V, N, 2), their unit rays (V, N, 3), NaN where a point is not seen; `whiten`
    (V, N, 4) takes a residual (px) to one of unit variance.  NaN for points that fewer than two images show.
    """
    views = codes.shape[0]
    a, basis = np.empty((2 * views, 4)), np.empty((4, 4))
    x, tried, d, d_point = np.empty(4), np.empty(4), np.empty(3), np.empty((2, 3))
    jacobian = np.empty((2, 3))
    b, h, g, c = np.empty((4, 3)), np.empty((3, 3)), np.empty(3), np.empty((3, 3))
    sums, ways = np.empty(2), np.empty((views, 3))
    given, room = (codes, params, projections, pixels, whiten, rays), (b, h, g, d, d_point, jacobian, sums)
    for n in range(pixels.shape[1]):
        rows = constraints(codes, projections, rays, n, a)
        seen = rows // 2
        stats[n, VIEWS], stats[n, IN_FRONT] = seen, 0.0
        if seen < 2:
            points[n, :] = covs[n, :, :] = math.nan
            stats[n, RMS] = stats[n, CHI2] = stats[n, ANGLE] = math.nan
            continue
        smallest_vector(a, rows, basis, x)
        agree = 0
        for v in range(views):
            r = rays[v, n]
            if not math.isnan(r[0]):
                seen_at(projections[v], x, d)
                agree += 1 if r[0] * d[0] + r[1] * d[1] + r[2] * d[2] > 0.0 else -1
        if agree < 0 or (agree == 0 and x[3] < 0.0):
            x[:] = -x
        tangent(x, b)
        whitened(given, n, x, room)
        if refine and sums[0] == math.inf:
            # behind some camera: begin at infinity, in the middle of the rays
            x[:] = 0.0
            for v in range(views):
                if not math.isnan(rays[v, n, 0]):
                    for i in range(3):
                        for j in range(3):
                            x[i] += projections[v, j, i] * rays[v, n, j]
            length = math.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
            for i in range(3):
                x[i] /= length
            tangent(x, b)
            whitened(given, n, x, room)
        cost, damping = sums[0], 1e-6
        for _ in range(TRIES if refine and cost < math.inf else 0):
            if not inverted(h, damping, c):
                damping = max(10.0 * damping, 1e-12)
                continue
            step, square = np.zeros(3), 0.0
            for i in range(3):
                step[i] = c[i, 0] * g[0] + c[i, 1] * g[1] + c[i, 2] * g[2]
                square += step[i] * step[i]
            length = 0.0
            for i in range(4):
                tried[i] = x[i] + b[i, 0] * step[0] + b[i, 1] * step[1] + b[i, 2] * step[2]
                length += tried[i] * tried[i]
            for i in range(4):
                tried[i] /= math.sqrt(length)
            if square < CONVERGED * CONVERGED:
                break
            tangent(tried, b)
            whitened(given, n, tried, room)
            if sums[0] <= cost:
                small = square < 1e-18 or (cost - sums[0] <= 1e-15 * cost and damping < 1e-9)
                x[:] = tried
                cost, damping = sums[0], 0.1 * damping
                if small:
                    break
                continue
            damping = max(10.0 * damping, 1e-9)
            tangent(x, b)
            whitened(given, n, x, room)
            if damping > 1e9:
                break
        tangent(x, b)
        whitened(given, n, x, room)
        covs[n, :, :] = math.nan
        if sums[0] < math.inf and inverted(h, 0.0, c):
            for i in range(4):
                for j in range(4):
                    total = 0.0
                    for k in range(3):
                        for m in range(3):
                            total += b[i, k] * c[k, m] * b[j, m]
                    covs[n, i, j] = total
        points[n, :] = x
        stats[n, CHI2] = sums[0]
        stats[n, RMS] = math.sqrt(sums[1] / seen)
        front, stats[n, ANGLE] = surveyed(projections, centres, rays, n, x, d, ways)
        stats[n, IN_FRONT] = 1.0 if front else 0.0
