"""SO(3): an attitude, stored as a unit quaternion and moved by rotation vectors in the body frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from sequential.manifold.protocol import Array, Block, Kind, Manifold
from sequential.manifold.quaternion import (
    quaternion_exp,
    quaternion_from_matrix,
    quaternion_inverse,
    quaternion_log,
    quaternion_multiply,
    quaternion_normalize,
    rotate,
    rotation_matrix,
)
from sequential.manifold.stumpff import inverse_coefficient, stumpff

__all__ = [
    "SO3",
    "quaternion_exp",
    "quaternion_from_matrix",
    "quaternion_inverse",
    "quaternion_log",
    "quaternion_multiply",
    "quaternion_normalize",
    "right_jacobian",
    "right_jacobian_inverse",
    "rotate",
    "rotation_matrix",
    "skew",
]


def skew(v: Array) -> Array:
    """Give the matrices (..., 3, 3) with ``skew(v) @ u == cross(v, u)`` for ``v`` (..., 3)."""
    matrix = np.zeros((*v.shape, 3))
    matrix[..., 0, 1], matrix[..., 0, 2], matrix[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    matrix[..., 1, 0], matrix[..., 2, 0], matrix[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return matrix


def right_jacobian(phi: Array) -> Array:
    """Differentiate the exponential: ``Exp(phi + d) ≈ Exp(phi) Exp(Jr d)``.

    Parameters
    ----------
    phi : Array
        Rotation vectors (..., 3), rad.

    Returns
    -------
    Array
        Jr, (..., 3, 3).  Sola, Deray, Atchuthan 2018, eq. 143, with `stumpff` coefficients.
    """
    matrix, squared = skew(phi), np.sum(phi * phi, axis=-1)[..., None, None]
    return np.eye(3) - stumpff(2, squared) * matrix + stumpff(3, squared) * (matrix @ matrix)


def right_jacobian_inverse(phi: Array) -> Array:
    """Differentiate the logarithm: ``Log(Exp(phi) Exp(d)) ≈ phi + Jr⁻¹ d``.

    Parameters
    ----------
    phi : Array
        Rotation vectors (..., 3), rad, shorter than 2 pi, where the inverse ceases to exist.

    Returns
    -------
    Array
        Jr⁻¹, (..., 3, 3).  Sola, Deray, Atchuthan 2018, eq. 144, in a form regular at 0 and at pi.
    """
    matrix, squared = skew(phi), np.sum(phi * phi, axis=-1)[..., None, None]
    return np.eye(3) + 0.5 * matrix + inverse_coefficient(squared) * (matrix @ matrix)


@final
@dataclass(frozen=True, slots=True)
class SO3(Manifold):
    """Rotations of space: storage (qw, qx, qy, qz), tangent a rotation vector in rad.

    The chart is the right exponential, ``q * Exp(xi)``, as in gtsam.Rot3: the step is expressed in the
    body frame.  Sola, Deray, Atchuthan 2018, "A micro Lie theory for state estimation in robotics",
    appendix B.
    """

    size = 4
    dim = 3

    def retract(self, x: Array, xi: Array) -> Array:
        """Compose ``x`` (..., 4) with the exponential of ``xi`` (..., 3)."""
        return quaternion_normalize(quaternion_multiply(x, quaternion_exp(xi)))

    def local(self, x: Array, y: Array) -> Array:
        """Give ``Log(x⁻¹ y)`` (..., 3), of norm at most pi."""
        return quaternion_log(quaternion_multiply(quaternion_inverse(x), y))

    def transport(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Return ``T = R_yᵀ R_x`` and ``Jinv = Jr(local(x, y))``, both (..., 3, 3)."""
        y_q_x = quaternion_multiply(quaternion_inverse(y), x)
        return rotation_matrix(y_q_x), right_jacobian(-quaternion_log(y_q_x))

    def identity(self) -> Array:
        """Give the quaternion (1, 0, 0, 0)."""
        return np.array([1.0, 0.0, 0.0, 0.0])

    def normalize(self, x: Array) -> Array:
        """Scale (..., 4) to unit norm, with ``qw >= 0``."""
        return quaternion_normalize(np.asarray(x, dtype=np.float64))

    def blocks(self) -> tuple[Block, ...]:
        """List the single block."""
        return (Block(Kind.SO3, 0, 0, 4, 3),)

    def labels(self) -> tuple[str, ...]:
        """Name the rotations about the three body axes."""
        return ("rx", "ry", "rz")
