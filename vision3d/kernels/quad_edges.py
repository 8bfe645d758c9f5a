"""Corners of dark quadrilaterals on white, from lines fitted to their four sides.

Along each side the edge is found every pixel, from the area under the profile of grey levels across it:
between a dark level d and a bright level b, the edge lies where a sharp step of the same area would.  A blur
that is symmetric moves that place nowhere, noise is averaged over hundreds of pixels, and the scatter about
the fitted line says what the line is worth.  A corner is where two lines meet; since neighbouring corners
share a line, the covariance is one matrix for all four, (8, 8), order x0 y0 x1 y1 …

Image rows are y, columns are x, the centre of the first pixel is (0, 0).  Corners run clockwise as seen in
the image (y down), so that the outward normal of a side of direction (dx, dy) is (dy, -dx).
"""

from __future__ import annotations

import math

import numpy as np

from vision3d.kernels import inlined, kernel

__all__ = ["refine_quads"]

STEPS_PX = 0.5  # between samples of a profile
SHORTEST_PX, LONGEST_PX = 2.0, 4.0  # half of a profile
MOST = 400  # places along a side


@inlined
def grey(image, x, y):
    """Bilinear grey level; -1 outside."""
    h, w = image.shape
    if not (x >= 0.0 and y >= 0.0 and x < w - 1 and y < h - 1):
        return -1.0
    j, i = int(x), int(y)
    a, b = x - j, y - i
    top = (1.0 - a) * image[i, j] + a * image[i, j + 1]
    bottom = (1.0 - a) * image[i + 1, j] + a * image[i + 1, j + 1]
    return (1.0 - b) * top + b * bottom


@kernel("f8(u1[:,::1], f8, f8, f8, f8, f8, f8[::1])")
def edge_offset(image, x, y, nx, ny, half, profile):
    """Where the edge lies along the normal from (x, y), px outward; NaN where there is none."""
    count = round(2.0 * half / STEPS_PX) + 1
    for k in range(count):
        s = -half + k * STEPS_PX
        g = grey(image, x + s * nx, y + s * ny)
        if g < 0.0:
            return math.nan
        profile[k] = g
    dark = (profile[0] + profile[1]) / 2.0
    bright = (profile[count - 1] + profile[count - 2]) / 2.0
    contrast = bright - dark
    if contrast < 12.0:
        return math.nan
    area = 0.0
    for k in range(count):
        weight = 0.5 if k in (0, count - 1) else 1.0
        area += weight * (profile[k] - dark)
    offset = half - area * STEPS_PX / contrast
    if abs(offset) > half - 0.5:
        return math.nan
    return offset


@inlined
def solved(H, g, order, found, cov):
    """Solve the first `order` of three normal equations; the rest of `found` and `cov` is zero."""
    cov[:] = 0.0
    det = H[0, 0] * H[1, 1] - H[0, 1] * H[0, 1]
    if not det > 1e-9 * H[0, 0] * H[0, 0]:
        return False
    if order == 2:
        cov[0, 0], cov[1, 1] = H[1, 1] / det, H[0, 0] / det
        cov[0, 1] = cov[1, 0] = -H[0, 1] / det
        found[2] = 0.0
    else:
        a, b, c, d, e, f = H[0, 0], H[0, 1], H[0, 2], H[1, 1], H[1, 2], H[2, 2]
        whole = a * (d * f - e * e) - b * (b * f - c * e) + c * (b * e - c * d)
        if not whole > 1e-12 * a * a * a:
            return False
        cov[0, 0], cov[1, 1], cov[2, 2] = (d * f - e * e) / whole, (a * f - c * c) / whole, det / whole
        cov[0, 1] = cov[1, 0] = (c * e - b * f) / whole
        cov[0, 2] = cov[2, 0] = (b * e - c * d) / whole
        cov[1, 2] = cov[2, 1] = (b * c - a * e) / whole
    for i in range(order):
        found[i] = cov[i, 0] * g[0] + cov[i, 1] * g[1] + (cov[i, 2] * g[2] if order == 3 else 0.0)
    return True


