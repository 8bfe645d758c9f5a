"""Range, and range with bearing, from a planar vehicle to landmarks whose places are known.

What a maker's calibration left over (an offset, a scale, where the sensor sits) can be parts of the state:
name the part, give it a prior, and declare it `static`.
"""

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

    Reads (1 + scale) · distance + bias.

    Parameters
    ----------
    landmarks : (L, 2) world positions, m
    noise_cov : variance, m²
    bias : name of a vector part of the state that is added to the distance: one number for all landmarks,
        or one for each, m
    scale : name of a vector part, likewise: the share by which the sensor reads too far
    pose : name of the SE(2) part (or of a vector that begins with x, y); the first unless given
    """

    landmarks: ArrayLike
    noise_cov: ArrayLike  # type: ignore[assignment]
    bias: str | None = None
    scale: str | None = None
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
        count = len(np.asarray(self.landmarks))
        bias = _calibration(manifold, self.bias, count, "Range's bias")
        scale = _calibration(manifold, self.scale, count, "Range's scale")
        params = as_params(storage, tangent, manifold.dim, planar, bias, scale, self.landmarks)
        return Functions(distance, distance_jacobian, params, 1, helpers=HELPERS)


def _calibration(manifold: Manifold, name: str | None, count: int, who: str) -> tuple[int, int, int]:
    """Size, storage and tangent of a calibration part: none, one number for all landmarks, one for each."""
    if name is None:
        return 0, 0, 0
    storage, tangent, part = find_part(manifold, (Vector,), name, who)
    if part.size not in {1, count}:
        msg = f"{who} {name!r} has {part.size} numbers; 1 or one for each of {count} landmarks"
        raise ModelError(msg)
    return part.size, storage, tangent


def entry(size: float, start: float, k: int) -> int:
    """Where the number for landmark k stands, of a part with one number for all or one for each."""
    return int(start) + (k if size > 1.0 else 0)


def distance(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """p = [storage, tangent, d, planar, bias (size, storage, tangent), scale (the same), landmarks (2L)]."""
    at, k = int(p[0]), int(u[0])
    out[0] = math.hypot(p[10 + 2 * k] - x[at], p[11 + 2 * k] - x[at + 1])
    if p[7] > 0.0:
        out[0] *= 1.0 + x[entry(p[7], p[8], k)]
    if p[4] > 0.0:
        out[0] += x[entry(p[4], p[5], k)]


def distance_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Minus the unit vector to the landmark, in the body frame on SE(2); the calibration's own columns."""
    at, t, d, k = int(p[0]), int(p[1]), int(p[2]), int(u[0])
    for i in range(d):
        out[i] = 0.0
    dx, dy = p[10 + 2 * k] - x[at], p[11 + 2 * k] - x[at + 1]
    r = max(math.hypot(dx, dy), NEAR)
    c, s = 1.0, 0.0
    if p[3] == 1.0:
        c, s = math.cos(x[at + 2]), math.sin(x[at + 2])
    gain = 1.0
    if p[7] > 0.0:
        gain += x[entry(p[7], p[8], k)]
        out[entry(p[7], p[9], k)] = r
    if p[4] > 0.0:
        out[entry(p[4], p[6], k)] = 1.0
    out[t] = -gain * (c * dx + s * dy) / r
    out[t + 1] = -gain * (c * dy - s * dx) / r


@dataclass(frozen=True, eq=False)
class RangeBearing(SensorModel):
    """Distance and direction (rad) to a known landmark, seen from the sensor; noise_cov (2, 2) in that order.

    Parameters
    ----------
    landmarks : (L, 2) world positions, m; the reading's context holds the row of the one that was seen
    noise_cov : (2, 2), (2,) variances or a number; m² and rad²
    scale : name of a vector part of one number: the share by which the sensor reads too far
    mount : name of an SE(2) part, body_T_sensor: where the sensor sits and looks; at the body unless given
    pose : name of the SE(2) part that is the vehicle; the first unless given
    """

    landmarks: ArrayLike
    noise_cov: ArrayLike  # type: ignore[assignment]
    scale: str | None = None
    mount: str | None = None
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
        scale = _calibration(manifold, self.scale, 1, "RangeBearing's scale")
        mount = (0, 0, 0)
        if self.mount is not None:
            mount = (1, *find_part(manifold, (SE2,), self.mount, "RangeBearing's mount")[:2])
            if mount[1] == storage:
                msg = f"RangeBearing's mount {self.mount!r} is the vehicle's pose; name another SE(2) part"
                raise ModelError(msg)
        params = as_params(storage, tangent, manifold.dim, scale, mount, self.landmarks)
        return Functions(sighting, sighting_jacobian, params, 1, helpers=HELPERS)


def sensor_frame(x: Any, k: int, p: Any) -> tuple[float, float, float, float]:
    """Landmark k in the sensor's axes: from the body's origin (2), then from the sensor's (2)."""
    at = int(p[0])
    dx, dy = p[9 + 2 * k] - x[at], p[10 + 2 * k] - x[at + 1]
    c, s = math.cos(x[at + 2]), math.sin(x[at + 2])
    a, b = c * dx + s * dy, c * dy - s * dx
    if p[6] == 0.0:
        return a, b, a, b
    m = int(p[7])
    c, s = math.cos(x[m + 2]), math.sin(x[m + 2])
    e, f = a - x[m], b - x[m + 1]
    return c * a + s * b, c * b - s * a, c * e + s * f, c * f - s * e


def sighting(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """p = [storage, tangent, d, scale (size, storage, tangent), mount (the same), landmarks (2L)]."""
    _, _, e, f = sensor_frame(x, int(u[0]), p)
    out[0] = math.hypot(e, f)
    if p[3] > 0.0:
        out[0] *= 1.0 + x[int(p[4])]
    out[1] = math.atan2(f, e)


def sighting_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Rows (range, bearing).  Seen from the sensor, the landmark moves by -step, and by (b, -a) per rad."""
    t, d = int(p[1]), int(p[2])
    for i in range(2 * d):
        out[i] = 0.0
    a, b, e, f = sensor_frame(x, int(u[0]), p)
    r = max(math.hypot(e, f), NEAR)
    ux, uy = e / r, f / r
    c, s = 1.0, 0.0
    gain = 1.0
    if p[3] > 0.0:
        gain += x[int(p[4])]
        out[int(p[5])] = r
    if p[6] > 0.0:
        m, turn = int(p[8]), x[int(p[7]) + 2]
        c, s = math.cos(turn), math.sin(turn)
        out[m], out[m + 1] = -gain * ux, -gain * uy
        out[d + m], out[d + m + 1], out[d + m + 2] = uy / r, -ux / r, -1.0
    # Steps of the body are along its own axes: turned by the mount before they meet the sensor's.
    out[t], out[t + 1] = -gain * (c * ux - s * uy), -gain * (s * ux + c * uy)
    out[t + 2] = gain * (ux * b - uy * a)
    out[d + t], out[d + t + 1] = (c * uy + s * ux) / r, (s * uy - c * ux) / r
    out[d + t + 2] = -(ux * a + uy * b) / r


HELPERS = (entry, sensor_frame)
