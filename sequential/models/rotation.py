"""Rotations in scalars: what model functions call, in Python as well as compiled (tuples stay in registers).

`sequential.manifold.so3` has the same formulas for whole arrays.
"""

from __future__ import annotations

import math

__all__ = [
    "HELPERS",
    "quaternion_exp",
    "quaternion_product",
    "right_jacobian",
    "right_jacobian_inverse",
    "rotation",
    "rotation_vector",
    "turned",
    "turned_back",
]

SMALL = 1e-4  # below this angle (rad) the series is exact to 1e-16


def rotation(w: float, x: float, y: float, z: float) -> tuple[float, ...]:
    """Matrix of a unit quaternion, row by row."""
    return (
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    )


def turned(r: tuple[float, ...], a: float, b: float, c: float) -> tuple[float, float, float]:
    """R v, with the matrix R given row by row."""
    return (
        r[0] * a + r[1] * b + r[2] * c,
        r[3] * a + r[4] * b + r[5] * c,
        r[6] * a + r[7] * b + r[8] * c,
    )


def turned_back(r: tuple[float, ...], a: float, b: float, c: float) -> tuple[float, float, float]:
    """Rᵀ v, with the matrix R given row by row."""
    return (
        r[0] * a + r[3] * b + r[6] * c,
        r[1] * a + r[4] * b + r[7] * c,
        r[2] * a + r[5] * b + r[8] * c,
    )


def quaternion_exp(a: float, b: float, c: float) -> tuple[float, float, float, float]:
    """Unit quaternion of the rotation vector (a, b, c)."""
    square = a * a + b * b + c * c
    if square < SMALL * SMALL:
        w = 1.0 - square / 8.0
        s = 0.5 - square / 48.0
    else:
        angle = math.sqrt(square)
        w = math.cos(0.5 * angle)
        s = math.sin(0.5 * angle) / angle
    return w, s * a, s * b, s * c


def quaternion_product(
    w: float, x: float, y: float, z: float, a: float, b: float, c: float, d: float
) -> tuple[float, float, float, float]:
    """Hamilton product, made unit again so that rounding cannot accumulate over a long log."""
    p = w * a - x * b - y * c - z * d
    q = w * b + x * a + y * d - z * c
    r = w * c - x * d + y * a + z * b
    s = w * d + x * c - y * b + z * a
    scale = 1.0 / math.sqrt(p * p + q * q + r * r + s * s)
    return p * scale, q * scale, r * scale, s * scale


def right_jacobian(a: float, b: float, c: float) -> tuple[float, ...]:
    """Right Jacobian of SO(3) at the rotation vector (a, b, c), row by row (Solà et al. 2018, eq. 143)."""
    square = a * a + b * b + c * c
    if square < SMALL * SMALL:
        f = 0.5 - square / 24.0
        g = 1.0 / 6.0 - square / 120.0
    else:
        angle = math.sqrt(square)
        f = (1.0 - math.cos(angle)) / square
        g = (angle - math.sin(angle)) / (square * angle)
    return (
        1.0 - g * (b * b + c * c),
        f * c + g * a * b,
        -f * b + g * a * c,
        -f * c + g * a * b,
        1.0 - g * (a * a + c * c),
        f * a + g * b * c,
        f * b + g * a * c,
        -f * a + g * b * c,
        1.0 - g * (a * a + b * b),
    )


def right_jacobian_inverse(a: float, b: float, c: float) -> tuple[float, ...]:
    """Inverse of the right Jacobian of SO(3) at (a, b, c), row by row (Solà et al. 2018, eq. 144)."""
    square = a * a + b * b + c * c
    if square < SMALL * SMALL:
        g = 1.0 / 12.0 + square / 720.0
    else:
        half = 0.5 * math.sqrt(square)
        g = (1.0 - half * math.cos(half) / math.sin(half)) / square
    return (
        1.0 - g * (b * b + c * c),
        -0.5 * c + g * a * b,
        0.5 * b + g * a * c,
        0.5 * c + g * a * b,
        1.0 - g * (a * a + c * c),
        -0.5 * a + g * b * c,
        -0.5 * b + g * a * c,
        0.5 * a + g * b * c,
        1.0 - g * (a * a + b * b),
    )


def rotation_vector(w: float, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Rotation vector of a unit quaternion, at most π long."""
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    s = math.sqrt(x * x + y * y + z * z)
    k = 2.0 if s < SMALL * SMALL else 2.0 * math.atan2(s, w) / s
    return k * x, k * y, k * z


HELPERS = (rotation, quaternion_exp, quaternion_product, right_jacobian)
