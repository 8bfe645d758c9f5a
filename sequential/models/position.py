"""A sensor that reads the position of a point of the body: GPS with a lever arm, motion capture, a tag."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sequential.errors import ModelError
from sequential.manifold import SE2, SE3, Manifold, NavState, Vector
from sequential.model import Functions, Loss, SensorModel, as_params
from sequential.models.parts import find_part, named_vector
from sequential.models.rotation import rotation, turned
from sequential.noise import require_covariance

__all__ = ["Position"]


@dataclass(frozen=True, eq=False)
class Position(SensorModel):
    """World position of an antenna: world_p = world_p_body + world_R_body @ (lever_arm + arm).

    Parameters
    ----------
    noise_cov : (m, m), (m,) variances or a number, m²
    axes : 3, or 2 on SE(2) and planar vectors
    lever_arm : antenna in the body frame, m
    arm : name of a vector part of as many numbers as axes: what the lever arm is longer than `lever_arm`, m;
        a tape measure is a prior, turns of the body tell the rest
    part : name of the pose, navigation state or position vector; the first that fits unless given
    """

    noise_cov: ArrayLike  # type: ignore[assignment]
    axes: int = 3
    lever_arm: tuple[float, ...] = (0.0, 0.0, 0.0)
    part: str | None = None
    gate: float | None = None
    loss: Loss | None = None
    arm: str | None = None

    def __post_init__(self) -> None:
        if self.axes not in {2, 3} or len(self.lever_arm) > 3:
            msg = f"Position reads 2 or 3 axes with a lever arm of as many; got {self.axes}, {self.lever_arm}"
            raise ModelError(msg)
        object.__setattr__(self, "manifold", Vector(self.axes))
        cov = require_covariance(self.noise_cov, self.axes, "the noise_cov of a Position")
        object.__setattr__(self, "noise_cov", cov)

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `SensorModel.functions`."""
        kinds = (NavState, SE3) if self.axes == 3 else (SE2,)
        storage, tangent, member = find_part(manifold, (*kinds, Vector), self.part, "Position")
        arm = np.zeros(3)
        arm[: len(self.lever_arm)] = self.lever_arm
        free = named_vector(manifold, self.arm, self.axes, "Position's arm")
        params = as_params(storage, tangent, manifold.dim, self.axes, arm, free)
        if isinstance(member, Vector):
            if member.size < self.axes or arm.any() or self.arm is not None:
                msg = (
                    f"Position(axes={self.axes}) with lever arm {self.arm or self.lever_arm} cannot be read "
                    f"off {member}"
                )
                raise ModelError(msg)
            return Functions(on_vector, on_vector_jacobian, params)
        if isinstance(member, SE2):
            return Functions(on_plane, on_plane_jacobian, params, helpers=HELPERS)
        return Functions(on_body, on_body_jacobian, params, helpers=HELPERS)


def on_vector(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """First numbers of the vector; p = [storage, tangent, d, axes, arm (3), free arm (1, place, tangent)]."""
    for i in range(int(p[3])):
        out[i] = x[int(p[0]) + i]


def on_vector_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Identity on those numbers."""
    at, d, axes = int(p[1]), int(p[2]), int(p[3])
    for i in range(axes * d):
        out[i] = 0.0
    for i in range(axes):
        out[i * d + at + i] = 1.0


def whole_arm(x: Any, p: Any) -> tuple[float, float, float]:
    """The lever arm, with what the state adds to it."""
    if p[7] == 0.0:
        return p[4], p[5], p[6]
    k = int(p[8])
    return p[4] + x[k], p[5] + x[k + 1], p[6] + (x[k + 2] if p[3] == 3.0 else 0.0)


def on_plane(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Antenna of a planar vehicle."""
    at = int(p[0])
    c, s = np.cos(x[at + 2]), np.sin(x[at + 2])
    a, b, _ = whole_arm(x, p)
    out[0] = x[at] + c * a - s * b
    out[1] = x[at + 1] + s * a + c * b


def on_plane_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Steps are in the body frame: the rotation, and the turned arm."""
    at, d = int(p[1]), int(p[2])
    heading = x[int(p[0]) + 2]
    c, s = np.cos(heading), np.sin(heading)
    a, b, _ = whole_arm(x, p)
    for i in range(2 * d):
        out[i] = 0.0
    out[at], out[at + 1] = c, -s
    out[d + at], out[d + at + 1] = s, c
    out[at + 2] = -s * a - c * b
    out[d + at + 2] = c * a - s * b
    if p[7] > 0.0:
        k = int(p[9])
        out[k], out[k + 1] = c, -s
        out[d + k], out[d + k + 1] = s, c


def on_body(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Antenna of a body in space."""
    at = int(p[0])
    r = rotation(x[at], x[at + 1], x[at + 2], x[at + 3])
    a, b, c = whole_arm(x, p)
    out[0], out[1], out[2] = turned(r, a, b, c)
    for i in range(3):
        out[i] += x[at + 4 + i]


def on_body_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """[-R [arm]x, R] on (rotation, position), R on a free arm."""
    at, t, d = int(p[0]), int(p[1]), int(p[2])
    r = rotation(x[at], x[at + 1], x[at + 2], x[at + 3])
    a, b, c = whole_arm(x, p)
    for i in range(3 * d):
        out[i] = 0.0
    for i in range(3):
        row = i * d + t
        out[row] = r[3 * i + 2] * b - r[3 * i + 1] * c
        out[row + 1] = r[3 * i] * c - r[3 * i + 2] * a
        out[row + 2] = r[3 * i + 1] * a - r[3 * i] * b
        for j in range(3):
            out[row + 3 + j] = r[3 * i + j]
            if p[7] > 0.0:
                out[i * d + int(p[9]) + j] = r[3 * i + j]


HELPERS = (rotation, turned, whole_arm)
