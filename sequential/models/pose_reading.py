"""A sensor that measures a whole pose: motion capture, a localiser, a marker with a certain pose."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError
from sequential.manifold import SE2, SE3, Manifold, NavState
from sequential.model import Functions, Loss, SensorModel, as_params
from sequential.models.parts import find_part, mounted
from sequential.models.rotation import quaternion_product, rotation, turned
from sequential.noise import require_covariance

__all__ = ["PoseReading"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PoseReading(SensorModel):
    """world_T_sensor = world_T_body · body_T_sensor, a reading on SE(3), or on SE(2) where planar.

    Parameters
    ----------
    noise_cov : (6, 6), (6,) variances or a number, rad² then m², in the sensor's axes (rotation first);
        planar (3, 3), (3,): m², m², rad²
    body_T_sensor : (7,) or planar (3,), where the sensor sits; at the body unless given
    mount : instead, name of an SE(3) (planar: SE(2)) part of the state that is body_T_sensor
    planar : the state is planar, and so are the readings (x, y, heading)
    part : name of the pose or navigation state; the first that fits unless given
    """

    noise_cov: ArrayLike  # type: ignore[assignment]
    body_T_sensor: ArrayLike | None = None
    mount: str | None = None
    planar: bool = False
    part: str | None = None
    gate: float | None = None
    loss: Loss | None = None

    def __post_init__(self) -> None:
        if self.mount is not None and self.body_T_sensor is not None:
            raise ModelError("a PoseReading has a body_T_sensor or a mount in the state, not both")
        reading: Manifold = SE2() if self.planar else SE3()
        fixed = mounted(self.body_T_sensor, reading, "body_T_sensor of a PoseReading")
        object.__setattr__(self, "fixed_mount", fixed)
        object.__setattr__(self, "manifold", reading)
        cov = require_covariance(self.noise_cov, reading.dim, "the noise_cov of a PoseReading")
        object.__setattr__(self, "noise_cov", cov)

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `SensorModel.functions`."""
        kinds = (SE2,) if self.planar else (NavState, SE3)
        storage, tangent, _ = find_part(manifold, kinds, self.part, "PoseReading")
        mount = (0, 0, 0)
        if self.mount is not None:
            mount = (1, *find_part(manifold, (type(self.manifold),), self.mount, "PoseReading's mount")[:2])
            if mount[1] == storage:
                msg = f"PoseReading's mount {self.mount!r} is the body itself; name another part"
                raise ModelError(msg)
        fixed: Array = self.fixed_mount  # type: ignore[attr-defined]  # set above
        params = as_params(storage, tangent, manifold.dim, mount, fixed)
        if self.planar:
            return Functions(planar_pose, planar_pose_jacobian, params, helpers=PLANAR)
        return Functions(pose, pose_jacobian, params, helpers=SPATIAL)


def planar_mount(x: Any, p: Any) -> tuple[float, float, float]:
    """body_T_sensor; p = [storage, tangent, d, mount (1, storage, tangent), fixed mount (3 or 7)]."""
    if p[3] > 0.0:
        k = int(p[4])
        return x[k], x[k + 1], x[k + 2]
    return p[6], p[7], p[8]


def planar_pose(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """The pose composed with the mount."""
    at, m = int(p[0]), planar_mount(x, p)
    c, s = math.cos(x[at + 2]), math.sin(x[at + 2])
    angle = x[at + 2] + m[2]
    out[0] = x[at] + c * m[0] - s * m[1]
    out[1] = x[at + 1] + s * m[0] + c * m[1]
    out[2] = math.atan2(math.sin(angle), math.cos(angle))


def planar_pose_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Adjoint of the inverse mount; the identity on a mount in the state."""
    t, d, m = int(p[1]), int(p[2]), planar_mount(x, p)
    c, s = math.cos(m[2]), math.sin(m[2])
    for i in range(3 * d):
        out[i] = 0.0
    out[t], out[t + 1], out[t + 2] = c, s, s * m[0] - c * m[1]
    out[d + t], out[d + t + 1], out[d + t + 2] = -s, c, c * m[0] + s * m[1]
    out[2 * d + t + 2] = 1.0
    if p[3] > 0.0:
        for i in range(3):
            out[i * d + int(p[5]) + i] = 1.0


def spatial_mount(x: Any, p: Any) -> tuple[float, ...]:
    """body_T_sensor: quaternion and position."""
    if p[3] > 0.0:
        k = int(p[4])
        return x[k], x[k + 1], x[k + 2], x[k + 3], x[k + 4], x[k + 5], x[k + 6]
    return p[6], p[7], p[8], p[9], p[10], p[11], p[12]


def pose(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """The pose composed with the mount."""
    at, m = int(p[0]), spatial_mount(x, p)
    w, a, b, c = x[at], x[at + 1], x[at + 2], x[at + 3]
    out[0], out[1], out[2], out[3] = quaternion_product(w, a, b, c, m[0], m[1], m[2], m[3])
    out[4], out[5], out[6] = turned(rotation(w, a, b, c), m[4], m[5], m[6])
    for i in range(3):
        out[4 + i] += x[at + 4 + i]


def pose_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Adjoint of the inverse mount, [[Mᵀ, 0], [-Mᵀ [m]x, Mᵀ]]; the identity on a mount in the state."""
    t, d, m = int(p[1]), int(p[2]), spatial_mount(x, p)
    r = rotation(m[0], m[1], m[2], m[3])
    for i in range(6 * d):
        out[i] = 0.0
    for i in range(3):
        r0, r1, r2 = r[i], r[3 + i], r[6 + i]
        for row in (i * d + t, (3 + i) * d + t + 3):
            out[row], out[row + 1], out[row + 2] = r0, r1, r2
        row = (3 + i) * d + t
        out[row] = r2 * m[5] - r1 * m[6]
        out[row + 1] = r0 * m[6] - r2 * m[4]
        out[row + 2] = r1 * m[4] - r0 * m[5]
    if p[3] > 0.0:
        for i in range(6):
            out[i * d + int(p[5]) + i] = 1.0


PLANAR = (planar_mount,)
SPATIAL = (quaternion_product, rotation, turned, spatial_mount)
