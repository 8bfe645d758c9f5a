"""A body in space driven by its own measured velocities: exact steps on SE(3)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError
from sequential.manifold import SE3, Manifold, Vector
from sequential.model import Functions, ProcessModel, as_params
from sequential.models.parts import find_part
from sequential.models.rotation import quaternion_exp, quaternion_product, right_jacobian, rotation

__all__ = ["DrivenPose"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DrivenPose(ProcessModel):
    """A pose that follows its twist, input u = (angular rate (3) rad/s, velocity (3) m/s), in body axes.

    Other parts of the state stand still, but for those that are forgotten.

    Parameters
    ----------
    density : (6,) or (6, 6) spectral density of the twist's white errors: rad²/s, then m²/s
    pose : name of the SE(3) part; the first one unless given
    bias : name of a vector part of six numbers that the measured twist is too large by
    forgotten : vector parts that are first-order Gauss-Markov processes: {name: (τ s, σ in the long run)}

    Notes
    -----
    x' = x Exp(u dt), so that F = Ad(Exp(-u dt)) and errors add on the right, in the chart of SE(3): what
    GTSAM's BetweenFactorPose3 says of the same step (Barfoot 2017, State estimation for robotics, 9.1;
    his errors are on the left).
    """

    density: ArrayLike
    pose: str | None = None
    bias: str | None = None
    forgotten: Mapping[str, tuple[float, ArrayLike]] = field(default_factory=dict)

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `ProcessModel.functions`."""
        storage, tangent, _ = find_part(manifold, (SE3,), self.pose, "DrivenPose")
        density = np.asarray(self.density, dtype=np.float64)
        density = np.diag(density) if density.shape == (6,) else density
        if density.shape != (6, 6) or not (np.linalg.eigvalsh(density) >= 0).all():
            msg = (
                "the density of a DrivenPose is six variances per second, or a positive semi-definite (6, 6) "
                f"matrix; got an array of shape {density.shape}"
            )
            raise ModelError(msg)
        at = (-1, -1)
        if self.bias is not None:
            at = vector_part(manifold, self.bias, 6)
        decays = [decay(manifold, name, *told) for name, told in self.forgotten.items()]
        params = as_params(storage, tangent, manifold.size, manifold.dim, density, at, len(decays), *decays)
        return Functions(step, jacobian, params, 6, noise, helpers=HELPERS)


def vector_part(manifold: Manifold, name: str, size: int | None = None) -> tuple[int, int]:
    """Storage and tangent start of a vector part by its name."""
    storage, tangent, part = find_part(manifold, (Vector,), name, "DrivenPose")
    if size is not None and part.size != size:
        msg = f"DrivenPose's part {name!r} has {part.size} numbers, {size} are needed"
        raise ModelError(msg)
    return storage, tangent


def decay(manifold: Manifold, name: str, time: float, sigma: ArrayLike) -> Array:
    """[storage, tangent, size, τ, variances …] of a part, padded to ten numbers."""
    storage, tangent = vector_part(manifold, name)
    size = find_part(manifold, (Vector,), name, "DrivenPose")[2].size
    spread = np.broadcast_to(np.asarray(sigma, dtype=np.float64), (size,))
    if not time > 0 or not (spread >= 0).all() or size > 6:
        msg = (
            f"a forgotten part of a DrivenPose has six numbers at most, a time constant above zero and σ "
            f"of zero or more; {name!r} has {size} numbers, {time} s and {spread.tolist()}"
        )
        raise ModelError(msg)
    row = np.zeros(10)
    row[:4] = storage, tangent, size, time
    row[4 : 4 + size] = spread**2
    return row


def bent(ax: float, ay: float, az: float, rx: float, ry: float, rz: float) -> tuple[float, float, float]:
    """Where a straight step r ends when the body turns by a on the way: V(a) r = Jr(-a) r."""
    g = right_jacobian(-ax, -ay, -az)
    return (
        g[0] * rx + g[1] * ry + g[2] * rz,
        g[3] * rx + g[4] * ry + g[5] * rz,
        g[6] * rx + g[7] * ry + g[8] * rz,
    )


def coefficients(square: float) -> tuple[float, float, float]:
    """Stumpff's c3, c4, c5 of a squared angle a²: (a - sin a)/a³, and so on."""
    if square < 1.0:
        c3, c4, c5 = 0.0, 0.0, 0.0
        term = 1.0 / 6.0
        for k in range(10):
            c3 += term
            term /= 4.0 + 2.0 * k
            c4 += term
            term /= 5.0 + 2.0 * k
            c5 += term
            term *= -square
        return c3, c4, c5
    angle = math.sqrt(square)
    c3 = (angle - math.sin(angle)) / (square * angle)
    c4 = (0.5 * square - 1.0 + math.cos(angle)) / (square * square)
    return c3, c4, (1.0 / 6.0 - c3) / square


