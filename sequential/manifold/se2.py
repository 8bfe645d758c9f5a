"""SE(2): a pose in the plane, stored as (x, y, theta) and moved by the group exponential."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from sequential.manifold.protocol import Array, Block, Kind, Manifold
from sequential.manifold.so2 import wrap_angle
from sequential.manifold.stumpff import half_cotangent, stumpff

__all__ = ["SE2"]


@final
@dataclass(frozen=True, slots=True)
class SE2(Manifold):
    """Poses in the plane: storage (x, y, theta), tangent (x, y, theta) in the body frame; m, m, rad.

    The chart is the right exponential, ``pose * Exp(xi)``, as in gtsam.Pose2: a step (x, 0, theta) drives
    along an arc.  Sola, Deray, Atchuthan 2018, "A micro Lie theory for state estimation in robotics",
    eq. 156-159 (exponential), 163 (right Jacobian).
    """

    size = 3
    dim = 3

    def retract(self, x: Array, xi: Array) -> Array:
        """Compose ``x`` (..., 3) with the exponential of ``xi`` (..., 3)."""
        angle = xi[..., 2]
        along, across = stumpff(1, angle * angle), angle * stumpff(2, angle * angle)
        step_x = along * xi[..., 0] - across * xi[..., 1]
        step_y = across * xi[..., 0] + along * xi[..., 1]
        moved_x, moved_y = _turn(x[..., 2], step_x, step_y)
        heading = wrap_angle(x[..., 2] + angle)
        return np.stack([x[..., 0] + moved_x, x[..., 1] + moved_y, heading], axis=-1)

    def local(self, x: Array, y: Array) -> Array:
        """Give ``Log(x⁻¹ y)`` (..., 3), its angle in ]-pi, pi]."""
        relative_x, relative_y, angle = _relative(x, y)
        along, across = half_cotangent(angle * angle), 0.5 * angle
        forward = along * relative_x + across * relative_y
        sideways = along * relative_y - across * relative_x
        return np.stack([forward, sideways, angle], axis=-1)

    def transport(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Return ``T = Ad(y⁻¹ x)`` and ``Jinv = Jr(local(x, y))``, both (..., 3, 3)."""
        return _adjoint(*_relative(y, x)), _right_jacobian(self.local(x, y))

    def identity(self) -> Array:
        """Give the origin (0, 0, 0)."""
        return np.zeros(3)

    def normalize(self, x: Array) -> Array:
        """Wrap the heading of (..., 3) into ]-pi, pi]."""
        pose = np.array(x, dtype=np.float64)
        pose[..., 2] = wrap_angle(pose[..., 2])
        return pose

    def blocks(self) -> tuple[Block, ...]:
        """List the single block."""
        return (Block(Kind.SE2, 0, 0, 3, 3),)

    def labels(self) -> tuple[str, ...]:
        """Name the three components."""
        return ("x", "y", "heading")


def _turn(angle: Array, x: Array, y: Array) -> tuple[Array, Array]:
    """Rotate the points (x, y) by ``angle``."""
    cos, sin = np.cos(angle), np.sin(angle)
    return cos * x - sin * y, sin * x + cos * y


def _relative(a: Array, b: Array) -> tuple[Array, Array, Array]:
    """Give ``a⁻¹ b`` as x, y and wrapped angle, each (...)."""
    x, y = _turn(-a[..., 2], b[..., 0] - a[..., 0], b[..., 1] - a[..., 1])
    return x, y, wrap_angle(b[..., 2] - a[..., 2])


def _adjoint(x: Array, y: Array, angle: Array) -> Array:
    """Build the adjoint (..., 3, 3) of the pose (x, y, angle).  Sola et al. 2018, eq. 160."""
    cos, sin = np.cos(angle), np.sin(angle)
    return _affine(cos, sin, y, -x)


def _right_jacobian(e: Array) -> Array:
    """Build the right Jacobian (..., 3, 3) at ``e`` (..., 3).  Sola et al. 2018, eq. 163."""
    angle = e[..., 2]
    squared = angle * angle
    c1, c2, c3 = (stumpff(k, squared) for k in (1, 2, 3))
    column_x = angle * c3 * e[..., 0] - c2 * e[..., 1]
    column_y = c2 * e[..., 0] + angle * c3 * e[..., 1]
    return _affine(c1, -angle * c2, column_x, column_y)


def _affine(cos: Array, sin: Array, column_x: Array, column_y: Array) -> Array:
    """Fill [[cos, -sin, column_x], [sin, cos, column_y], [0, 0, 1]], shape (..., 3, 3)."""
    matrix = np.zeros((*cos.shape, 3, 3))
    matrix[..., 0, 0], matrix[..., 0, 1], matrix[..., 0, 2] = cos, -sin, column_x
    matrix[..., 1, 0], matrix[..., 1, 1], matrix[..., 1, 2] = sin, cos, column_y
    matrix[..., 2, 2] = 1.0
    return matrix
