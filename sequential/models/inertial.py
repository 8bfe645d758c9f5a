"""Strapdown inertial navigation with accelerometer and gyro biases: 15 error states, GTSAM's chart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from sequential.errors import ModelError
from sequential.manifold import Manifold, NavState, Product, Vector
from sequential.model import Functions, ProcessModel, as_params
from sequential.models.parts import walk_variances
from sequential.models.rotation import HELPERS as ROTATIONS
from sequential.models.rotation import quaternion_exp, quaternion_product, right_jacobian, rotation
from sequential.noise import ImuNoise

__all__ = ["Strapdown", "inertial_state"]


def inertial_state() -> Product:
    """The state that `Strapdown` moves: 16 numbers, 15 tangent directions."""
    return Product(nav=NavState(), accel_bias=Vector(3), gyro_bias=Vector(3))


@dataclass(frozen=True, eq=False)
class Strapdown(ProcessModel):
    """Integrate specific force and angular rate; input u = (accelerometer (3) m/s², gyro (3) rad/s).

    Parameters
    ----------
    noise : densities of the sensor
    gravity : world-frame gravity, m/s²; z up unless you say otherwise
    walks : of further parts of the state (a barometer's bias, a scale), by name: random walk, unit/√s;
        parts without one stand still

    Notes
    -----
    First order in dt, as GTSAM's preintegration is, so that filter and graph share one model:
    R' = R Exp(ω dt), p' = p + v dt + ½ (R a + g) dt², v' = v + (R a + g) dt, with a and ω free of bias
    (Forster et al. 2017, eq. 33-37).
    """

    noise: ImuNoise
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    walks: Mapping[str, ArrayLike] | None = None

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `ProcessModel.functions`."""
        parts = list(manifold.parts.values()) if isinstance(manifold, Product) else []
        if parts[:3] != [NavState(), Vector(3), Vector(3)]:
            msg = f"Strapdown needs a state that begins as inertial_state() does; the state is {manifold}"
            raise ModelError(msg)
        n = self.noise
        sigmas = (n.accel_density, n.gyro_density, n.accel_bias_walk, n.gyro_bias_walk, n.integration_density)
        variances = [s * s for s in sigmas]
        others = walk_variances(manifold, self.walks, 15, "Strapdown")
        params = as_params(manifold.size, manifold.dim, self.gravity, variances, others)
        if manifold.dim == 15:
            return Functions(step, jacobian, params, 6, noise, advance, carry, HELPERS)
        return Functions(step, jacobian, params, 6, noise, helpers=HELPERS)


def step(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """One sample; p = [n, d, gravity (3), variances (5), walks (d)]."""
    for i in range(10, int(p[0])):
        out[i] = x[i]
    a, b, c = u[0] - x[10], u[1] - x[11], u[2] - x[12]
    r = rotation(x[0], x[1], x[2], x[3])
    half = 0.5 * dt * dt
    for i in range(3):
        force = r[3 * i] * a + r[3 * i + 1] * b + r[3 * i + 2] * c + p[2 + i]
        out[4 + i] = x[4 + i] + x[7 + i] * dt + half * force
        out[7 + i] = x[7 + i] + dt * force
    t = quaternion_exp((u[3] - x[13]) * dt, (u[4] - x[14]) * dt, (u[5] - x[15]) * dt)
    q = quaternion_product(x[0], x[1], x[2], x[3], t[0], t[1], t[2], t[3])
    out[0], out[1], out[2], out[3] = q[0], q[1], q[2], q[3]


def jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """(d, d): every block of the navigation rows carries the transposed turn Exp(ω dt)ᵀ."""
    d = int(p[1])
    for i in range(d * d):
        out[i] = 0.0
    for i in range(9, d):
        out[i * d + i] = 1.0
    wx, wy, wz = (u[3] - x[13]) * dt, (u[4] - x[14]) * dt, (u[5] - x[15]) * dt
    t = quaternion_exp(wx, wy, wz)
    e = rotation(t[0], t[1], t[2], t[3])
    g = right_jacobian(wx, wy, wz)
    a, b, c = u[0] - x[10], u[1] - x[11], u[2] - x[12]
    cross = (0.0, -c, b, c, 0.0, -a, -b, a, 0.0)
    for i in range(3):
        for j in range(3):
            turn = e[3 * j + i]
            tilt = e[i] * cross[j] + e[3 + i] * cross[3 + j] + e[6 + i] * cross[6 + j]
            out[i * d + j] = turn
            out[i * d + 12 + j] = -dt * g[3 * i + j]
            out[(3 + i) * d + j] = -0.5 * dt * dt * tilt
            out[(3 + i) * d + 3 + j] = turn
            out[(3 + i) * d + 6 + j] = dt * turn
            out[(3 + i) * d + 9 + j] = -0.5 * dt * dt * turn
            out[(6 + i) * d + j] = -dt * tilt
            out[(6 + i) * d + 6 + j] = turn
            out[(6 + i) * d + 9 + j] = -dt * turn


def noise(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """White force, white rate, integration error and bias walks.

    All are isotropic, and so stay the same in axes that turn: no rotation is needed.
    """
    d = int(p[1])
    for i in range(3):
        out[i * d + i] += dt * p[6]
        at, speed = 3 + i, 6 + i
        out[at * d + at] += 0.25 * dt * dt * dt * p[5] + dt * p[9]
        out[at * d + speed] += 0.5 * dt * dt * p[5]
        out[speed * d + at] += 0.5 * dt * dt * p[5]
        out[speed * d + speed] += dt * p[5]
        out[(9 + i) * d + 9 + i] += dt * p[7]
        out[(12 + i) * d + 12 + i] += dt * p[8]
    for i in range(15, d):
        out[i * d + i] += dt * p[10 + i]


def push(wx: float, wy: float, wz: float, a: float, b: float, c: float, dt: float, out: Any, at: int) -> None:
    """M <- F M for the 15 x 15 matrix at out[at:], by blocks.

    All navigation rows share the factor Exp(ω dt)ᵀ, so each column is sheared first and turned after.
    """
    t = quaternion_exp(wx, wy, wz)
    e = rotation(t[0], t[1], t[2], t[3])
    g = right_jacobian(wx, wy, wz)
    half = 0.5 * dt
    for j in range(15):
        k = at + j
        t0, t1, t2 = out[k], out[k + 15], out[k + 30]
        p0, p1, p2 = out[k + 45], out[k + 60], out[k + 75]
        v0, v1, v2 = out[k + 90], out[k + 105], out[k + 120]
        f0 = -dt * (b * t2 - c * t1 + out[k + 135])
        f1 = -dt * (c * t0 - a * t2 + out[k + 150])
        f2 = -dt * (a * t1 - b * t0 + out[k + 165])
        p0 += dt * v0 + half * f0
        p1 += dt * v1 + half * f1
        p2 += dt * v2 + half * f2
        v0 += f0
        v1 += f1
        v2 += f2
        w0, w1, w2 = dt * out[k + 180], dt * out[k + 195], dt * out[k + 210]
        out[k] = e[0] * t0 + e[3] * t1 + e[6] * t2 - (g[0] * w0 + g[1] * w1 + g[2] * w2)
        out[k + 15] = e[1] * t0 + e[4] * t1 + e[7] * t2 - (g[3] * w0 + g[4] * w1 + g[5] * w2)
        out[k + 30] = e[2] * t0 + e[5] * t1 + e[8] * t2 - (g[6] * w0 + g[7] * w1 + g[8] * w2)
        out[k + 45] = e[0] * p0 + e[3] * p1 + e[6] * p2
        out[k + 60] = e[1] * p0 + e[4] * p1 + e[7] * p2
        out[k + 75] = e[2] * p0 + e[5] * p1 + e[8] * p2
        out[k + 90] = e[0] * v0 + e[3] * v1 + e[6] * v2
        out[k + 105] = e[1] * v0 + e[4] * v1 + e[7] * v2
        out[k + 120] = e[2] * v0 + e[5] * v1 + e[8] * v2


def transpose(out: Any, at: int) -> None:
    """Swap rows and columns of the 15 x 15 matrix at out[at:]."""
    for i in range(15):
        for j in range(i):
            k, m = at + i * 15 + j, at + j * 15 + i
            out[k], out[m] = out[m], out[k]


def carry(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Φ <- F Φ for the transition at `out` (15 x 15)."""
    wx, wy, wz = (u[3] - x[13]) * dt, (u[4] - x[14]) * dt, (u[5] - x[15]) * dt
    push(wx, wy, wz, u[0] - x[10], u[1] - x[11], u[2] - x[12], dt, out, 0)


def advance(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Mean and covariance in place: P <- F (F P)ᵀ + Q, then the step.  `out` is [mean (16) | P (225)]."""
    wx, wy, wz = (u[3] - x[13]) * dt, (u[4] - x[14]) * dt, (u[5] - x[15]) * dt
    a, b, c = u[0] - x[10], u[1] - x[11], u[2] - x[12]
    push(wx, wy, wz, a, b, c, dt, out, 16)
    transpose(out, 16)
    push(wx, wy, wz, a, b, c, dt, out, 16)
    for i in range(3):
        out[16 + i * 15 + i] += dt * p[6]
        at, cross = 16 + (3 + i) * 15 + 3 + i, 0.5 * dt * dt * p[5]
        out[at] += 0.25 * dt * dt * dt * p[5] + dt * p[9]
        out[at + 3] += cross
        out[at + 45] += cross
        out[at + 48] += dt * p[5]
        out[16 + (9 + i) * 15 + 9 + i] += dt * p[7]
        out[16 + (12 + i) * 15 + 12 + i] += dt * p[8]
    step(x, u, dt, p, out)


HELPERS = (*ROTATIONS, push, transpose, step)
