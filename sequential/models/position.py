"""A sensor that reads the position of a point of the body: GPS with a lever arm, motion capture, a tag."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sequential.errors import ModelError
from sequential.manifold import SE2, SE3, Manifold, NavState, Vector
from sequential.model import Functions, Loss, SensorModel, as_params
from sequential.models.parts import find_part
from sequential.models.rotation import rotation
from sequential.noise import require_covariance

__all__ = ["Position"]


@dataclass(frozen=True, eq=False)
class Position(SensorModel):
    """World position of an antenna: world_p = world_p_body + world_R_body @ lever_arm.

    Parameters
    ----------
    noise_cov : (m, m), (m,) variances or a number, m²
    axes : 3, or 2 on SE(2) and planar vectors
    lever_arm : antenna in the body frame, m
    part : name of the pose, navigation state or position vector; the first that fits unless given
    """

    noise_cov: ArrayLike  # type: ignore[assignment]
    axes: int = 3
    lever_arm: tuple[float, ...] = (0.0, 0.0, 0.0)
    part: str | None = None
    gate: float | None = None
    loss: Loss | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "manifold", Vector(self.axes))
        cov = require_covariance(self.noise_cov, self.axes, "the noise_cov of a Position")
        object.__setattr__(self, "noise_cov", cov)

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `SensorModel.functions`."""
        kinds = (NavState, SE3) if self.axes == 3 else (SE2,)
        storage, tangent, member = find_part(manifold, (*kinds, Vector), self.part, "Position")
        arm = np.zeros(3)
        arm[: len(self.lever_arm)] = self.lever_arm
        params = as_params(storage, tangent, manifold.dim, self.axes, arm)
        if isinstance(member, Vector):
            if member.size < self.axes or arm.any():
                msg = (
                    f"Position(axes={self.axes}) with lever arm {self.lever_arm} cannot be read off {member}"
                )
                raise ModelError(msg)
            return Functions(on_vector, on_vector_jacobian, params)
        if isinstance(member, SE2):
            return Functions(on_plane, on_plane_jacobian, params)
        return Functions(on_body, on_body_jacobian, params, helpers=HELPERS)


def on_vector(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """First numbers of the vector; p = [storage, tangent, d, axes, arm (3)]."""
    for i in range(int(p[3])):
        out[i] = x[int(p[0]) + i]


def on_vector_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Identity on those numbers."""
    at, d, axes = int(p[1]), int(p[2]), int(p[3])
    for i in range(axes * d):
        out[i] = 0.0
    for i in range(axes):
        out[i * d + at + i] = 1.0


def on_plane(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Antenna of a planar vehicle."""
    at = int(p[0])
    c, s = np.cos(x[at + 2]), np.sin(x[at + 2])
    out[0] = x[at] + c * p[4] - s * p[5]
    out[1] = x[at + 1] + s * p[4] + c * p[5]


def on_plane_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Steps are in the body frame: the rotation, and the turned arm."""
    at, d = int(p[1]), int(p[2])
    heading = x[int(p[0]) + 2]
    c, s = np.cos(heading), np.sin(heading)
    for i in range(2 * d):
        out[i] = 0.0
    out[at], out[at + 1] = c, -s
    out[d + at], out[d + at + 1] = s, c
    out[at + 2] = -s * p[4] - c * p[5]
    out[d + at + 2] = c * p[4] - s * p[5]


def on_body(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Antenna of a body in space."""
    at = int(p[0])
    r = rotation(x[at], x[at + 1], x[at + 2], x[at + 3])
    for i in range(3):
        out[i] = x[at + 4 + i] + r[3 * i] * p[4] + r[3 * i + 1] * p[5] + r[3 * i + 2] * p[6]


def on_body_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """[-R [arm]x, R] on (rotation, position)."""
    at, t, d = int(p[0]), int(p[1]), int(p[2])
    r = rotation(x[at], x[at + 1], x[at + 2], x[at + 3])
    for i in range(3 * d):
        out[i] = 0.0
    for i in range(3):
        row = i * d + t
        out[row] = r[3 * i + 2] * p[5] - r[3 * i + 1] * p[6]
        out[row + 1] = r[3 * i] * p[6] - r[3 * i + 2] * p[4]
        out[row + 2] = r[3 * i + 1] * p[4] - r[3 * i] * p[5]
        for j in range(3):
            out[row + 3 + j] = r[3 * i + j]


HELPERS = (rotation,)
