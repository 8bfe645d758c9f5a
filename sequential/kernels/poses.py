"""SE(2), SO(3) and SE(3) in scalars: exponentials, logarithms, Jacobians and adjoints."""

from __future__ import annotations

import math

import numpy as np
from numba import types
from numba.extending import register_jitable

from sequential.kernels.arrays import f0, i0, w2
from sequential.kernels.call import allocating, bare, bare_as
from sequential.models.rotation import right_jacobian

__all__ = [
    "se2_adjoint_inverse",
    "se2_exp",
    "se2_log",
    "se2_right_jacobian",
    "se3_exp",
    "se3_local",
    "se3_transport",
    "so3_local",
]

register_jitable(right_jacobian)

SMALL = 1e-4  # rad: the series below are exact to 1e-16 there
SERIES = 30  # terms: π³⁰/30! is 1e-18


@bare
def se2_exp(x, y, angle):
    """Translation of Exp(x, y, angle) (Solà et al. 2018, eq. 156-158)."""
    if abs(angle) < SMALL:
        a = 1.0 - angle * angle / 6.0
        b = 0.5 * angle
    else:
        a = math.sin(angle) / angle
        b = (1.0 - math.cos(angle)) / angle
    return a * x - b * y, b * x + a * y


@bare
def se2_log(x, y, angle):
    """Translational tangent of the pose (x, y, angle)."""
    half = 0.5 * angle
    a = 1.0 - angle * angle / 12.0 if abs(angle) < SMALL else half / math.tan(half)
    return a * x + half * y, a * y - half * x


@bare_as(types.void(f0, f0, f0, w2, i0))
def se2_adjoint_inverse(x, y, angle, out, at):
    """Ad(Exp(x, y, angle)⁻¹) into out[at:at+3, at:at+3]."""
    dx, dy = se2_exp(-x, -y, -angle)
    c, s = math.cos(angle), math.sin(angle)
    out[at, at], out[at, at + 1], out[at, at + 2] = c, s, dy
    out[at + 1, at], out[at + 1, at + 1], out[at + 1, at + 2] = -s, c, -dx
    out[at + 2, at], out[at + 2, at + 1], out[at + 2, at + 2] = 0.0, 0.0, 1.0


@bare_as(types.void(f0, f0, f0, w2, i0))
def se2_right_jacobian(x, y, angle, out, at):
    """Right Jacobian of SE(2) into out[at:at+3, at:at+3] (Solà et al. 2018, eq. 163)."""
    if abs(angle) < SMALL:
        a = 1.0 - angle * angle / 6.0
        b = 0.5 * angle
        f = angle / 6.0
        g = 0.5 - angle * angle / 24.0
    else:
        a = math.sin(angle) / angle
        b = (1.0 - math.cos(angle)) / angle
        f = (1.0 - a) / angle
        g = b / angle
    out[at, at], out[at, at + 1], out[at, at + 2] = a, b, x * f - y * g
    out[at + 1, at], out[at + 1, at + 1], out[at + 1, at + 2] = -b, a, x * g + y * f
    out[at + 2, at], out[at + 2, at + 1], out[at + 2, at + 2] = 0.0, 0.0, 1.0


@bare
def so3_local(w, x, y, z, a, b, c, d):
    """Rotation vector of conj(w, x, y, z) ⊗ (a, b, c, d), at most π long."""
    p = w * a + x * b + y * c + z * d
    q = w * b - x * a - y * d + z * c
    r = w * c + x * d - y * a - z * b
    s = w * d - x * c + y * b - z * a
    if p < 0.0:
        p, q, r, s = -p, -q, -r, -s
    length = math.sqrt(q * q + r * r + s * s)
    scale = (
        2.0 / p * (1.0 - length * length / (3.0 * p * p))
        if length < SMALL
        else 2.0 * math.atan2(length, p) / length
    )
    return scale * q, scale * r, scale * s


@bare
def se3_exp(a, b, c, x, y, z):
    """Translation V(ω) v of Exp(ω, v): V is the left Jacobian of SO(3)."""
    j = right_jacobian(-a, -b, -c)
    return (
        j[0] * x + j[1] * y + j[2] * z,
        j[3] * x + j[4] * y + j[5] * z,
        j[6] * x + j[7] * y + j[8] * z,
    )


@bare
def se3_local(a, b, c, x, y, z):
    """V(ω)⁻¹ p = p - ω × p / 2 + k ω × (ω × p)."""
    square = a * a + b * b + c * c
    if square < SMALL * SMALL:
        k = 1.0 / 12.0 + square / 720.0
    else:
        angle = math.sqrt(square)
        k = 1.0 / square - 0.5 / (angle * math.tan(0.5 * angle))
    u, v, w = b * z - c * y, c * x - a * z, a * y - b * x
    return (
        x - 0.5 * u + k * (b * w - c * v),
        y - 0.5 * v + k * (c * u - a * w),
        z - 0.5 * w + k * (a * v - b * u),
    )


@allocating
def se3_transport(e, t, turn, inverse):
    """Ad(Exp(e)⁻¹) and Jr(e) of SE(3) into the blocks at t: series of -ad(e) (Barfoot 2017, 7.36, 7.86)."""
    ad = np.zeros((6, 6))
    for at, k in ((0, 0), (3, 3)):
        skew_into(ad, at, k, e[t], e[t + 1], e[t + 2])
    skew_into(ad, 3, 0, e[t + 3], e[t + 4], e[t + 5])
    power = np.eye(6)
    for i in range(6):
        for j in range(6):
            turn[t + i, t + j] = power[i, j]
            inverse[t + i, t + j] = power[i, j]
    factorial = 1.0
    for term in range(1, SERIES):
        power = times(power, ad)
        factorial *= term
        for i in range(6):
            for j in range(6):
                turn[t + i, t + j] += power[i, j] / factorial
                inverse[t + i, t + j] += power[i, j] / (factorial * (term + 1))


@bare
def skew_into(out, row, column, x, y, z):
    """Cross-product matrix of (x, y, z) into a 3 x 3 block."""
    out[row, column + 1], out[row, column + 2] = -z, y
    out[row + 1, column], out[row + 1, column + 2] = z, -x
    out[row + 2, column], out[row + 2, column + 1] = -y, x


@allocating
def times(power, ad):
    """-power ad, 6 x 6, without a BLAS (which takes tens of seconds to compile against)."""
    out = np.zeros((6, 6))
    for i in range(6):
        for k in range(6):
            for j in range(6):
                out[i, j] -= power[i, k] * ad[k, j]
    return out