def coupling(
    ax: float, ay: float, az: float, rx: float, ry: float, rz: float
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Rotation-to-translation block Q(a, r) of SE(3)'s left Jacobian, row by row (Barfoot 2017, eq. 7.86b).

    With s = a·r its products of skew matrices are s and |a|² times simpler ones.
    """
    square, s = ax * ax + ay * ay + az * az, ax * rx + ay * ry + az * rz
    c3, c4, c5 = coefficients(square)
    straight, turned = 0.5 - c4 * square, (2.0 * c4 - c3) * s
    x, y, z = straight * rx + turned * ax, straight * ry + turned * ay, straight * rz + turned * az
    f = (3.0 * c5 - c4) * s
    g = -2.0 * c3 * s - f * square
    xx, yy, zz = (
        g + ax * (2.0 * c3 * rx + f * ax),
        g + ay * (2.0 * c3 * ry + f * ay),
        g + az * (2.0 * c3 * rz + f * az),
    )
    xy, xz = c3 * (ax * ry + ay * rx) + f * ax * ay, c3 * (ax * rz + az * rx) + f * ax * az
    yz = c3 * (ay * rz + az * ry) + f * ay * az
    return xx, xy - z, xz + y, xy + z, yy, yz - x, xz - y, yz + x, zz


def moved(x: Any, u: Any, dt: float, p: Any) -> tuple[float, float, float, float, float, float]:
    """The twist without its bias, times dt."""
    if p[40] < 0.0:
        return u[0] * dt, u[1] * dt, u[2] * dt, u[3] * dt, u[4] * dt, u[5] * dt
    i = int(p[40])
    return (
        (u[0] - x[i]) * dt,
        (u[1] - x[i + 1]) * dt,
        (u[2] - x[i + 2]) * dt,
        (u[3] - x[i + 3]) * dt,
        (u[4] - x[i + 4]) * dt,
        (u[5] - x[i + 5]) * dt,
    )


def step(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Compose the pose with Exp(u dt); p = [storage, tangent, n, d, density (36), bias (2), decays…]."""
    at = int(p[0])
    for i in range(int(p[2])):
        out[i] = x[i]
    for k in range(int(p[42])):
        row = 43 + 10 * k
        kept = math.exp(-dt / p[row + 3])
        for i in range(int(p[row]), int(p[row] + p[row + 2])):
            out[i] = kept * x[i]
    a, b, c, l, m, n = moved(x, u, dt, p)
    gone = bent(a, b, c, l, m, n)
    r = rotation(x[at], x[at + 1], x[at + 2], x[at + 3])
    t = quaternion_exp(a, b, c)
    q = quaternion_product(x[at], x[at + 1], x[at + 2], x[at + 3], t[0], t[1], t[2], t[3])
    sign = math.copysign(1.0, q[0])
    for i in range(3):
        out[at + 4 + i] = x[at + 4 + i] + r[3 * i] * gone[0] + r[3 * i + 1] * gone[1] + r[3 * i + 2] * gone[2]
    for i in range(4):
        out[at + i] = sign * q[i]


def jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Ad(Exp(-u dt)) on the pose, identity elsewhere: [[Eᵀ, 0], [-Eᵀ [r]x, Eᵀ]]."""
    at, d = int(p[1]), int(p[3])
    for i in range(d * d):
        out[i] = 0.0
    for i in range(d):
        out[i * d + i] = 1.0
    for k in range(int(p[42])):
        row = 43 + 10 * k
        kept = math.exp(-dt / p[row + 3])
        for i in range(int(p[row + 1]), int(p[row + 1] + p[row + 2])):
            out[i * d + i] = kept
    a, b, c, l, m, n = moved(x, u, dt, p)
    gone = bent(a, b, c, l, m, n)
    t = quaternion_exp(a, b, c)
    e = rotation(t[0], t[1], t[2], t[3])
    cross = (0.0, -gone[2], gone[1], gone[2], 0.0, -gone[0], -gone[1], gone[0], 0.0)
    for i in range(3):
        for j in range(3):
            turned = e[i] * cross[j] + e[3 + i] * cross[3 + j] + e[6 + i] * cross[6 + j]
            out[(at + i) * d + at + j] = e[3 * j + i]
            out[(at + 3 + i) * d + at + j] = -turned
            out[(at + 3 + i) * d + at + 3 + j] = e[3 * j + i]
    if p[41] >= 0.0:
        own, corner = right_jacobian(a, b, c), coupling(-a, -b, -c, -l, -m, -n)
        column = int(p[41])
        for i in range(3):
            for j in range(3):
                out[(at + i) * d + column + j] = -dt * own[3 * i + j]
                out[(at + 3 + i) * d + column + j] = -dt * corner[3 * i + j]
                out[(at + 3 + i) * d + column + 3 + j] = -dt * own[3 * i + j]


def noise(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Add density·dt on the pose, and what forgotten parts gather."""
    at, d = int(p[1]), int(p[3])
    for i in range(6):
        for j in range(6):
            out[(at + i) * d + at + j] += p[4 + 6 * i + j] * dt
    for k in range(int(p[42])):
        row = 43 + 10 * k
        fresh = -math.expm1(-2.0 * dt / p[row + 3])
        for i in range(int(p[row + 2])):
            j = int(p[row + 1]) + i
            out[j * d + j] += fresh * p[row + 4 + i]


HELPERS = (rotation, quaternion_exp, quaternion_product, right_jacobian, bent, coefficients, coupling, moved)
