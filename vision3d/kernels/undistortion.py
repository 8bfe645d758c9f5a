"""Where each pixel of an undistorted or rectified image lies in the camera's image."""

from __future__ import annotations

import math

from numba import types

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import f0, f1, f2, i0
from vision3d.kernels.lenses import FISHEYE4, project_one

__all__ = ["fill_maps"]

NOWHERE = -1e4
"""Coordinate for a pixel that the camera does not see: far outside of any image, and a number."""
maps = types.float32[:, ::1]


@inlined
def fill_row(p, k, furthest, start, step, columns, rows):
    """Brown's distortion along one row of rays start + j step, all twelve coefficients, without a branch.

    The same arithmetic as `lenses.bent`, written so that the compiler takes several pixels at once.
    """
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 = k
    fx, fy, cx, cy = p[0], p[1], p[2], p[3]
    for j in range(columns.shape[0]):
        z = start[2] + j * step[2]
        a, b = (start[0] + j * step[0]) / z, (start[1] + j * step[1]) / z
        s = a * a + b * b
        g = (1.0 + s * (k1 + s * (k2 + s * k3))) / (1.0 + s * (k4 + s * (k5 + s * k6)))
        ab = 2.0 * a * b
        u = fx * (a * g + p1 * ab + p2 * (s + 2.0 * a * a) + s * (s1 + s * s2)) + cx
        v = fy * (b * g + p1 * (s + 2.0 * b * b) + p2 * ab + s * (s3 + s * s4)) + cy
        seen = (z > 0.0) & (s <= furthest) & (abs(u) < -NOWHERE) & (abs(v) < -NOWHERE)
        columns[j] = u if seen else NOWHERE
        rows[j] = v if seen else NOWHERE


@kernel(types.void(i0, f1, f1, f0, f1, f2, maps, maps))
def fill_maps(code, p, k, limit, target, camera_R_target, columns, rows):
    """Fill columns and rows (h, w) for a pinhole camera (4,) fx, fy, cx, cy, turned by a rotation (3, 3).

    `k` (12,) is Brown's distortion filled up with zeros; a fisheye takes its own from `p`.
    """
    R = camera_R_target
    brown = (k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7], k[8], k[9], k[10], k[11])
    a0 = -target[2] / target[0]
    for i in range(columns.shape[0]):
        b = (i - target[3]) / target[1]
        x, y, z = (
            R[0, 0] * a0 + R[0, 1] * b + R[0, 2],
            R[1, 0] * a0 + R[1, 1] * b + R[1, 2],
            R[2, 0] * a0 + R[2, 1] * b + R[2, 2],
        )
        dx, dy, dz = R[0, 0] / target[0], R[1, 0] / target[0], R[2, 0] / target[0]
        if code != FISHEYE4:
            fill_row(p, brown, limit * limit, (x, y, z), (dx, dy, dz), columns[i], rows[i])
            continue
        for j in range(columns.shape[1]):
            u, v = project_one(code, p, limit, x + j * dx, y + j * dy, z + j * dz)
            if math.isnan(u) or math.isnan(v) or abs(u) > -NOWHERE or abs(v) > -NOWHERE:
                u, v = NOWHERE, NOWHERE
            columns[i, j], rows[i, j] = u, v
