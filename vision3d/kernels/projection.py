"""Many points through one lens, and back."""

from __future__ import annotations

from numba import types

from vision3d.kernels import kernel
from vision3d.kernels.arrays import f0, f1, f2, i0, w2, w3
from vision3d.kernels.lenses import project_full_one, project_one, unproject_one

__all__ = ["project", "project_jacobians", "unproject"]


@kernel(types.void(i0, f1, f0, f2, w2))
def project(code, p, limit, points, pixels):
    """Fill pixels (N, 2) from points (N, 3)."""
    for i in range(points.shape[0]):
        pixels[i, 0], pixels[i, 1] = project_one(code, p, limit, points[i, 0], points[i, 1], points[i, 2])


@kernel(types.void(i0, f1, f0, f2, w2, w3, w3))
def project_jacobians(code, p, limit, points, pixels, d_point, d_parameters):
    """Fill pixels (N, 2), d_point (N, 2, 3) and d_parameters (N, 2, 4+k) from points (N, 3)."""
    for i in range(points.shape[0]):
        pixels[i, 0], pixels[i, 1] = project_full_one(
            code, p, limit, points[i, 0], points[i, 1], points[i, 2], d_point[i], d_parameters[i]
        )


@kernel(types.void(i0, f1, f0, f2, w2))
def unproject(code, p, limit, pixels, rays):
    """Fill unit rays (N, 3) from pixels (N, 2)."""
    for i in range(pixels.shape[0]):
        rays[i, 0], rays[i, 1], rays[i, 2] = unproject_one(code, p, limit, pixels[i, 0], pixels[i, 1])
