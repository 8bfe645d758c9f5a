"""Velocity along the body's own axes: wheels, a Doppler log, and what wheels cannot do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sequential.errors import ModelError, ShapeError
from sequential.log import Stream
from sequential.manifold import SO3, Manifold, NavState, Vector
from sequential.model import Functions, Loss, SensorModel, as_params
from sequential.models.parts import find_part, mounted, named_vector
from sequential.models.rotation import rotation, turned_back
from sequential.noise import require_covariance

__all__ = ["BodyVelocity", "WheelOdometry", "wheel_readings"]


@dataclass(frozen=True, eq=False)
class BodyVelocity(SensorModel):
    """Velocity of a point of the body along the sensor's axes, m/s.

    Reads components of body_R_sensorᵀ (world_R_bodyᵀ v + ω x lever_arm), the first one times (1 + scale).

    Parameters
    ----------
    noise_cov : (m, m), (m,) variances or a number, m²/s²
    axes : which of the sensor's axes are read, m of 0, 1, 2
    scale : name of a vector part of one number: the share by which axis 0 reads too fast
    body_q_sensor : (4,) how the sensor is mounted; along the body's axes unless given
    lever_arm : (3,) the point in the body frame, m.  Where it is not zero, the reading's context is the
        body's angular rate (3), rad/s
    gyro_bias : name of a vector part of three numbers that is taken off that rate
    part : name of the navigation state; the first unless given
    """

    noise_cov: ArrayLike  # type: ignore[assignment]
    axes: tuple[int, ...] = (0, 1, 2)
    scale: str | None = None
    body_q_sensor: ArrayLike | None = None
    lever_arm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gyro_bias: str | None = None
    part: str | None = None
    gate: float | None = None
    loss: Loss | None = None

    def __post_init__(self) -> None:
        if not self.axes or len(set(self.axes)) < len(self.axes) or not set(self.axes) <= {0, 1, 2}:
            raise ModelError(f"BodyVelocity reads some of the axes 0, 1 and 2, each once; got {self.axes}")
        prepare_velocity(self, len(self.axes))

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `SensorModel.functions`."""
        return body_velocity(self, self.axes, manifold)


