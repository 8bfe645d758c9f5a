"""Paint a textured plane into an image, and turn radiance into grey levels.

`paint` maps the corners of every pixel onto the plane.  A pixel whose corners fall into one cell of the
texture has one value.  One that straight edges cross is cut along them: its value is exact.  Only where
an edge is curved, or a picture is shown, are pixels sampled, in perspective, at points of a lattice.

A texture is cells between sorted edges (`x_edges`, `y_edges`, m) with a value each, 0-1, or less than 0 where
one sees through.  What `kind` adds:

- CELLS: the value of the cell, and within `radii` of its middle the value `inner`;
- DISTANCE: `values` are signed distances (m) at the crossings of a regular grid; `inner[0, 0]` is the value
  where they are below 0, `inner[0, 1]` elsewhere;
- PICTURE: `values` are reflectances at the crossings of a regular grid, interpolated.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import f0, f1, f2, f3, i0, wu2
from vision3d.kernels.polygons import VERTICES, cover

__all__ = ["CELLS", "DISTANCE", "PICTURE", "develop", "paint"]

CELLS, DISTANCE, PICTURE = 0, 1, 2
NOWHERE = -9  # behind the camera, or no ray
f_image, w_image = types.Array(types.float32, 2, "C", readonly=True), types.float32[:, ::1]


@inlined
def walk(v, edges, k):
    """The cell of a coordinate between the outermost edges, looked for from cell `k` on."""
    while v < edges[k]:
        k -= 1
    while v >= edges[k + 1]:
        k += 1
    return k


@inlined
def interpolated(x, y, x_edges, y_edges, values):
    """Bilinear interpolation on a regular grid; the point is inside."""
    u = (x - x_edges[0]) / (x_edges[1] - x_edges[0])
    v = (y - y_edges[0]) / (y_edges[1] - y_edges[0])
    j = min(int(u), values.shape[1] - 2)
    i = min(int(v), values.shape[0] - 2)
    u -= j
    v -= i
    upper = values[i, j] + u * (values[i, j + 1] - values[i, j])
    lower = values[i + 1, j] + u * (values[i + 1, j + 1] - values[i + 1, j])
    return upper + v * (lower - upper)


@kernel(f0(i0, f0, f0, f1, f1, f_image, f_image, f_image))
def shade(kind, x, y, x_edges, y_edges, values, radii, inner):
    """The value at a point of the plane, negative where one sees through."""
    last_x, last_y = x_edges[x_edges.shape[0] - 1], y_edges[y_edges.shape[0] - 1]
    if not (x >= x_edges[0] and x < last_x and y >= y_edges[0] and y < last_y):
        return -1.0
    if kind == CELLS:
        columns, rows = x_edges.shape[0] - 1, y_edges.shape[0] - 1
        j = walk(x, x_edges, int(columns * (x - x_edges[0]) / (last_x - x_edges[0])))
        i = walk(y, y_edges, int(rows * (y - y_edges[0]) / (last_y - y_edges[0])))
        r = float(radii[i, j])
        dx = x - 0.5 * (x_edges[j] + x_edges[j + 1])
        dy = y - 0.5 * (y_edges[i] + y_edges[i + 1])
        return float(inner[i, j]) if dx * dx + dy * dy < r * r else float(values[i, j])
    value = float(interpolated(x, y, x_edges, y_edges, values))
    if kind == PICTURE:
        return value
    return float(inner[0, 0]) if value < 0.0 else float(inner[0, 1])


@inlined
def below_zero(d0, d1, d2, d3):
    """The share of a pixel where a distance is negative, from its corners, taking it as linear between."""
    middle = 0.25 * (d0 + d1 + d2 + d3)
    a = 0.5 * abs(d1 + d2 - d0 - d3)  # how much it changes across the pixel, and down
    b = 0.5 * abs(d2 + d3 - d0 - d1)
    wide, narrow = max(a, b), max(min(a, b), 1e-15)
    # the sum of two even spreads has a distribution that rises as a trapezium
    t = -middle
    low = t + 0.5 * (wide + narrow)
    if low <= 0.0:
        return 0.0
    if t >= 0.5 * (wide + narrow):
        return 1.0
    if t <= -0.5 * (wide - narrow):
        return 0.5 * low * low / (wide * narrow)
    if t < 0.5 * (wide - narrow):
        return (0.5 * narrow + t + 0.5 * (wide - narrow)) / wide
    rest = 0.5 * (wide + narrow) - t
    return 1.0 - 0.5 * rest * rest / (wide * narrow)


@kernel(types.void(w_image, f3, f2, i0, f1, f1, f_image, f_image, f_image, f2))
def paint(image, rays, plane_from_ray, kind, x_edges, y_edges, values, radii, inner, samples):
    """Paint the plane over an image of radiance (h, w), in place.

    `rays` (h + 1, w + 1, 3) go through the corners of the pixels, NaN where there is none; `plane_from_ray`
    (3, 3) takes a ray to homogeneous coordinates of the plane; `samples` (n, 2) lie in the unit square.
    """
    height, width = image.shape
    h00, h01, h02 = plane_from_ray[0, 0], plane_from_ray[0, 1], plane_from_ray[0, 2]
    h10, h11, h12 = plane_from_ray[1, 0], plane_from_ray[1, 1], plane_from_ray[1, 2]
    h20, h21, h22 = plane_from_ray[2, 0], plane_from_ray[2, 1], plane_from_ray[2, 2]
    left, right = x_edges[0], x_edges[x_edges.shape[0] - 1]
    top, bottom = y_edges[0], y_edges[y_edges.shape[0] - 1]
    # two rows of corners: homogeneous coordinates, coordinates, and the code of the cell that lies there
    a, b, c = np.empty((2, width + 1)), np.empty((2, width + 1)), np.empty((2, width + 1))
    xs, ys = np.zeros((2, width + 1)), np.zeros((2, width + 1))
    codes = np.empty((2, width + 1), np.int64)
    polygons = np.empty((5, VERTICES, 2))
    found = np.empty(2)
    columns = np.int64(x_edges.shape[0])
    kx, ky = 0, 0
    for row in range(height + 1):
        now, past = row & 1, (row + 1) & 1
        for j in range(width + 1):
            dx, dy, dz = rays[row, j, 0], rays[row, j, 1], rays[row, j, 2]
            qa = h00 * dx + h01 * dy + h02 * dz
            qb = h10 * dx + h11 * dy + h12 * dz
            qc = h20 * dx + h21 * dy + h22 * dz
            a[now, j], b[now, j], c[now, j] = qa, qb, qc
            if not (qc > 0.0):
                codes[now, j] = NOWHERE
                continue
            inverse = 1.0 / qc
            x, y = qa * inverse, qb * inverse
            xs[now, j], ys[now, j] = x, y
            # outside: one code a side, so that a texture narrower than a pixel is not missed
            if x < left:
                codes[now, j] = -1
            elif x >= right:
                codes[now, j] = -2
            elif y < top:
                codes[now, j] = -3
            elif y >= bottom:
                codes[now, j] = -4
            elif kind == CELLS:
                kx, ky = walk(x, x_edges, kx), walk(y, y_edges, ky)
                codes[now, j] = ky * columns + kx
            else:
                codes[now, j] = 0
        if row == 0:
            continue
        i = row - 1
        for j in range(width):
            code = codes[past, j]
            same = code == codes[past, j + 1] and code == codes[now, j] and code == codes[now, j + 1]
            if same and code < 0:
                continue
            x0, x1, x2, x3 = xs[past, j], xs[past, j + 1], xs[now, j + 1], xs[now, j]
            y0, y1, y2, y3 = ys[past, j], ys[past, j + 1], ys[now, j + 1], ys[now, j]
            c0, c1, c2, c3 = c[past, j], c[past, j + 1], c[now, j + 1], c[now, j]
            nearest, farthest = min(c0, c1, c2, c3), max(c0, c1, c2, c3)
            # no corner is behind the camera or without a ray (NaN, which min and max may pass over)
            known = codes[past, j] != NOWHERE and codes[past, j + 1] != NOWHERE
            known = known and codes[now, j] != NOWHERE and codes[now, j + 1] != NOWHERE
            flat = known and nearest > 0.98 * farthest
            straight = kind == CELLS
            if same and kind != PICTURE:
                # how far a curved edge is from the pixel, against the pixel's own extent
                if kind == CELLS:
                    n = code // columns
                    m = code - n * columns
                    value = float(values[n, m])
                    radius = float(radii[n, m])
                    away = math.inf
                    if radius > 0.0:
                        ex, ey = 0.5 * (x_edges[m] + x_edges[m + 1]), 0.5 * (y_edges[n] + y_edges[n + 1])
                        away = math.hypot(x0 - ex, y0 - ey) - radius
                        if away < 0.0:
                            value = float(inner[n, m])
                else:
                    away = float(interpolated(x0, y0, x_edges, y_edges, values))
                    value = float(inner[0, 0]) if away < 0.0 else float(inner[0, 1])
                if away == math.inf or abs(away) > 1.5 * max(
                    math.hypot(x2 - x0, y2 - y0), math.hypot(x3 - x1, y3 - y1)
                ):
                    if value >= 0.0:
                        image[i, j] = value
                    continue
                straight = False
                if kind == DISTANCE and flat:
                    d1 = float(interpolated(x1, y1, x_edges, y_edges, values))
                    d2 = float(interpolated(x2, y2, x_edges, y_edges, values))
                    d3 = float(interpolated(x3, y3, x_edges, y_edges, values))
                    share = below_zero(away, d1, d2, d3)
                    under = float(image[i, j])
                    within = float(inner[0, 0]) if inner[0, 0] >= 0.0 else under
                    without = float(inner[0, 1]) if inner[0, 1] >= 0.0 else under
                    image[i, j] = share * within + (1.0 - share) * without
                    continue
            if straight and flat:
                # a disc in one of the cells may be near, too
                for corner in (code, codes[past, j + 1], codes[now, j], codes[now, j + 1]):
                    if corner >= 0 and radii[corner // columns, corner % columns] > 0.0:
                        straight = False
            if straight and flat:
                rest = polygons[0]
                rest[0, 0], rest[1, 0], rest[2, 0], rest[3, 0] = x0, x1, x2, x3
                rest[0, 1], rest[1, 1], rest[2, 1], rest[3, 1] = y0, y1, y2, y3
                cover(
                    rest, x_edges, y_edges, values, polygons[1], polygons[2], polygons[3], polygons[4], found
                )
                image[i, j] += np.float32(found[0] - found[1] * image[i, j])
                continue
            total, covered = 0.0, 0
            for k in range(samples.shape[0]):
                u, v = samples[k, 0], samples[k, 1]
                p0, p1, p2, p3 = (1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v
                qc = p0 * c0 + p1 * c1 + p2 * c2 + p3 * c3
                if not (qc > 0.0):
                    continue
                qa = p0 * a[past, j] + p1 * a[past, j + 1] + p2 * a[now, j + 1] + p3 * a[now, j]
                qb = p0 * b[past, j] + p1 * b[past, j + 1] + p2 * b[now, j + 1] + p3 * b[now, j]
                value = shade(kind, qa / qc, qb / qc, x_edges, y_edges, values, radii, inner)
                if value >= 0.0:
                    total += value
                    covered += 1
            image[i, j] += np.float32((total - covered * image[i, j]) / samples.shape[0])


@kernel(types.void(f_image, f_image, f0, f0, f0, wu2))
def develop(radiance, normal, exposure, vignetting, noise, image):
    """Radiance 0-1 to grey levels: the lens darkens towards the corners, noise grows with the signal.

    The variance is ``noise² (1/4 + value)`` in grey levels, `normal` (h, w) standard normal numbers (an empty
    array where there is no noise); a corner of the image keeps ``1 - vignetting`` of its light.
    """
    height, width = radiance.shape
    noisy = normal.shape[0] == height
    cx, cy = 0.5 * (width - 1), 0.5 * (height - 1)
    fall = vignetting / (0.25 * width * width + 0.25 * height * height)
    for i in range(height):
        for j in range(width):
            lit = radiance[i, j] * (1.0 - fall * ((j - cx) * (j - cx) + (i - cy) * (i - cy)))
            grey = lit * exposure
            if noisy:
                grey += normal[i, j] * noise * math.sqrt(0.25 + max(lit, 0.0))
            image[i, j] = np.uint8(min(max(grey + 0.5, 0.0), 255.0))
