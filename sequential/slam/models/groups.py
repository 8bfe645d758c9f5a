"""Composing, inverting and relating states of the manifolds that are groups, many at once."""

from __future__ import annotations

import numpy as np

from sequential.errors import ModelError
from sequential.manifold import (
    SE2,
    SE3,
    SO2,
    SO3,
    Array,
    Manifold,
    Vector,
    quaternion_inverse,
    quaternion_multiply,
    quaternion_normalize,
    rotate,
    wrap_angle,
)

__all__ = ["between", "compose", "inverse", "require_group"]


def require_group(manifold: Manifold, who: str) -> None:
    """Refuse a manifold whose states cannot be put one after the other; raises `ModelError`."""
    if not isinstance(manifold, SE2 | SE3 | SO2 | SO3 | Vector):
        msg = f"{who} is declared on SE2(), SE3(), SO2(), SO3() or Vector(n); got {manifold!r}"
        raise ModelError(msg)


def compose(manifold: Manifold, a: Array, b: Array) -> Array:
    """``a b`` of states (..., n): for poses ``world_T_a`` and ``a_T_b`` it is ``world_T_b``."""
    if isinstance(manifold, SE2):
        cos, sin = np.cos(a[..., 2]), np.sin(a[..., 2])
        x = a[..., 0] + cos * b[..., 0] - sin * b[..., 1]
        y = a[..., 1] + sin * b[..., 0] + cos * b[..., 1]
        return np.stack([x, y, wrap_angle(a[..., 2] + b[..., 2])], axis=-1)
    if isinstance(manifold, SE3):
        attitude = quaternion_normalize(quaternion_multiply(a[..., :4], b[..., :4]))
        return np.concatenate([attitude, a[..., 4:] + rotate(a[..., :4], b[..., 4:])], axis=-1)
    if isinstance(manifold, SO3):
        return quaternion_normalize(quaternion_multiply(a, b))
    return manifold.normalize(a + b)


def inverse(manifold: Manifold, a: Array) -> Array:
    """``a⁻¹`` of states (..., n)."""
    if isinstance(manifold, SE2):
        cos, sin = np.cos(a[..., 2]), np.sin(a[..., 2])
        x, y = -cos * a[..., 0] - sin * a[..., 1], sin * a[..., 0] - cos * a[..., 1]
        return np.stack([x, y, wrap_angle(-a[..., 2])], axis=-1)
    if isinstance(manifold, SE3):
        attitude = quaternion_inverse(a[..., :4])
        return np.concatenate([attitude, -rotate(attitude, a[..., 4:])], axis=-1)
    if isinstance(manifold, SO3):
        return quaternion_inverse(a)
    return manifold.normalize(-a)


def between(manifold: Manifold, a: Array, b: Array) -> Array:
    """``a⁻¹ b`` of states (..., n): what has to be done at a to come to b."""
    if isinstance(manifold, SE2):
        cos, sin = np.cos(a[..., 2]), np.sin(a[..., 2])
        east, north = b[..., 0] - a[..., 0], b[..., 1] - a[..., 1]
        turn = wrap_angle(b[..., 2] - a[..., 2])
        return np.stack([cos * east + sin * north, cos * north - sin * east, turn], axis=-1)
    if isinstance(manifold, SE3):
        back = quaternion_inverse(a[..., :4])
        attitude = quaternion_normalize(quaternion_multiply(back, b[..., :4]))
        return np.concatenate([attitude, rotate(back, b[..., 4:] - a[..., 4:])], axis=-1)
    if isinstance(manifold, SO3):
        return quaternion_normalize(quaternion_multiply(quaternion_inverse(a), b))
    return manifold.normalize(b - a)
