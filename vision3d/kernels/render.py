"""Paint a textured plane into an image, and turn radiance into grey levels.

`paint` maps the corners of every pixel onto the plane.  A pixel whose corners fall into one cell of the
texture is of one value; only the pixels that an edge crosses are sampled, in perspective, at the points of a
lattice.  That makes the sampling of edges fine and the whole quick.

A texture is cells between sorted edges (`x_edges`, `y_edges`, m) with a value each, 0-1, or less than 0 where
one sees through.  What `kind` adds:

- CELLS: the value of the cell, and within `radii` of its middle the value `inner`;
- DISTANCE: `values` are signed distances (m) at the crossings of a regular grid; `inner[0, 0]` is the value
  where they are below 0, `inner[0, 1]` elsewhere;
- PICTURE: `values` are reflectances at the crossings of a regular grid, interpolated.

`x_bins` and `y_bins` give for each of many equal steps the first cell that it touches, so that a cell is
found without a search.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import f0, f1, f2, f3, i0, i1, wu2

__all__ = ["CELLS", "DISTANCE", "PICTURE", "develop", "paint"]

CELLS, DISTANCE, PICTURE = 0, 1, 2
f_image, w_image = types.Array(types.float32, 2, "C", readonly=True), types.float32[:, ::1]


@inlined
def find_cell(v, edges, bins):
    """The cell of a coordinate, -1 outside."""
    first, last = edges[0], edges[edges.shape[0] - 1]
    if not (v >= first and v < last):
        return -1
    k = int((v - first) / (last - first) * bins.shape[0])
    cell = bins[min(k, bins.shape[0] - 1)]
    while cell > 0 and v < edges[cell]:
        cell -= 1
    while v >= edges[cell + 1]:
        cell += 1
    return cell


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


@inlined
def shade(kind, x, y, x_edges, y_edges, x_bins, y_bins, values, radii, inner):
    """The value at a point of the plane, negative where one sees through."""
    if kind == CELLS:
        j = find_cell(x, x_edges, x_bins)
        i = find_cell(y, y_edges, y_bins)
        if i < 0 or j < 0:
            return -1.0
        r = float(radii[i, j])
        if r > 0.0:
            dx = x - 0.5 * (x_edges[j] + x_edges[j + 1])
            dy = y - 0.5 * (y_edges[i] + y_edges[i + 1])
            if dx * dx + dy * dy < r * r:
                return float(inner[i, j])
        return float(values[i, j])
    if not (
        x >= x_edges[0]
        and x < x_edges[x_edges.shape[0] - 1]
        and y >= y_edges[0]
        and y < y_edges[y_edges.shape[0] - 1]
    ):
        return -1.0
    value = float(interpolated(x, y, x_edges, y_edges, values))
    if kind == PICTURE:
        return value
    return float(inner[0, 0]) if value < 0.0 else float(inner[0, 1])


@kernel(types.void(w_image, f3, f2, i0, f1, f1, i1, i1, f_image, f_image, f_image, f2))
def paint(image, rays, plane_from_ray, kind, x_edges, y_edges, x_bins, y_bins, values, radii, inner, samples):
    """Paint the plane over an image of radiance (h, w), in place.

    `rays` (h + 1, w + 1, 3) go through the corners of the pixels, NaN where there is none; `plane_from_ray`
    (3, 3) takes a ray to homogeneous coordinates of the plane; `samples` (n, 2) lie in the unit square.
    """
    height, width = image.shape
    count = samples.shape[0]
    h00, h01, h02 = plane_from_ray[0, 0], plane_from_ray[0, 1], plane_from_ray[0, 2]
    h10, h11, h12 = plane_from_ray[1, 0], plane_from_ray[1, 1], plane_from_ray[1, 2]
    h20, h21, h22 = plane_from_ray[2, 0], plane_from_ray[2, 1], plane_from_ray[2, 2]
    # two rows of corners: homogeneous coordinates, coordinates, and the code of what lies there
    a, b, c = np.empty((2, width + 1)), np.empty((2, width + 1)), np.empty((2, width + 1))
    xs, ys = np.empty((2, width + 1)), np.empty((2, width + 1))
    codes = np.empty((2, width + 1), np.int64)
    columns = np.int64(x_edges.shape[0])
    for row in range(height + 1):
        now, past = row & 1, (row + 1) & 1
        for j in range(width + 1):
            dx, dy, dz = rays[row, j, 0], rays[row, j, 1], rays[row, j, 2]
            qa = h00 * dx + h01 * dy + h02 * dz
            qb = h10 * dx + h11 * dy + h12 * dz
            qc = h20 * dx + h21 * dy + h22 * dz
            a[now, j], b[now, j], c[now, j] = qa, qb, qc
            if not (qc > 0.0):
                codes[now, j] = -2  # behind the camera, or no ray
                continue
            x, y = qa / qc, qb / qc
            xs[now, j], ys[now, j] = x, y
            if kind == CELLS:
                cell_x = find_cell(x, x_edges, x_bins)
                cell_y = find_cell(y, y_edges, y_bins)
                codes[now, j] = -1 if cell_x < 0 or cell_y < 0 else cell_y * columns + cell_x
            else:
                inside = (
                    x >= x_edges[0]
                    and x < x_edges[columns - 1]
                    and y >= y_edges[0]
                    and y < y_edges[y_edges.shape[0] - 1]
                )
                codes[now, j] = 0 if inside else -1
        if row == 0:
            continue
        i = row - 1
        for j in range(width):
            code = codes[past, j]
            same = code == codes[past, j + 1] and code == codes[now, j] and code == codes[now, j + 1]
            if same and code < 0:
                continue
            if same:
                if kind == CELLS:
                    n = code // columns
                    m = code - n * columns
                    r = float(radii[n, m])
                    if r == 0.0:
                        value = float(values[n, m])
                        if value >= 0.0:
                            image[i, j] = value
                        continue
                    # how far the disc's rim is from the pixel, against the pixel's own extent
                    ex = 0.5 * (x_edges[m] + x_edges[m + 1])
                    ey = 0.5 * (y_edges[n] + y_edges[n + 1])
                    near = abs(math.hypot(xs[past, j] - ex, ys[past, j] - ey) - r)
                elif kind == DISTANCE:
                    near = abs(interpolated(xs[past, j], ys[past, j], x_edges, y_edges, values))
                else:
                    near = 0.0
                wide = max(
                    math.hypot(xs[now, j + 1] - xs[past, j], ys[now, j + 1] - ys[past, j]),
                    math.hypot(xs[now, j] - xs[past, j + 1], ys[now, j] - ys[past, j + 1]),
                )
                if near > 1.5 * wide:
                    value = shade(
                        kind, xs[past, j], ys[past, j], x_edges, y_edges, x_bins, y_bins, values, radii, inner
                    )
                    if value >= 0.0:
                        image[i, j] = value
                    continue
            total, covered = 0.0, 0
            for k in range(count):
                u, v = samples[k, 0], samples[k, 1]
                w00, w01, w10, w11 = (1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v
                qc = w00 * c[past, j] + w01 * c[past, j + 1] + w10 * c[now, j] + w11 * c[now, j + 1]
                if not (qc > 0.0):
                    continue
                qa = w00 * a[past, j] + w01 * a[past, j + 1] + w10 * a[now, j] + w11 * a[now, j + 1]
                qb = w00 * b[past, j] + w01 * b[past, j + 1] + w10 * b[now, j] + w11 * b[now, j + 1]
                value = shade(kind, qa / qc, qb / qc, x_edges, y_edges, x_bins, y_bins, values, radii, inner)
                if value >= 0.0:
                    total += value
                    covered += 1
            image[i, j] += np.float32((total - covered * image[i, j]) / count)


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
