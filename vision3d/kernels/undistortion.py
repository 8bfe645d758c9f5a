"""Where each pixel of an undistorted or rectified image lies in the camera's image."""

from __future__ import annotations

import math

from numba import types

from vision3d.kernels import kernel
from vision3d.kernels.arrays import f0, f1, f2, i0
from vision3d.kernels.lenses import project_one

__all__ = ["fill_maps"]

NOWHERE = -1e4
"""Coordinate for a pixel that the camera does not see: far outside of any image, and a number."""
maps = types.float32[:, ::1]


@kernel(types.void(i0, f1, f0, f1, f2, maps, maps))
def fill_maps(code, p, limit, target, camera_R_target, columns, rows):
    """Fill columns and rows (h, w) for a pinhole camera (4,) fx, fy, cx, cy, turned by a rotation (3, 3)."""
    R = camera_R_target
    for i in range(columns.shape[0]):
        b = (i - target[3]) / target[1]
        for j in range(columns.shape[1]):
            a = (j - target[2]) / target[0]
            u, v = project_one(
                code,
                p,
                limit,
                R[0, 0] * a + R[0, 1] * b + R[0, 2],
                R[1, 0] * a + R[1, 1] * b + R[1, 2],
                R[2, 0] * a + R[2, 1] * b + R[2, 2],
            )
            if math.isnan(u) or math.isnan(v) or abs(u) > -NOWHERE or abs(v) > -NOWHERE:
                u, v = NOWHERE, NOWHERE
            columns[i, j], rows[i, j] = u, v
