"""Cast rays into a scene of rectangles and spheres, and see what is printed where they land.

A scene is a table (P, COLUMNS) of shapes, a row each:

    0       RECTANGLE or SPHERE
    1-9     shape_R_world, row by row         10-12   the middle of the shape in the world, m
    13, 14  half the width and half the height, m; of a sphere the radius, twice
    15-18   the window of the material that covers it: u0, v0, width, height, as shares of the material
    19      the row of its material in `levels`

A material is a pyramid of pictures (`levels` (M, L, 3): where in `texels` each begins, its width and height),
each level half the size of the one before, so that what is far away is a mean and not a random sample.  A
rectangle shows its window edge to edge, x to the right and y down as seen from its negative z (mirrored from
behind).  A sphere shows it six times a third of the way round, as the faces of a cube blown up.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import f0, f1, f2, f3, w1

__all__ = ["COLUMNS", "RECTANGLE", "SPHERE", "cast", "photograph", "reaches"]

RECTANGLE, SPHERE = 0, 1
COLUMNS = 20
NEAREST = 1e-6  # m: a ray meets nothing closer to where it starts
ABYSS = 1e30

i3 = types.Array(types.int64, 3, "C", readonly=True)
g1 = types.Array(types.float32, 1, "C", readonly=True)
w_long, w_single = types.int64[::1], types.float32[:, :, ::1]
w_flag = types.boolean[::1]


@inlined
def meets(s, ox, oy, oz, dx, dy, dz):
    """How many times its own length a ray goes until it meets the shape `s`; ABYSS where it never does."""
    px, py, pz = ox - s[10], oy - s[11], oz - s[12]
    az = s[7] * px + s[8] * py + s[9] * pz
    bz = s[7] * dx + s[8] * dy + s[9] * dz
    if s[0] == RECTANGLE:
        if bz == 0.0:
            return ABYSS
        t = -az / bz
        if not t > NEAREST:
            return ABYSS
        x = s[1] * (px + t * dx) + s[2] * (py + t * dy) + s[3] * (pz + t * dz)
        y = s[4] * (px + t * dx) + s[5] * (py + t * dy) + s[6] * (pz + t * dz)
        return t if abs(x) <= s[13] and abs(y) <= s[14] else ABYSS
    # |p + t d| = r, from the point of the ray nearest the middle: no digits are lost where the sphere is far
    dd = dx * dx + dy * dy + dz * dz
    along = -(px * dx + py * dy + pz * dz) / dd
    qx, qy, qz = px + along * dx, py + along * dy, pz + along * dz
    rest = s[13] * s[13] - (qx * qx + qy * qy + qz * qz)
    if not rest >= 0.0:
        return ABYSS
    half = math.sqrt(rest / dd)
    if along - half > NEAREST:
        return along - half
    return along + half if along + half > NEAREST else ABYSS


@inlined
def nearest(shapes, ox, oy, oz, dx, dy, dz):
    """The first shape on a ray and how far it is in lengths of the ray; -1 and ABYSS for none."""
    best, found = ABYSS, -1
    for k in range(shapes.shape[0]):
        t = meets(shapes[k], ox, oy, oz, dx, dy, dz)
        if t < best:
            best, found = t, k
    return best, found


@kernel(types.void(f2, f1, f2, w1, w_long))
def cast(shapes, origin, rays, distance, found):
    """Fill distance (N,), in lengths of each ray (N, 3), and found (N,): the first shape it meets, or -1.

    Where a ray meets nothing, or is NaN, the distance is NaN.
    """
    for i in range(rays.shape[0]):
        t, k = nearest(shapes, origin[0], origin[1], origin[2], rays[i, 0], rays[i, 1], rays[i, 2])
        distance[i] = t if k >= 0 else math.nan
        found[i] = k


@kernel(types.void(f2, f1, f2, f0, w_flag))
def reaches(shapes, origin, points, tolerance, seen):
    """Fill seen (N,): nothing stands between the origin and points (N, 3) of the scene's own surface.

    What lies nearer to the point than `tolerance`, as a share of the distance, is the point's own surface.
    """
    for i in range(points.shape[0]):
        dx, dy, dz = points[i, 0] - origin[0], points[i, 1] - origin[1], points[i, 2] - origin[2]
        t, _ = nearest(shapes, origin[0], origin[1], origin[2], dx, dy, dz)
        seen[i] = t >= 1.0 - tolerance and not math.isnan(dx + dy + dz)


@inlined
def texel(levels, texels, material, level, u, v):
    """Bilinear interpolation in one level at (u, v), shares of the picture; it repeats beyond its edges."""
    start, width, height = levels[material, level, 0], levels[material, level, 1], levels[material, level, 2]
    x, y = u * width - 0.5, v * height - 0.5
    j, i = math.floor(x), math.floor(y)
    a, b = x - j, y - i
    j0, i0_ = int(j) % width, int(i) % height
    j1, i1_ = j0 + 1 if j0 + 1 < width else 0, i0_ + 1 if i0_ + 1 < height else 0
    upper = (1.0 - a) * texels[start + i0_ * width + j0] + a * texels[start + i0_ * width + j1]
    lower = (1.0 - a) * texels[start + i1_ * width + j0] + a * texels[start + i1_ * width + j1]
    return (1.0 - b) * upper + b * lower


@inlined
def face_of(x, y, z):
    """Where a direction meets a cube blown up to a sphere: the face 0-5, and (a, b) in -1 to 1 on it."""
    ax, ay, az = abs(x), abs(y), abs(z)
    if az >= ax and az >= ay:
        return (0 if z < 0.0 else 1), x / az if z < 0.0 else -x / az, y / az
    if ax >= ay:
        return (2 if x > 0.0 else 3), z / ax if x > 0.0 else -z / ax, y / ax
    return (4 if y > 0.0 else 5), x / ay, -z / ay if y > 0.0 else z / ay


@inlined
def shaded(s, levels, texels, px, py, pz, dx, dy, dz, spread, light, ambient):
    """The radiance of the shape `s` at p, a point from its middle, seen along d.

    `spread` is the length that a sample covers across the ray, m.
    """
    x = s[1] * px + s[2] * py + s[3] * pz
    y = s[4] * px + s[5] * py + s[6] * pz
    material = int(s[19])
    width, height = levels[material, 0, 1] * s[17], levels[material, 0, 2] * s[18]
    if s[0] == RECTANGLE:
        u, v = 0.5 + 0.5 * x / s[13], 0.5 + 0.5 * y / s[14]
        nx, ny, nz = -s[7], -s[8], -s[9]
        density = max(width / (2.0 * s[13]), height / (2.0 * s[14]))
    else:
        z = s[7] * px + s[8] * py + s[9] * pz
        face, a, b = face_of(x, y, z)
        a, b = math.atan(a) * 4.0 / math.pi, math.atan(b) * 4.0 / math.pi
        u, v = (face % 3 + 0.5 + 0.5 * a) / 3.0, (face // 3 + 0.5 + 0.5 * b) / 2.0
        nx, ny, nz = px / s[13], py / s[13], pz / s[13]
        density = max(width / 3.0, height / 2.0) / (0.5 * math.pi * s[13])
    slant = abs(nx * dx + ny * dy + nz * dz) / math.sqrt(dx * dx + dy * dy + dz * dz)
    covered = spread * density / max(slant, 0.02)  # texels
    u, v = s[15] + u * s[17], s[16] + v * s[18]
    last = levels.shape[1] - 1
    while levels[material, last, 1] == 0:
        last -= 1
    depth = min(math.log2(covered), float(last)) if covered > 1.0 else 0.0
    level = min(int(depth), last)
    value = texel(levels, texels, material, level, u, v)
    if depth > level:
        value += (depth - level) * (texel(levels, texels, material, level + 1, u, v) - value)
    towards = 0.5 - 0.5 * (nx * light[0] + ny * light[1] + nz * light[2])
    return value * (ambient + (1.0 - ambient) * towards)


@kernel(types.void(f2, i3, g1, f2, f1, f3, f2, f1, f0, f0, w_single))
def photograph(shapes, levels, texels, tints, origin, rays, samples, light, ambient, background, image):
    """Fill image (h, w, C) with what falls on each pixel.

    `rays` (h + 1, w + 1, 3) in the world go through the corners of the pixels; `samples` (n, 2) lie in the
    unit square; `tints` (P, C) is what a shape's radiance becomes in each channel; `light` is the unit vector
    along which light travels.
    """
    height, width, channels = image.shape
    ox, oy, oz = origin[0], origin[1], origin[2]
    count = samples.shape[0]
    across = 1.0 / math.sqrt(count)
    ids = np.empty((2, width + 1), np.int64)
    total = np.empty(channels)
    for row in range(height + 1):
        now, past = row & 1, (row + 1) & 1
        for j in range(width + 1):
            r = rays[row, j]
            _, ids[now, j] = nearest(shapes, ox, oy, oz, r[0], r[1], r[2])
        if row == 0:
            continue
        i = row - 1
        for j in range(width):
            only = ids[now, j]
            same = only == ids[now, j + 1] and only == ids[past, j] and only == ids[past, j + 1]
            total[:] = 0.0
            r0, r1, r2, r3 = rays[i, j], rays[i, j + 1], rays[row, j + 1], rays[row, j]
            wide = math.sqrt((r2[0] - r0[0]) ** 2 + (r2[1] - r0[1]) ** 2 + (r2[2] - r0[2]) ** 2) * 0.7071
            for k in range(count):
                u, v = samples[k, 0], samples[k, 1]
                p0, p1, p2, p3 = (1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v
                dx = p0 * r0[0] + p1 * r1[0] + p2 * r2[0] + p3 * r3[0]
                dy = p0 * r0[1] + p1 * r1[1] + p2 * r2[1] + p3 * r3[1]
                dz = p0 * r0[2] + p1 * r1[2] + p2 * r2[2] + p3 * r3[2]
                t, found = ABYSS, -1
                if same and only >= 0:
                    t = meets(shapes[only], ox, oy, oz, dx, dy, dz)
                    found = only if t < ABYSS else -1
                elif not same:
                    t, found = nearest(shapes, ox, oy, oz, dx, dy, dz)
                if found < 0:
                    for c in range(channels):
                        total[c] += background
                    continue
                s = shapes[found]
                px, py, pz = ox + t * dx - s[10], oy + t * dy - s[11], oz + t * dz - s[12]
                spread = wide * t * across
                value = shaded(s, levels, texels, px, py, pz, dx, dy, dz, spread, light, ambient)
                for c in range(channels):
                    total[c] += value * tints[found, c]
            for c in range(channels):
                image[i, j, c] = total[c] / count