@dataclass(frozen=True, eq=False)
class WheelOdometry(SensorModel):
    """Speed by the wheels, and the two directions in which wheels neither slip nor lift: (speed, 0, 0), m/s.

    Parameters
    ----------
    noise_cov : (3, 3), (3,) variances or a number, m²/s²: of the speed, across (slip) and up (suspension)
    scale, body_q_sensor, lever_arm, gyro_bias, part : as of `BodyVelocity`; the lever arm leads to the axle
        that does not steer, the sensor's axis 0 points ahead

    Notes
    -----
    The zeros are the non-holonomic constraint (Dissanayake et al. 2001), noisy since cars slip.
    """

    noise_cov: ArrayLike  # type: ignore[assignment]
    scale: str | None = None
    body_q_sensor: ArrayLike | None = None
    lever_arm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gyro_bias: str | None = None
    part: str | None = None
    gate: float | None = None
    loss: Loss | None = None

    def __post_init__(self) -> None:
        prepare_velocity(self, 3)

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `SensorModel.functions`."""
        return body_velocity(self, (0, 1, 2), manifold)


def wheel_readings(t: ArrayLike, speed: ArrayLike, rate: ArrayLike | None = None) -> Stream:
    """Readings of a `WheelOdometry`: speeds (N,), zeros across and up; `rate` (N, 3) is their context.

    Raises
    ------
    ShapeError
    """
    own = np.asarray(speed, dtype=np.float64)
    if own.ndim != 1:
        raise ShapeError(f"speeds of wheels are (N,), got shape {own.shape}")
    values = np.zeros((len(own), 3))
    values[:, 0] = own
    return Stream(np.asarray(t), values, None if rate is None else np.asarray(rate, dtype=np.float64))


def prepare_velocity(sensor: BodyVelocity | WheelOdometry, count: int) -> None:
    """Check and freeze the settings that both share."""
    who = type(sensor).__name__
    arm = np.asarray(sensor.lever_arm, dtype=np.float64)
    if arm.shape != (3,) or not np.isfinite(arm).all():
        raise ShapeError(f"lever_arm of a {who} is (3,) m in the body frame, got {sensor.lever_arm}")
    mount = mounted(sensor.body_q_sensor, SO3(), f"body_q_sensor of a {who}")
    object.__setattr__(sensor, "body_q_sensor", mount)
    object.__setattr__(sensor, "manifold", Vector(count))
    cov = require_covariance(sensor.noise_cov, count, f"the noise_cov of a {who}")
    object.__setattr__(sensor, "noise_cov", cov)


def body_velocity(
    sensor: BodyVelocity | WheelOdometry, axes: tuple[int, ...], manifold: Manifold
) -> Functions:
    """Lowered: both sensors are these functions."""
    who = type(sensor).__name__
    storage, tangent, _ = find_part(manifold, (NavState,), sensor.part, who)
    scale = named_vector(manifold, sensor.scale, 1, f"{who}'s scale")
    bias = named_vector(manifold, sensor.gyro_bias, 3, f"{who}'s gyro_bias")
    arm, mount = np.asarray(sensor.lever_arm, dtype=np.float64), np.asarray(sensor.body_q_sensor)
    inputs = 3 if arm.any() else 0
    rows = [*axes, -1, -1][:3]
    turn = rotation(*mount.tolist())
    params = as_params(storage, tangent, manifold.dim, len(axes), rows, scale, bias, inputs, arm, turn)
    return Functions(along, along_jacobian, params, inputs, helpers=HELPERS)


def in_body(x: Any, p: Any) -> tuple[float, float, float]:
    """Velocity of the body's origin in the body's axes."""
    at = int(p[0])
    r = rotation(x[at], x[at + 1], x[at + 2], x[at + 3])
    return turned_back(r, x[at + 7], x[at + 8], x[at + 9])


def swung(x: Any, u: Any, p: Any) -> tuple[float, float, float]:
    """What the lever arm adds: ω x arm."""
    if p[13] == 0.0:
        return 0.0, 0.0, 0.0
    a, b, c = u[0], u[1], u[2]
    if p[10] > 0.0:
        k = int(p[11])
        a, b, c = a - x[k], b - x[k + 1], c - x[k + 2]
    return b * p[16] - c * p[15], c * p[14] - a * p[16], a * p[15] - b * p[14]


def along(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """p = [storage, tangent, d, m, axes (3), scale (3), gyro bias (3), context, arm (3), mount (9)]."""
    v, w = in_body(x, p), swung(x, u, p)
    a, b, c = v[0] + w[0], v[1] + w[1], v[2] + w[2]
    for i in range(int(p[3])):
        k = int(p[4 + i])
        out[i] = p[17 + k] * a + p[20 + k] * b + p[23 + k] * c
        if p[7] > 0.0 and k == 0:
            out[i] *= 1.0 + x[int(p[8])]


def along_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Mᵀ times [v]x on the rotation, I on the velocity, [arm]x on the gyro bias; and the scale's column."""
    t, d, v, w = int(p[1]), int(p[2]), in_body(x, p), swung(x, u, p)
    for i in range(int(p[3]) * d):
        out[i] = 0.0
    for i in range(int(p[3])):
        k, gain = int(p[4 + i]), 1.0
        row = i * d
        m0, m1, m2 = p[17 + k], p[20 + k], p[23 + k]
        if p[7] > 0.0 and k == 0:
            gain += x[int(p[8])]
            out[row + int(p[9])] = m0 * (v[0] + w[0]) + m1 * (v[1] + w[1]) + m2 * (v[2] + w[2])
        m0, m1, m2 = gain * m0, gain * m1, gain * m2
        out[row + t] = m1 * v[2] - m2 * v[1]
        out[row + t + 1] = m2 * v[0] - m0 * v[2]
        out[row + t + 2] = m0 * v[1] - m1 * v[0]
        out[row + t + 6], out[row + t + 7], out[row + t + 8] = m0, m1, m2
        if p[10] > 0.0 and p[13] > 0.0:
            at = row + int(p[12])
            out[at] = m1 * p[16] - m2 * p[15]
            out[at + 1] = m2 * p[14] - m0 * p[16]
            out[at + 2] = m0 * p[15] - m1 * p[14]


HELPERS = (rotation, turned_back, in_body, swung)
