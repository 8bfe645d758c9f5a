"""Corners of dark quadrilaterals on white, from lines fitted to their four sides.

Along each side the edge is found every pixel, as the centre of the slope of the grey levels across it.  A
blur that is symmetric moves that place nowhere, noise is averaged over hundreds of pixels, and the scatter
about the fitted line says what the line is worth.  A corner is where two lines meet; since neighbours
share a line, the covariance is one matrix for all four corners, (8, 8), order x0 y0 x1 y1 …

Corners run clockwise as seen in the image (y down): the outward normal of a side (dx, dy) is (dy, -dx).
"""

from __future__ import annotations

import math

import numpy as np

from vision3d.kernels import inlined, kernel

__all__ = ["refine_quads"]

STEPS_PX = 0.5  # between samples of a profile
SHORTEST_PX, USUAL_PX, LONGEST_PX = 1.25, 2.0, 7.0  # half of a profile
SHORTEST_SIDE_PX = 6.0
LEAST_CONTRAST = 12.0
ROUNDS = 8
MOST = 400  # places along a side


@inlined
def grey(image, x, y):
    """Bilinear grey level; -1 outside."""
    if not (x >= 0.0 and y >= 0.0 and x < image.shape[1] - 1 and y < image.shape[0] - 1):
        return -1.0
    j, i = int(x), int(y)
    a, b = x - j, y - i
    top = (1.0 - a) * image[i, j] + a * image[i, j + 1]
    bottom = (1.0 - a) * image[i + 1, j] + a * image[i + 1, j + 1]
    return (1.0 - b) * top + b * bottom


@kernel("f8(u1[:,::1], f8, f8, f8, f8, f8, f8[::1], f8[::1])")
def edge_offset(image, x, y, nx, ny, half, profile, response):
    """Where the edge lies along the normal from (x, y), px outward; NaN where there is none.

    It is the centre of the slope within +- `half`.  A window shorter than the slope moves less than the edge
    does: response[0] becomes by what share, response[1] the contrast.
    """
    count = round(4.0 * half) + 1
    step = 2.0 * half / (count - 1)
    for k in range(count):
        s = -half + k * step
        g = grey(image, x + s * nx, y + s * ny)
        if g < 0.0:
            return math.nan
        profile[k] = g
    contrast = profile[count - 1] - profile[0]
    if contrast < LEAST_CONTRAST:
        return math.nan
    area = -0.5 * contrast
    for k in range(count):
        area += profile[k] - profile[0]
    ends = profile[1] - profile[0] + profile[count - 1] - profile[count - 2]
    response[0] = 1.0 - half * ends / (step * contrast)
    response[1] = contrast
    return half - area * step / contrast


@inlined
def solved(H, g, found, cov):
    """Solve three normal equations; False where they are singular."""
    a, b, c, d, e, f = H[0, 0], H[0, 1], H[0, 2], H[1, 1], H[1, 2], H[2, 2]
    whole = a * (d * f - e * e) - b * (b * f - c * e) + c * (b * e - c * d)
    if not whole > 1e-12 * a * a * a:
        return False
    cov[0, 0], cov[1, 1], cov[2, 2] = (
        (d * f - e * e) / whole,
        (a * f - c * c) / whole,
        (a * d - b * b) / whole,
    )
    cov[0, 1] = cov[1, 0] = (c * e - b * f) / whole
    cov[0, 2] = cov[2, 0] = (b * e - c * d) / whole
    cov[1, 2] = cov[2, 1] = (b * c - a * e) / whole
    for i in range(3):
        found[i] = cov[i, 0] * g[0] + cov[i, 1] * g[1] + cov[i, 2] * g[2]
    return True


