"""A magnetometer: the field of the world in the sensor's axes, and the iron that turns with it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sequential.errors import ModelError
from sequential.manifold import SE3, SO3, Manifold, NavState, Vector
from sequential.model import Functions, Loss, SensorModel, as_params
from sequential.models.parts import find_part, mounted, named_vector
from sequential.models.rotation import rotation, turned_back
from sequential.noise import require_covariance

__all__ = ["Magnetometer"]


@dataclass(frozen=True, eq=False)
class Magnetometer(SensorModel):
    """body_R_sensorᵀ world_R_bodyᵀ world_field + bias, in the field's unit.

    Parameters
    ----------
    world_field : (3,) in the world frame, µT or any other unit; `Direction` serves for other fields
    noise_cov : (3, 3), (3,) variances or a number, that unit squared
    bias : name of a vector part of three numbers, hard iron in the sensor's axes: static where the iron
        is screwed on
    body_q_sensor : (4,) quaternion, how the sensor is mounted; along the body's axes unless given
    part : name of the SO(3), SE(3) or navigation part; the first unless given

    Notes
    -----
    A bias and an attitude are told apart by turns about two axes.  Soft iron is no bias: calibrate it first
    (`sequential.sensors.MagnetometerEllipsoid`).
    """

    world_field: ArrayLike
    noise_cov: ArrayLike  # type: ignore[assignment]
    bias: str | None = None
    body_q_sensor: ArrayLike | None = None
    part: str | None = None
    gate: float | None = None
    loss: Loss | None = None

    def __post_init__(self) -> None:
        field = np.array(self.world_field, dtype=np.float64)
        if field.shape != (3,) or not (np.isfinite(field).all() and np.linalg.norm(field) > 0):
            msg = f"Magnetometer needs a world_field of three numbers, not all zero, got {self.world_field!r}"
            raise ModelError(msg)
        field.flags.writeable = False
        object.__setattr__(self, "world_field", field)
        mount = mounted(self.body_q_sensor, SO3(), "body_q_sensor of a Magnetometer")
        object.__setattr__(self, "body_q_sensor", mount)
        object.__setattr__(self, "manifold", Vector(3))
        cov = require_covariance(self.noise_cov, 3, "the noise_cov of a Magnetometer")
        object.__setattr__(self, "noise_cov", cov)

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `SensorModel.functions`."""
        storage, tangent, _ = find_part(manifold, (SO3, SE3, NavState), self.part, "Magnetometer")
        bias = named_vector(manifold, self.bias, 3, "Magnetometer's bias")
        mount: Any = self.body_q_sensor
        params = as_params(storage, tangent, manifold.dim, self.world_field, bias, rotation(*mount))
        return Functions(field_seen, field_jacobian, params, helpers=HELPERS)


def in_body(x: Any, p: Any) -> tuple[float, float, float]:
    """The field in the body's axes."""
    at = int(p[0])
    return turned_back(rotation(x[at], x[at + 1], x[at + 2], x[at + 3]), p[3], p[4], p[5])


def field_seen(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """p = [storage, tangent, d, field (3), bias (1, storage, tangent), mount (9)]."""
    b = in_body(x, p)
    for i in range(3):
        out[i] = p[9 + i] * b[0] + p[12 + i] * b[1] + p[15 + i] * b[2]
        if p[6] > 0.0:
            out[i] += x[int(p[7]) + i]


def field_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Mᵀ [body field]x on the rotation, identity on the bias."""
    t, d = int(p[1]), int(p[2])
    a, b, c = in_body(x, p)
    for i in range(3 * d):
        out[i] = 0.0
    for i in range(3):
        m0, m1, m2 = p[9 + i], p[12 + i], p[15 + i]
        out[i * d + t] = m1 * c - m2 * b
        out[i * d + t + 1] = m2 * a - m0 * c
        out[i * d + t + 2] = m0 * b - m1 * a
        if p[6] > 0.0:
            out[i * d + int(p[8]) + i] = 1.0


HELPERS = (rotation, turned_back, in_body)
