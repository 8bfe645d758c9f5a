"""Range, and range with bearing, from a planar vehicle to landmarks whose places are known."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sequential.errors import ModelError, ShapeError
from sequential.manifold import SE2, SO2, Manifold, Product, Vector
from sequential.model import Functions, Loss, SensorModel, as_params
from sequential.models.parts import find_part
from sequential.noise import require_covariance

__all__ = ["Range", "RangeBearing"]

NEAR = 1e-9  # m: closer than this a direction to the landmark does not exist


def _landmarks(values: ArrayLike, who: str) -> np.ndarray:
    table = np.atleast_2d(np.asarray(values, dtype=np.float64))
    if table.ndim != 2 or table.shape[1] != 2 or not np.all(np.isfinite(table)):
        msg = f"{who} needs landmarks of shape (L, 2), finite; got shape {np.shape(values)}"
        raise ShapeError(msg)
    return table


@dataclass(frozen=True, eq=False)
class Range(SensorModel):
    """Distance to the landmark whose row in `landmarks` stands in the reading's context.

    Parameters
    ----------
    landmarks : (L, 2) world positions, m
    noise_cov : variance, m²
    bias : name of a vector part of the state that is added to the distance: one number for all landmarks,
        or one for each
    pose : name of the SE(2) part (or of a vector that begins with x, y); the first unless given
    """

    landmarks: ArrayLike
    noise_cov: ArrayLike  # type: ignore[assignment]
    bias: str | None = None
    pose: str | None = None
    gate: float | None = None
    loss: Loss | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "landmarks", _landmarks(self.landmarks, "Range"))
        object.__setattr__(self, "manifold", Vector(1))
        object.__setattr__(
            self, "noise_cov", require_covariance(self.noise_cov, 1, "the noise_cov of a Range")
        )

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `SensorModel.functions`."""
        storage, tangent, member = find_part(manifold, (SE2, Vector), self.pose, "Range")
        if isinstance(member, Vector) and member.size < 2:
            msg = f"Range needs a pose or a vector that begins with x and y; got {member}"
            raise ModelError(msg)
        planar = 1.0 if isinstance(member, SE2) else 0.0
        bias = (0, 0, 0)
        if self.bias is not None:
            b_storage, b_tangent, part = find_part(manifold, (Vector,), self.bias, "Range's bias")
            if part.size not in {1, len(self.landmarks)}:  # type: ignore[arg-type]
                msg = f"Range's bias {self.bias!r} has {part.size} numbers; 1 or one for each landmark"
                raise ModelError(msg)
            bias = (part.size, b_storage, b_tangent)
        params = as_params(storage, tangent, manifold.dim, planar, bias, self.landmarks)
        return Functions(distance, distance_jacobian, params, 1)


def distance(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """p = [storage, tangent, d, planar, biases, bias storage, bias tangent, landmarks (2L)]; u = [index]."""
    at, k = int(p[0]), int(u[0])
    out[0] = math.hypot(p[7 + 2 * k] - x[at], p[8 + 2 * k] - x[at + 1])
    if p[4] == 1.0:
        out[0] += x[int(p[5])]
    elif p[4] > 1.0:
        out[0] += x[int(p[5]) + k]


def distance_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Minus the unit vector to the landmark, in the body frame on SE(2)."""
    at, t, d, k = int(p[0]), int(p[1]), int(p[2]), int(u[0])
    for i in range(d):
        out[i] = 0.0
    dx, dy = p[7 + 2 * k] - x[at], p[8 + 2 * k] - x[at + 1]
    r = max(math.hypot(dx, dy), NEAR)
    c, s = 1.0, 0.0
    if p[3] == 1.0:
        c, s = math.cos(x[at + 2]), math.sin(x[at + 2])
    out[t] = -(c * dx + s * dy) / r
    out[t + 1] = -(c * dy - s * dx) / r
    if p[4] == 1.0:
        out[int(p[6])] = 1.0
    elif p[4] > 1.0:
        out[int(p[6]) + k] = 1.0


@dataclass(frozen=True, eq=False)
class RangeBearing(SensorModel):
    """Distance and direction (body frame, rad) to a known landmark; noise_cov (2, 2) in that order.

    Parameters are those of `Range`, without a bias.
    """

    landmarks: ArrayLike
    noise_cov: ArrayLike  # type: ignore[assignment]
    pose: str | None = None
    gate: float | None = None
    loss: Loss | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "landmarks", _landmarks(self.landmarks, "RangeBearing"))
        object.__setattr__(self, "manifold", Product(range=Vector(1), bearing=SO2()))
        cov = require_covariance(self.noise_cov, 2, "the noise_cov of a RangeBearing")
        object.__setattr__(self, "noise_cov", cov)

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `SensorModel.functions`."""
        storage, tangent, _ = find_part(manifold, (SE2,), self.pose, "RangeBearing")
        params = as_params(storage, tangent, manifold.dim, self.landmarks)
        return Functions(sighting, sighting_jacobian, params, 1)


def sighting(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """p = [storage, tangent, d, landmarks (2L)]; u = [index]."""
    at, k = int(p[0]), int(u[0])
    dx, dy = p[3 + 2 * k] - x[at], p[4 + 2 * k] - x[at + 1]
    out[0] = math.hypot(dx, dy)
    bearing = math.atan2(dy, dx) - x[at + 2]
    out[1] = math.atan2(math.sin(bearing), math.cos(bearing))


def sighting_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Rows (range, bearing), steps in the body frame."""
    at, t, d, k = int(p[0]), int(p[1]), int(p[2]), int(u[0])
    for i in range(2 * d):
        out[i] = 0.0
    dx, dy = p[3 + 2 * k] - x[at], p[4 + 2 * k] - x[at + 1]
    c, s = math.cos(x[at + 2]), math.sin(x[at + 2])
    a, b = c * dx + s * dy, c * dy - s * dx
    r = max(math.hypot(dx, dy), NEAR)
    out[t], out[t + 1] = -a / r, -b / r
    out[d + t], out[d + t + 1], out[d + t + 2] = b / (r * r), -a / (r * r), -1.0
