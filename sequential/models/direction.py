"""A sensor that sees a known world direction in the body frame: gravity at rest, the magnetic field."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sequential.errors import ModelError
from sequential.manifold import SE3, SO3, Manifold, NavState, Vector
from sequential.model import Functions, Loss, SensorModel, as_params
from sequential.models.parts import find_part
from sequential.models.rotation import rotation
from sequential.noise import require_covariance

__all__ = ["Direction"]


@dataclass(frozen=True, eq=False)
class Direction(SensorModel):
    """body_v = world_R_bodyᵀ @ world_v.

    Parameters
    ----------
    world_v : (3,) the direction in the world frame, in the unit of the readings (unit length, m/s², µT …)
    noise_cov : (3, 3), (3,) variances or a number, that unit squared
    part : name of the SO(3), SE(3) or navigation part; the first unless given
    """

    world_v: ArrayLike
    noise_cov: ArrayLike  # type: ignore[assignment]
    part: str | None = None
    gate: float | None = None
    loss: Loss | None = None

    def __post_init__(self) -> None:
        vector = np.asarray(self.world_v, dtype=np.float64)
        if vector.shape != (3,) or not np.linalg.norm(vector) > 0:
            msg = f"Direction needs a world_v of three numbers that are not all zero, got {self.world_v!r}"
            raise ModelError(msg)
        object.__setattr__(self, "world_v", vector)
        object.__setattr__(self, "manifold", Vector(3))
        cov = require_covariance(self.noise_cov, 3, "the noise_cov of a Direction")
        object.__setattr__(self, "noise_cov", cov)

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `SensorModel.functions`."""
        storage, tangent, _ = find_part(manifold, (SO3, SE3, NavState), self.part, "Direction")
        params = as_params(storage, tangent, manifold.dim, self.world_v)
        return Functions(look, look_jacobian, params, helpers=HELPERS)


def look(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """p = [storage, tangent, d, world_v (3)]."""
    at = int(p[0])
    r = rotation(x[at], x[at + 1], x[at + 2], x[at + 3])
    for i in range(3):
        out[i] = r[i] * p[3] + r[3 + i] * p[4] + r[6 + i] * p[5]


def look_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """[Rᵀ v]x on the rotation."""
    at, t, d = int(p[0]), int(p[1]), int(p[2])
    r = rotation(x[at], x[at + 1], x[at + 2], x[at + 3])
    a = r[0] * p[3] + r[3] * p[4] + r[6] * p[5]
    b = r[1] * p[3] + r[4] * p[4] + r[7] * p[5]
    c = r[2] * p[3] + r[5] * p[4] + r[8] * p[5]
    for i in range(3 * d):
        out[i] = 0.0
    out[t + 1], out[t + 2] = -c, b
    out[d + t], out[d + t + 2] = c, -a
    out[2 * d + t], out[2 * d + t + 1] = -b, a


HELPERS = (rotation,)
