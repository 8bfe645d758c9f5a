"""Unit quaternions (w, x, y, z), Hamilton: composition, exponential, logarithm, rotation of vectors.

``q`` stands for ``a_R_b``: it turns coordinates in frame b into coordinates in frame a.  Leading axes
broadcast in every function.  Sola 2017, "Quaternion kinematics for the error-state Kalman filter", is the
source of the conventions.
"""

from __future__ import annotations

import numpy as np

from sequential.manifold.protocol import Array
from sequential.manifold.stumpff import stumpff

__all__ = [
    "quaternion_exp",
    "quaternion_from_matrix",
    "quaternion_inverse",
    "quaternion_log",
    "quaternion_multiply",
    "quaternion_normalize",
    "rotate",
    "rotation_matrix",
]

LOG_SERIES_BELOW = 1e-10
"""Squared tangent of the half angle under which the logarithm is a series, its next term under 1e-20."""


def quaternion_multiply(p: Array, q: Array) -> Array:
    """Compose two rotations: ``a_R_c = a_R_b * b_R_c``, all (..., 4).  Sola 2017, eq. 12."""
    pw, px, py, pz = (p[..., i] for i in range(4))
    qw, qx, qy, qz = (q[..., i] for i in range(4))
    w = pw * qw - px * qx - py * qy - pz * qz
    x = pw * qx + px * qw + py * qz - pz * qy
    y = pw * qy - px * qz + py * qw + pz * qx
    z = pw * qz + px * qy - py * qx + pz * qw
    return np.stack([w, x, y, z], axis=-1)


def quaternion_inverse(q: Array) -> Array:
    """Invert a unit quaternion (..., 4): its conjugate."""
    return np.concatenate([q[..., :1], -q[..., 1:]], axis=-1)


def quaternion_normalize(q: Array) -> Array:
    """Scale (..., 4) to unit norm and choose, of the two signs that mean one rotation, ``w >= 0``."""
    sign = np.where(q[..., :1] < 0.0, -1.0, 1.0)
    norm: Array = np.linalg.norm(q, axis=-1, keepdims=True)
    return q * (sign / norm)


def quaternion_exp(phi: Array) -> Array:
    """Turn a rotation vector into a quaternion.

    Parameters
    ----------
    phi : Array
        Rotation vectors (..., 3), rad.

    Returns
    -------
    Array
        Unit quaternions (..., 4); ``w`` is negative for angles between pi and 3 pi.  Sola 2017, eq. 101.
    """
    quarter = 0.25 * np.sum(phi * phi, axis=-1, keepdims=True)
    return np.concatenate([np.cos(np.sqrt(quarter)), 0.5 * stumpff(1, quarter) * phi], axis=-1)


def quaternion_log(q: Array) -> Array:
    """Turn a quaternion into the shortest rotation vector.

    Parameters
    ----------
    q : Array
        Quaternions (..., 4); the result does not depend on their norm or sign.

    Returns
    -------
    Array
        Rotation vectors (..., 3), rad, of norm at most pi.  Sola 2017, eq. 103-105, where ``atan2`` keeps
        full accuracy near pi and a series takes over near 0.
    """
    w = np.abs(q[..., :1])
    vector = np.where(q[..., :1] < 0.0, -1.0, 1.0) * q[..., 1:]
    squared = np.sum(vector * vector, axis=-1, keepdims=True)
    small = squared < LOG_SERIES_BELOW * w * w
    norm = np.sqrt(np.where(small, 1.0, squared))
    closed = 2.0 * np.arctan2(norm, w) / norm
    safe = np.where(small, w, 1.0)
    series = 2.0 / safe * (1.0 - squared / (3.0 * safe * safe))
    return np.where(small, series, closed) * vector


def rotate(q: Array, v: Array) -> Array:
    """Rotate vectors: ``a_v = a_R_b b_v`` for unit ``q`` (..., 4) and ``v`` (..., 3); returns (..., 3)."""
    w, axis = q[..., :1], q[..., 1:]
    twice = 2.0 * _cross(axis, v)
    return v + w * twice + _cross(axis, twice)


def rotation_matrix(q: Array) -> Array:
    """Give the matrices (..., 3, 3) of unit quaternions (..., 4).  Sola 2017, eq. 115."""
    w, x, y, z = (q[..., i] for i in range(4))
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_from_matrix(matrix: Array) -> Array:
    """Give the unit quaternions (..., 4), ``w >= 0``, of rotation matrices (..., 3, 3).

    Notes
    -----
    The entries of R determine the outer product ``4 q qᵀ``; every row of it is a multiple of q, and the
    one with the largest diagonal entry (at least 1) is free of cancellation.  Shepperd 1978, "Quaternion
    from rotation matrix", chooses his square root by the same rule.
    """
    outer = _outer_product(matrix)
    best = np.argmax(np.diagonal(outer, axis1=-2, axis2=-1), axis=-1)
    row = np.take_along_axis(outer, best[..., None, None], axis=-2)
    return quaternion_normalize(row[..., 0, :])


def _outer_product(matrix: Array) -> Array:
    """Build ``4 q qᵀ`` (..., 4, 4) from rotation matrices (..., 3, 3)."""
    (a, b, c), (d, e, f), (g, h, i) = ([matrix[..., j, k] for k in range(3)] for j in range(3))
    rows = [
        [1.0 + a + e + i, h - f, c - g, d - b],
        [h - f, 1.0 + a - e - i, b + d, c + g],
        [c - g, b + d, 1.0 - a + e - i, f + h],
        [d - b, c + g, f + h, 1.0 - a - e + i],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _cross(a: Array, b: Array) -> Array:
    """Multiply vectors (..., 3); several times faster than ``np.cross`` on small arrays."""
    (ax, ay, az), (bx, by, bz) = (a[..., i] for i in range(3)), (b[..., i] for i in range(3))
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)