@kernel("i8(f8[::1], f8[::1], i8, f8, f8[::1], f8[:,::1])")
def fit_curve(places, offsets, count, length, found, cov):
    """Fit offset = a + b u + c u² robustly, u = place / length - 1/2; c only where the side is clearly bent.

    `found` (4,) receives a, b, c and the scatter; `cov` (3, 3) their covariance.  Returns the points kept.
    """
    H, g = np.zeros((3, 3)), np.zeros(3)
    scatter, used, order = 1.0, count, 2
    found[:] = 0.0
    for rounds in range(6):
        if rounds == 3 and count >= 24:
            order = 3
        H[:] = 0.0
        g[:] = 0.0
        used = 0
        for k in range(count):
            u = places[k] / length - 0.5
            r = offsets[k] - found[0] - found[1] * u - found[2] * u * u
            weight = 1.0
            if rounds > 0 and abs(r) > 2.0 * scatter:
                weight = 2.0 * scatter / abs(r)
                if abs(r) > 6.0 * scatter:
                    continue
            used += 1
            H[0, 0] += weight
            H[0, 1] += weight * u
            H[1, 1] += weight * u * u
            H[0, 2] += weight * u * u
            H[1, 2] += weight * u * u * u
            H[2, 2] += weight * u * u * u * u
            g[0] += weight * offsets[k]
            g[1] += weight * offsets[k] * u
            g[2] += weight * offsets[k] * u * u
        if used < max(4, count // 3) or not solved(H, g, order, found, cov):
            return 0
        squares, kept = 0.0, 0
        for k in range(count):
            u = places[k] / length - 0.5
            r = abs(offsets[k] - found[0] - found[1] * u - found[2] * u * u)
            if rounds == 0 or r <= 6.0 * scatter:
                r = min(r, 2.5 * scatter) if rounds > 0 else r
                squares += r * r
                kept += 1
        scatter = max(math.sqrt(squares / max(1, kept - order)), 0.01)
        if rounds == 5 and order == 3 and abs(found[2]) < 4.0 * scatter * math.sqrt(2.0 * cov[2, 2]):
            order = 2
            found[2] = 0.0
            if not solved(H, g, 2, found, cov):
                return 0
    found[3] = scatter
    for i in range(3):
        for j in range(3):
            cov[i, j] *= scatter * scatter
    return used


@inlined
def meet(quad, found, k, corners, D):
    """Corner k: where the side before it and the side after it meet, by three Newton steps."""
    b = (k + 3) % 4
    bx, by = quad[k, 0] - quad[b, 0], quad[k, 1] - quad[b, 1]
    ax, ay = quad[(k + 1) % 4, 0] - quad[k, 0], quad[(k + 1) % 4, 1] - quad[k, 1]
    bl, al = math.hypot(bx, by), math.hypot(ax, ay)
    bx, by, ax, ay = bx / bl, by / bl, ax / al, ay / al
    cross = by * -ax + bx * ay  # of the two outward normals (by, -bx) and (ay, -ax)
    if abs(cross) < 0.1:
        return False
    x = y = 0.0
    for _ in range(3):
        u, v = (x * bx + y * by) / bl + 0.5, (x * ax + y * ay) / al - 0.5
        before = found[b, 0] + found[b, 1] * u + found[b, 2] * u * u
        after = found[k, 0] + found[k, 1] * v + found[k, 2] * v * v
        # by x - bx y = before, ay x - ax y = after
        x, y = (-ax * before + bx * after) / cross, (by * after - ay * before) / cross
    corners[k, 0], corners[k, 1] = quad[k, 0] + x, quad[k, 1] + y
    D[2 * k, 2 * b + 1], D[2 * k, 2 * k] = -ax / cross, bx / cross
    D[2 * k + 1, 2 * b + 1], D[2 * k + 1, 2 * k] = -ay / cross, by / cross
    return True


@kernel("b1(u1[:,::1], f8[:,::1], f8, f8, f8, f8[:,::1], f8[:,::1])")
def refine_quad(image, quad, half, floor_px, correlation, corners, cov):
    """One round: lines through the four sides of `quad`, their meeting points and their covariance."""
    places, offsets, profile = np.empty(MOST), np.empty(MOST), np.empty(64)
    found, line_cov = np.zeros((4, 4)), np.zeros((4, 3, 3))
    for k in range(4):
        x, y = quad[k, 0], quad[k, 1]
        dx, dy = quad[(k + 1) % 4, 0] - x, quad[(k + 1) % 4, 1] - y
        length = math.hypot(dx, dy)
        if not length > 8.0:
            return False
        dx, dy = dx / length, dy / length
        margin = min(max(2.5, 0.06 * length), 0.25 * length)
        step = max(1.0, (length - 2.0 * margin) / (MOST - 1))
        count, u = 0, margin
        while u <= length - margin and count < MOST:
            s = edge_offset(image, x + u * dx, y + u * dy, dy, -dx, half, profile)
            if not math.isnan(s):
                places[count], offsets[count] = u, s
                count += 1
            u += step
        if count < 5 or count * step < 0.4 * (length - 2.0 * margin):
            return False
        if fit_curve(places, offsets, count, length, found[k], line_cov[k]) == 0:
            return False
    D = np.zeros((8, 8))  # of a corner by the offset of each line at it: columns (line, begin or end)
    ends = np.zeros((8, 8))
    for k in range(4):
        at = np.array([[1.0, -0.5, 0.25], [1.0, 0.5, 0.25]])
        for i in range(2):
            for j in range(2):
                s = 0.0
                for p in range(3):
                    for q in range(3):
                        s += at[i, p] * correlation * line_cov[k, p, q] * at[j, q]
                ends[2 * k + i, 2 * k + j] = s
            ends[2 * k + i, 2 * k + i] += floor_px * floor_px
    for k in range(4):
        if not meet(quad, found, k, corners, D):
            return False
    for i in range(8):
        for j in range(8):
            s = 0.0
            for p in range(8):
                for q in range(p - p % 2, p - p % 2 + 2):
                    s += D[i, p] * ends[p, q] * D[j, q]
            cov[i, j] = s
    return True


@kernel("void(u1[:,::1], f8[:,:,::1], i8, f8, f8, f8, f8[:,:,::1], f8[:,:,::1], b1[::1])")
def refine_quads(image, quads, cells, floor_px, correlation, reach_px, corners, covs, refined):
    """Refine quadrilaterals (M, 4, 2) of `cells` cells a side, borders included; two rounds each.

    `corners` (M, 4, 2) and `covs` (M, 8, 8) are filled where `refined` (M,) becomes True.  A corner that
    would move further than `reach_px` (or a third of a cell, if that is more) leaves its quadrilateral alone.
    Where the white around a marker is too narrow for long profiles, short ones are tried.
    """
    start = np.empty((4, 2))
    for m in range(quads.shape[0]):
        around = 0.0
        for k in range(4):
            side_x, side_y = (
                quads[m, (k + 1) % 4, 0] - quads[m, k, 0],
                quads[m, (k + 1) % 4, 1] - quads[m, k, 1],
            )
            around += math.hypot(side_x, side_y)
        cell = 0.25 * around / cells
        reach = max(reach_px, 0.34 * cell)
        refined[m] = False
        for half in (
            min(max(SHORTEST_PX, 0.8 * cell), LONGEST_PX),
            0.5 * (SHORTEST_PX + LONGEST_PX),
            SHORTEST_PX,
        ):
            start[:] = quads[m]
            for _ in range(3):
                refined[m] = refine_quad(image, start, half, floor_px, correlation, corners[m], covs[m])
                for k in range(4):
                    if (
                        math.hypot(corners[m, k, 0] - quads[m, k, 0], corners[m, k, 1] - quads[m, k, 1])
                        > reach
                    ):
                        refined[m] = False
                if not refined[m]:
                    corners[m] = quads[m]
                    break
                start[:] = corners[m]
            if refined[m]:
                break
