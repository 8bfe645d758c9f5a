"""Cut a pixel's image on a plane along the edges of cells, and add up what each cell takes of it."""

from __future__ import annotations

from numba import types

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import f0, f1, f2, i0, w1, w2

__all__ = ["VERTICES", "area", "cover", "cut"]

VERTICES = 24  # a quadrilateral gains one where it is cut; two cuts each way are all that a cell makes
f_image = types.Array(types.float32, 2, "C", readonly=True)


@kernel(i0(f2, i0, i0, f0, w2, w2))
def cut(polygon, count, axis, at, low, high):
    """Cut a convex polygon along a coordinate; how many vertices each side has: low + VERTICES * high."""
    n_low, n_high = 0, 0
    for k in range(count):
        following = k + 1 if k + 1 < count else 0
        a, b = polygon[k, axis] - at, polygon[following, axis] - at
        if a <= 0.0:
            low[n_low, 0], low[n_low, 1] = polygon[k, 0], polygon[k, 1]
            n_low += 1
        if a >= 0.0:
            high[n_high, 0], high[n_high, 1] = polygon[k, 0], polygon[k, 1]
            n_high += 1
        if (a < 0.0 and b > 0.0) or (a > 0.0 and b < 0.0):
            share = a / (a - b)
            x = polygon[k, 0] + share * (polygon[following, 0] - polygon[k, 0])
            y = polygon[k, 1] + share * (polygon[following, 1] - polygon[k, 1])
            low[n_low, 0], low[n_low, 1] = x, y
            high[n_high, 0], high[n_high, 1] = x, y
            n_low += 1
            n_high += 1
    return n_low + VERTICES * n_high


@kernel(f0(f2, i0))
def area(polygon, count):
    """The area of a polygon."""
    total = 0.0
    for k in range(1, count - 1):
        ax, ay = polygon[k, 0] - polygon[0, 0], polygon[k, 1] - polygon[0, 1]
        bx, by = polygon[k + 1, 0] - polygon[0, 0], polygon[k + 1, 1] - polygon[0, 1]
        total += ax * by - ay * bx
    return 0.5 * abs(total)


@inlined
def first_cell(lowest, edges):
    """The cell in which a polygon begins, -1 before the first edge."""
    if lowest < edges[0]:
        return -1
    k = 0
    while k + 1 < edges.shape[0] and lowest >= edges[k + 1]:
        k += 1
    return k


@kernel(types.void(w2, f1, f1, f_image, w2, w2, w2, w2, w1))
def cover(rest, x_edges, y_edges, values, column, piece, high, spare, found):
    """Integrate cells over the quadrilateral `rest` (VERTICES, 2): found = value * share, share."""
    whole = area(rest, 4)
    found[0], found[1] = 0.0, 0.0
    kx = first_cell(min(rest[0, 0], rest[1, 0], rest[2, 0], rest[3, 0]), x_edges)
    n_rest = 4
    while n_rest > 2 and kx < x_edges.shape[0] - 1:
        counts = cut(rest, n_rest, 0, x_edges[kx + 1], column, high)
        n_column, n_rest = counts % VERTICES, counts // VERTICES
        rest[:n_rest] = high[:n_rest]
        if kx >= 0 and n_column > 2:
            lowest = column[0, 1]
            for k in range(1, n_column):
                lowest = min(lowest, column[k, 1])
            ky = first_cell(lowest, y_edges)
            while n_column > 2 and ky < y_edges.shape[0] - 1:
                counts = cut(column, n_column, 1, y_edges[ky + 1], piece, spare)
                n_piece, n_column = counts % VERTICES, counts // VERTICES
                column[:n_column] = spare[:n_column]
                if ky >= 0 and values[ky, kx] >= 0.0:
                    share = area(piece, n_piece) / whole
                    found[0] += share * values[ky, kx]
                    found[1] += share
                ky += 1
        kx += 1
