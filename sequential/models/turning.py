"""An attitude that its own gyro turns, with the gyro's bias: what a camera, a compass or gravity corrects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from sequential.manifold import SO3, Manifold, Product, Vector
from sequential.model import Functions, ProcessModel, as_params
from sequential.models.parts import find_part, named_vector, walk_variances
from sequential.models.rotation import quaternion_exp, quaternion_product, right_jacobian, rotation
from sequential.noise import ImuNoise

__all__ = ["GyroAttitude", "attitude_state"]


def attitude_state() -> Product:
    """The state that `GyroAttitude(bias="gyro_bias")` moves: 7 numbers, 6 tangent directions."""
    return Product(attitude=SO3(), gyro_bias=Vector(3))


@dataclass(frozen=True, eq=False)
class GyroAttitude(ProcessModel):
    """world_q_body turned by the angular rate; input u = gyro (3), rad/s; other parts stand still.

    Parameters
    ----------
    noise : of the gyro: `gyro_density` and `gyro_bias_walk`
    bias : name of a vector part of three numbers, rad/s, that the gyro reads too much; None for no bias
    attitude : name of the SO(3) part; the first unless given
    walks : of further parts, by name: random walk, unit/√s; parts without one stand still

    Notes
    -----
    q' = q ⊗ Exp((u - bias) dt): exact for a rate that is constant from sample to sample.
    """

    noise: ImuNoise
    bias: str | None = "gyro_bias"
    attitude: str | None = None
    walks: Mapping[str, ArrayLike] | None = None

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `ProcessModel.functions`."""
        storage, tangent, _ = find_part(manifold, (SO3,), self.attitude, "GyroAttitude")
        bias = named_vector(manifold, self.bias, 3, "GyroAttitude's bias")
        growth = walk_variances(manifold, self.walks, 0, "GyroAttitude").copy()
        growth[tangent : tangent + 3] = self.noise.gyro_density**2
        if bias[0]:
            growth[bias[2] : bias[2] + 3] = self.noise.gyro_bias_walk**2
        params = as_params(storage, tangent, manifold.size, manifold.dim, bias, growth)
        return Functions(turn, turn_jacobian, params, 3, turn_noise, helpers=HELPERS)


def angle(x: Any, u: Any, dt: float, p: Any) -> tuple[float, float, float]:
    """Rotation vector of a step."""
    a, b, c = u[0], u[1], u[2]
    if p[4] > 0.0:
        k = int(p[5])
        a, b, c = a - x[k], b - x[k + 1], c - x[k + 2]
    return a * dt, b * dt, c * dt


def turn(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """p = [storage, tangent, n, d, bias (1, storage, tangent), growth (d)]."""
    at = int(p[0])
    for i in range(int(p[2])):
        out[i] = x[i]
    a, b, c = angle(x, u, dt, p)
    e = quaternion_exp(a, b, c)
    q = quaternion_product(x[at], x[at + 1], x[at + 2], x[at + 3], e[0], e[1], e[2], e[3])
    out[at], out[at + 1], out[at + 2], out[at + 3] = q


def turn_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Exp(ω dt)ᵀ on the attitude, -dt Jr(ω dt) on the bias, the identity elsewhere."""
    t, d = int(p[1]), int(p[3])
    for i in range(d * d):
        out[i] = 0.0
    for i in range(d):
        out[i * d + i] = 1.0
    a, b, c = angle(x, u, dt, p)
    q = quaternion_exp(a, b, c)
    e, g = rotation(q[0], q[1], q[2], q[3]), right_jacobian(a, b, c)
    for i in range(3):
        for j in range(3):
            out[(t + i) * d + t + j] = e[3 * j + i]
            if p[4] > 0.0:
                out[(t + i) * d + int(p[6]) + j] = -dt * g[3 * i + j]


def turn_noise(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Variances that grow with time; isotropic on the attitude, and so the same in axes that turn."""
    d = int(p[3])
    for i in range(d):
        out[i * d + i] += dt * p[7 + i]


HELPERS = (quaternion_exp, quaternion_product, right_jacobian, rotation, angle)