@kernel("i8(f8[::1], f8[::1], i8, f8, f8, f8, f8[::1], f8[:,::1])")
def fit_curve(places, offsets, count, length, bend, bend_sigma, found, cov):
    """Fit offset = a + b u + c u² robustly, u = place / length - 1/2.

    A lens bends straight sides: c is `bend` within `bend_sigma` before anything is seen.  `found` (4,)
    receives a, b, c and the scatter; `cov` (3, 3) their covariance.  Returns the points kept, 0 if too few.
    """
    H, g = np.zeros((3, 3)), np.zeros(3)
    scatter, used = 0.5, count
    found[0], found[1], found[2] = 0.0, 0.0, bend
    for turn in range(6):
        H[:] = 0.0
        g[:] = 0.0
        used = 0
        for k in range(count):
            u = places[k] / length - 0.5
            r = abs(offsets[k] - found[0] - found[1] * u - found[2] * u * u)
            weight = 1.0
            if turn > 0 and r > 2.0 * scatter:
                weight = 2.0 * scatter / r
                if r > 6.0 * scatter:
                    continue
            used += 1
            H[0, 0] += weight
            H[0, 1] += weight * u
            H[1, 1] += weight * u * u
            H[1, 2] += weight * u * u * u
            H[2, 2] += weight * u * u * u * u
            g[0] += weight * offsets[k]
            g[1] += weight * offsets[k] * u
            g[2] += weight * offsets[k] * u * u
        H[1, 0], H[0, 2], H[2, 0], H[2, 1] = H[0, 1], H[1, 1], H[1, 1], H[1, 2]
        ratio = scatter * scatter / (bend_sigma * bend_sigma)
        H[2, 2] += ratio
        g[2] += ratio * bend
        if used < max(4, count // 2) or not solved(H, g, found, cov):
            return 0
        squares, kept = 0.0, 0
        for k in range(count):
            u = places[k] / length - 0.5
            r = abs(offsets[k] - found[0] - found[1] * u - found[2] * u * u)
            if turn == 0 or r <= 6.0 * scatter:
                r = min(r, 2.5 * scatter) if turn > 0 else r
                squares += r * r
                kept += 1
        scatter = max(math.sqrt(squares / max(1, kept - 2)), 0.01)
    found[3] = scatter
    cov *= scatter * scatter
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


@kernel("f8(u1[:,::1], f8, f8, f8, f8, f8, f8, f8, f8[::1], f8[:,::1])")
def side_line(image, x, y, dx, dy, half, bend, bend_sigma, found, cov):
    """Fit the edge from (x, y) to (x + dx, y + dy), offsets outward; returns its response, 0 if none."""
    places, offsets, contrasts = np.empty(MOST), np.empty(MOST), np.empty(MOST)
    profile, response = np.empty(64), np.empty(2)
    length = math.hypot(dx, dy)
    dx, dy = dx / length, dy / length
    margin = min(max(1.2 * half + 0.7, 0.06 * length), 0.28 * length)
    step = max(1.0, (length - 2.0 * margin) / (MOST - 1))
    count, tried, responses, most, u = 0, 0, 0.0, 0.0, margin
    while u <= length - margin and tried < MOST:
        s = edge_offset(image, x + u * dx, y + u * dy, dy, -dx, half, profile, response)
        if not math.isnan(s):
            places[count], offsets[count], contrasts[count] = u, s, response[1]
            most = max(most, response[1])
            responses += response[0]
            count += 1
        tried += 1
        u += step
    total, count = count, 0
    for k in range(total):  # where the profile is not of dark on white alone, its contrast is low
        if contrasts[k] > 0.5 * most:
            places[count], offsets[count] = places[k], offsets[k]
            count += 1
    if count < max(4, int(0.6 * tried)):
        return 0.0
    share = min(max(responses / total, 0.3), 1.0)
    for k in range(count):
        offsets[k] = min(max(offsets[k] / share, -1.2 * half), 1.2 * half)
    return share if fit_curve(places, offsets, count, length, bend, bend_sigma, found, cov) else 0.0


@kernel("b1(u1[:,::1], f8[:,::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8[:,::1])")
def refine_quad(image, quad, halves, bends, floors, responses, noise, corners, cov):
    """One round: lines through the four sides of `quad`, their meeting points and their covariance."""
    found, line_cov = np.zeros((4, 4)), np.zeros((4, 3, 3))
    for k in range(4):
        x, y = quad[k, 0], quad[k, 1]
        dx, dy = quad[(k + 1) % 4, 0] - x, quad[(k + 1) % 4, 1] - y
        if not math.hypot(dx, dy) > SHORTEST_SIDE_PX:
            return False
        unsure = max(0.02, noise[2] * (dx * dx + dy * dy))
        responses[k] = side_line(image, x, y, dx, dy, halves[k], bends[k], unsure, found[k], line_cov[k])
        if responses[k] == 0.0:
            return False
    D = np.zeros((8, 8))  # of a corner by the offset of each line at it: columns (line, begin or end)
    ends = np.zeros((8, 8))
    at = np.array([[1.0, -0.5, 0.25], [1.0, 0.5, 0.25]])
    for k in range(4):
        for i in range(2):
            for j in range(2):
                s = 0.0
                for p in range(3):
                    for q in range(3):
                        s += at[i, p] * noise[1] * line_cov[k, p, q] * at[j, q]
                ends[2 * k + i, 2 * k + j] = s
            ends[2 * k + i, 2 * k + i] += floors[k] * floors[k]
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


@inlined
def blur_of(half, response):
    """Sigma of the slope whose window of +- half answers with this share of a shift, px."""
    low, high = 0.2, 3.0
    for _ in range(18):
        middle = 0.5 * (low + high)
        x = half / middle
        slope = math.sqrt(2.0 / math.pi) * x * math.exp(-0.5 * x * x)
        if 1.0 - slope / math.erf(x / math.sqrt(2.0)) > response:
            low = middle
        else:
            high = middle
    return low


@kernel("void(u1[:,::1], f8[:,:,::1], f8[:,::1], i8, f8[::1], f8, f8[:,:,::1], f8[:,:,::1], b1[::1])")
def refine_quads(image, quads, bends, cells, noise, reach_px, corners, covs, refined):
    """Refine quadrilaterals (M, 4, 2) of `cells` cells a side, borders included.

    `bends` (M, 4) is by how much each side is bent, as offset / u² with u from -1/2 to 1/2 along it.  `noise`
    is: px that no line is better than; factor of a line's variance, for profiles that share pixels; sigma of
    the bend over the square of the side's length.
    `corners` (M, 4, 2) and `covs` (M, 8, 8) are filled where `refined` (M,) becomes True.  A corner that
    would move further than `reach_px` (or a third of a cell, if that is more) leaves its quadrilateral alone.
    Profiles keep within a cell to both sides of the edge, and are as long as the blur asks for.
    """
    start, halves, widest, responses = np.empty((4, 2)), np.empty(4), np.empty(4), np.empty(4)
    floors = np.empty(4)  # a cell narrower than the blur leaves no place to the edge alone
    for m in range(quads.shape[0]):
        around, cell = 0.0, np.empty(4)
        for k in range(4):
            x, y = quads[m, k, 0], quads[m, k, 1]
            dx, dy = quads[m, (k + 1) % 4, 0] - x, quads[m, (k + 1) % 4, 1] - y
            length = math.hypot(dx, dy)
            around += length
            across = 0.0
            for i in range(2, 4):
                px, py = quads[m, (k + i) % 4, 0] - x, quads[m, (k + i) % 4, 1] - y
                across += 0.5 * abs(px * dy - py * dx) / max(length, 1e-9)
            cell[k] = across / cells
            widest[k] = min(max(0.5 * cell[k], SHORTEST_PX), LONGEST_PX)
            halves[k] = min(max(0.7 * cell[k], 1.5), 3.0)
            floors[k] = noise[0]
            start[k, 0], start[k, 1] = x, y
        reach = max(reach_px, 0.085 * around / cells)
        for turn in range(ROUNDS):
            refined[m] = refine_quad(
                image, start, halves, bends[m], floors, responses, noise, corners[m], covs[m]
            )
            moved = 0.0
            for k in range(4):
                x, y = corners[m, k, 0], corners[m, k, 1]
                if math.hypot(x - quads[m, k, 0], y - quads[m, k, 1]) > reach:
                    refined[m] = False
                moved = max(moved, math.hypot(x - start[k, 0], y - start[k, 1]))
            if not refined[m] or (turn > 1 and moved < 0.005):
                break
            for k in range(4):
                start[k, 0], start[k, 1] = corners[m, k, 0], corners[m, k, 1]
                blurs = cell[k] / blur_of(halves[k], responses[k])  # what lies beyond the next edge shines in
                floors[k] = noise[0] + 0.2 * math.exp(2.2 - blurs)
                if turn == 0:
                    halves[k] = min(widest[k], USUAL_PX)
                elif responses[k] < 0.75:
                    halves[k] = min(1.5 * halves[k], widest[k])
        if not refined[m]:
            for k in range(4):
                corners[m, k, 0], corners[m, k, 1] = quads[m, k, 0], quads[m, k, 1]
