"""Poses (..., 7) put one after the other: neighbours cancel, ``compose(a_T_b, b_T_c)`` is ``a_T_c``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.manifold.quaternion import (
    quaternion_inverse,
    quaternion_multiply,
    quaternion_normalize,
    rotate,
)

__all__ = ["compose", "inverse", "transform"]

Array = NDArray[np.float64]


def compose(a_T_b: Array, b_T_c: Array) -> Array:
    """The pose a_T_c, (..., 7) qw qx qy qz px py pz."""
    attitude = quaternion_normalize(quaternion_multiply(a_T_b[..., :4], b_T_c[..., :4]))
    place = rotate(a_T_b[..., :4], b_T_c[..., 4:]) + a_T_b[..., 4:]
    return np.concatenate([attitude, place], axis=-1)


def inverse(a_T_b: Array) -> Array:
    """The pose b_T_a, (..., 7)."""
    attitude = quaternion_inverse(a_T_b[..., :4])
    return np.concatenate([attitude, -rotate(attitude, a_T_b[..., 4:])], axis=-1)


def transform(a_T_b: Array, points_b: Array) -> Array:
    """Points (N, 3) of frame b in frame a."""
    return rotate(a_T_b[..., :4], points_b) + a_T_b[..., 4:]
