"""Where a pixel of one picture may lie in the other: lines of pinholes, curves of real lenses, and distances.

A fundamental matrix F takes pixels of a to lines of b, (b, 1) F (a, 1)' = 0.  It exists for pinholes only:
through a lens with distortion the line is a curve, which `epipolar_curve` draws.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError, ShapeError
from sequential.manifold.quaternion import rotation_matrix
from vision3d.camera import Array, Camera
from vision3d.two_view.motion import essential_matrix

__all__ = [
    "epipolar_curve",
    "epipolar_lines",
    "epipoles",
    "fundamental_matrix",
    "line_distances",
    "sampson_px",
]


def fundamental_matrix(b_T_a: Array, camera_a: Camera, camera_b: Camera) -> Array:
    """F (3, 3) of unit norm, of a motion (7,) and two pinholes.

    Raises
    ------
    ModelError
        for a camera with distortion: undistort its pictures or its pixels first.
    """
    for camera in (camera_a, camera_b):
        if np.any(camera.distortion) or camera.lens.startswith("fisheye"):
            raise ModelError(
                f"a fundamental matrix is between pinholes, and {camera} has distortion: undistort the "
                "pixels first, or take `epipolar_curve`"
            )
    F = np.linalg.inv(camera_b.matrix).T @ essential_matrix(b_T_a) @ np.linalg.inv(camera_a.matrix)
    return np.asarray(F / np.linalg.norm(F))


def epipolar_lines(F: Array, pixels: Array, *, of: str = "a") -> Array:
    """Lines (N, 3), u x + v y + w = 0 with u² + v² = 1, of pixels (N, 2) of picture a in b; of="b": in a."""
    if of not in {"a", "b"}:
        raise ModelError(f"pixels are of picture 'a' or 'b', got {of!r}")
    lines = _homogeneous(pixels) @ (F.T if of == "a" else F)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(lines / np.linalg.norm(lines[:, :2], axis=1, keepdims=True))


def line_distances(lines: Array, pixels: Array) -> Array:
    """Signed distances (N,) of pixels (N, 2) from lines (N, 3) of `epipolar_lines`, px."""
    return np.asarray(np.sum(lines * _homogeneous(pixels), axis=1))


def sampson_px(F: Array, pixels_a: Array, pixels_b: Array) -> Array:
    """Signed Sampson distances (N,) of matched pixels (N, 2) to F, px: how far both must move.

    To first order, and in px of the noise of one coordinate.  Hartley, Zisserman 2004, equation 11.9.
    """
    a, b = _homogeneous(pixels_a), _homogeneous(pixels_b)
    in_b, in_a = a @ F.T, b @ F
    slope = np.sqrt(np.sum(in_b[:, :2] ** 2, axis=1) + np.sum(in_a[:, :2] ** 2, axis=1))
    return np.asarray(np.sum(b * in_b, axis=1) / slope)


def epipoles(F: Array) -> tuple[Array, Array]:
    """Where each picture sees the other camera, (3,) of unit norm: F e = 0 in a, F' e = 0 in b."""
    U, _, Vt = np.linalg.svd(F)
    return Vt[2], U[:, 2]


def epipolar_curve(
    camera_a: Camera, camera_b: Camera, b_T_a: Array, pixel: Array, *, count: int = 200
) -> Array:
    """Pixels (M, 2), M <= count, where picture b may show what a shows at one pixel (2,): near first.

    From the epipole to the point at infinity, through the lens of b; what b cannot see is left out.
    """
    ray = camera_a.unproject(np.reshape(pixel, (1, 2)))[0]
    far = rotation_matrix(b_T_a[:4]) @ ray
    near = b_T_a[4:] / np.linalg.norm(b_T_a[4:])
    # equal angles, so that the samples lie as evenly as the lens lets them
    angle = float(np.arctan2(np.linalg.norm(np.cross(near, far)), near @ far))
    if not np.isfinite(angle) or angle < 1e-9:
        return np.empty((0, 2))
    share = np.linspace(0.0, 1.0, count)[:, None]
    rays = (np.sin((1.0 - share) * angle) * near + np.sin(share * angle) * far) / np.sin(angle)
    seen = camera_b.project(rays)
    return np.asarray(seen[_inside(seen, camera_b.size)])


def _inside(pixels: Array, size: tuple[int, int]) -> NDArray[np.bool_]:
    with np.errstate(invalid="ignore"):
        inside: NDArray[np.bool_] = np.all((pixels >= -0.5) & (pixels <= np.array(size) - 0.5), axis=1)
    return inside


def _homogeneous(pixels: Array) -> Array:
    rows = np.asarray(pixels, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != 2:
        raise ShapeError(f"pixels are an array (N, 2), got shape {rows.shape}")
    return np.column_stack([rows, np.ones(len(rows))])
