"""Landmarks of known place in the pictures of a camera, or of a rectified pair, mounted on a body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, ShapeError
from sequential.manifold import SE3, Manifold, NavState, Vector
from sequential.model import Functions, Loss, SensorModel, as_params
from sequential.models.parts import find_part, mounted
from sequential.models.rotation import rotation, turned_back
from sequential.noise import require_covariance

__all__ = ["CameraProjection", "StereoPixels"]

Array = NDArray[np.float64]
NEAR = 1e-3  # m: a point nearer than this, or behind the camera, is taken to be this far ahead


@dataclass(frozen=True, eq=False)
class CameraProjection(SensorModel):
    """Pixel (x, y) of the landmark whose row in `landmarks` stands in the reading's context.

    Parameters
    ----------
    landmarks : (L, 3) world positions, m
    noise_cov : (2, 2), (2,) variances or a number, px²
    intrinsics : (fx, fy, cx, cy) px; undistort pixels first (`vision3d.camera.Camera.undistort_points` gives
        tangents, for which these are (1, 1, 0, 0) and noise is in their unit)
    body_T_camera : (7,) where the camera sits; at the body, looking along its z axis, unless given
    part : name of the SE(3) or navigation part; the first unless given
    """

    landmarks: ArrayLike
    noise_cov: ArrayLike  # type: ignore[assignment]
    intrinsics: tuple[float, float, float, float] = (1.0, 1.0, 0.0, 0.0)
    body_T_camera: ArrayLike | None = None
    part: str | None = None
    gate: float | None = None
    loss: Loss | None = None

    def __post_init__(self) -> None:
        prepare_pixels(self, 2)

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `SensorModel.functions`."""
        return pixels(self, 0.0, 2, manifold)


@dataclass(frozen=True, eq=False)
class StereoPixels(SensorModel):
    """Pixels of a known landmark in both pictures of a rectified pair.

    Parameters
    ----------
    landmarks, intrinsics, part : as of `CameraProjection`; both cameras share the intrinsics
    noise_cov : (4, 4), (4,) variances or a number, px²; (3, 3), (3,) with `shared_row`
    baseline : of the right camera, along the left one's x axis, m
    body_T_camera : (7,) where the left camera sits
    shared_row : readings are (x left, x right, y), one row for both; else (x left, y left, x right, y right)
    """

    landmarks: ArrayLike
    noise_cov: ArrayLike  # type: ignore[assignment]
    intrinsics: tuple[float, float, float, float]
    baseline: float
    body_T_camera: ArrayLike | None = None
    shared_row: bool = False
    part: str | None = None
    gate: float | None = None
    loss: Loss | None = None

    def __post_init__(self) -> None:
        if not self.baseline > 0:
            msg = f"the baseline of StereoPixels is the distance of the cameras in m, got {self.baseline}"
            raise ModelError(msg)
        prepare_pixels(self, 3 if self.shared_row else 4)

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `SensorModel.functions`."""
        return pixels(self, self.baseline, 3 if self.shared_row else 4, manifold)


def prepare_pixels(sensor: CameraProjection | StereoPixels, count: int) -> None:
    """Check and freeze the settings that both share."""
    who = type(sensor).__name__
    table = np.atleast_2d(np.array(sensor.landmarks, dtype=np.float64))
    if table.ndim != 2 or table.shape[1] != 3 or not np.isfinite(table).all():
        msg = f"{who} needs landmarks of shape (L, 3), finite; got shape {np.shape(sensor.landmarks)}"
        raise ShapeError(msg)
    inner = np.asarray(sensor.intrinsics, dtype=np.float64)
    if inner.shape != (4,) or not (np.isfinite(inner).all() and (inner[:2] > 0).all()):
        raise ModelError(f"intrinsics of a {who} are (fx, fy, cx, cy) in px, got {sensor.intrinsics}")
    table.flags.writeable = False
    mount = mounted(sensor.body_T_camera, SE3(), f"body_T_camera of a {who}")
    cov = require_covariance(sensor.noise_cov, count, f"the noise_cov of a {who}")
    known = {"landmarks": table, "body_T_camera": mount, "manifold": Vector(count), "noise_cov": cov}
    for name, value in known.items():
        object.__setattr__(sensor, name, value)


def pixels(
    sensor: CameraProjection | StereoPixels, baseline: float, count: int, manifold: Manifold
) -> Functions:
    """Lowered: both sensors are these functions."""
    storage, tangent, _ = find_part(manifold, (NavState, SE3), sensor.part, type(sensor).__name__)
    mount: Any = sensor.body_T_camera
    turn = rotation(*mount[:4].tolist())
    camera = (*sensor.intrinsics, baseline)
    params = as_params(storage, tangent, manifold.dim, count, camera, turn, mount[4:], sensor.landmarks)
    return Functions(project, project_jacobian, params, 1, helpers=HELPERS)


def from_body(x: Any, k: int, p: Any) -> tuple[float, float, float]:
    """Landmark k in the body's axes."""
    at, l = int(p[0]), 21 + 3 * k
    r = rotation(x[at], x[at + 1], x[at + 2], x[at + 3])
    return turned_back(r, p[l] - x[at + 4], p[l + 1] - x[at + 5], p[l + 2] - x[at + 6])


def from_camera(b: Any, p: Any) -> tuple[float, float, float]:
    """A point of the body in the camera's axes, never behind it."""
    a, e, f = b[0] - p[18], b[1] - p[19], b[2] - p[20]
    depth = p[11] * a + p[14] * e + p[17] * f
    return p[9] * a + p[12] * e + p[15] * f, p[10] * a + p[13] * e + p[16] * f, max(depth, NEAR)


def project(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """p = [storage, tangent, d, m, fx, fy, cx, cy, baseline, mount (9), its place (3), landmarks (3L)]."""
    c = from_camera(from_body(x, int(u[0]), p), p)
    left, row, m = p[4] * c[0] / c[2] + p[6], p[5] * c[1] / c[2] + p[7], int(p[3])
    out[0] = left
    if m == 3:
        out[1], out[2] = left - p[4] * p[8] / c[2], row
    else:
        out[1] = row
    if m == 4:
        out[2], out[3] = left - p[4] * p[8] / c[2], row


def project_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """By the body's rotation [b]x, by its position -I, both through the mount and the lens."""
    t, d, m = int(p[1]), int(p[2]), int(p[3])
    b = from_body(x, int(u[0]), p)
    c = from_camera(b, p)
    for i in range(m * d):
        out[i] = 0.0
    for i in range(m):
        across = i == 0 or (i == 1 and m == 3) or (i == 2 and m == 4)
        right = (i == 1 and m == 3) or (i == 2 and m == 4)
        g = p[4] / c[2] if across else p[5] / c[2]
        h = -g * ((c[0] - p[8] if right else c[0]) if across else c[1]) / c[2]
        k = 0 if across else 1
        n0, n1, n2 = g * p[9 + k] + h * p[11], g * p[12 + k] + h * p[14], g * p[15 + k] + h * p[17]
        row = i * d + t
        out[row] = n1 * b[2] - n2 * b[1]
        out[row + 1] = n2 * b[0] - n0 * b[2]
        out[row + 2] = n0 * b[1] - n1 * b[0]
        out[row + 3], out[row + 4], out[row + 5] = -n0, -n1, -n2


HELPERS = (rotation, turned_back, from_body, from_camera)
