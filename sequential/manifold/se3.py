"""SE(3): a pose in space, stored as a quaternion and a position and moved by the group exponential."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from sequential.manifold.protocol import Array, Block, Kind, Manifold
from sequential.manifold.quaternion import (
    quaternion_exp,
    quaternion_inverse,
    quaternion_log,
    quaternion_multiply,
    quaternion_normalize,
    rotate,
    rotation_matrix,
)
from sequential.manifold.so3 import right_jacobian, right_jacobian_inverse, skew
from sequential.manifold.stumpff import stumpff

__all__ = ["SE3"]


@final
@dataclass(frozen=True, slots=True)
class SE3(Manifold):
    """Poses in space: storage (qw, qx, qy, qz, px, py, pz), tangent (rotation, translation); rad, m.

    The chart is the right exponential, ``pose * Exp(xi)``, as in gtsam.Pose3, and both halves of the step
    are expressed in the body frame.  Sola, Deray, Atchuthan 2018, "A micro Lie theory for state
    estimation in robotics", eq. 172-180; note that they put the translation first.
    """

    size = 7
    dim = 6

    def retract(self, x: Array, xi: Array) -> Array:
        """Compose ``x`` (..., 7) with the exponential of ``xi`` (..., 6)."""
        phi, rho = xi[..., :3], xi[..., 3:]
        attitude = quaternion_normalize(quaternion_multiply(x[..., :4], quaternion_exp(phi)))
        # The left Jacobian of SO(3) bends the straight step rho into a screw: V(phi) = Jr(-phi).
        position = x[..., 4:] + rotate(x[..., :4], _apply(right_jacobian(-phi), rho))
        return np.concatenate([attitude, position], axis=-1)

    def local(self, x: Array, y: Array) -> Array:
        """Give ``Log(x⁻¹ y)`` (..., 6), its rotation of norm at most pi."""
        relative_q, relative_p = _relative(x, y)
        phi = quaternion_log(relative_q)
        return np.concatenate([phi, _apply(right_jacobian_inverse(-phi), relative_p)], axis=-1)

    def transport(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Return ``T = Ad(y⁻¹ x)`` and ``Jinv = Jr(local(x, y))``, both (..., 6, 6)."""
        e = self.local(x, y)
        jacobian = right_jacobian(e[..., :3])
        relative_q, relative_p = _relative(y, x)
        rotation = rotation_matrix(relative_q)
        adjoint = _lower_triangular(rotation, skew(relative_p) @ rotation)
        return adjoint, _lower_triangular(jacobian, _coupling(-e[..., :3], -e[..., 3:]))

    def identity(self) -> Array:
        """Give the origin, (1, 0, 0, 0, 0, 0, 0)."""
        return np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])

    def normalize(self, x: Array) -> Array:
        """Scale the quaternion of (..., 7) to unit norm, with ``qw >= 0``."""
        pose = np.array(x, dtype=np.float64)
        pose[..., :4] = quaternion_normalize(pose[..., :4])
        return pose

    def blocks(self) -> tuple[Block, ...]:
        """List the single block."""
        return (Block(Kind.SE3, 0, 0, 7, 6),)

    def labels(self) -> tuple[str, ...]:
        """Name the rotations about and the translations along the body axes."""
        return ("rx", "ry", "rz", "px", "py", "pz")


def _relative(a: Array, b: Array) -> tuple[Array, Array]:
    """Give ``a⁻¹ b`` as quaternion (..., 4) and position (..., 3)."""
    inverse = quaternion_inverse(a[..., :4])
    return quaternion_multiply(inverse, b[..., :4]), rotate(inverse, b[..., 4:] - a[..., 4:])


def _apply(matrix: Array, v: Array) -> Array:
    """Multiply matrices (..., 3, 3) by vectors (..., 3)."""
    product: Array = np.einsum("...ij,...j->...i", matrix, v)
    return product


def _coupling(phi: Array, rho: Array) -> Array:
    """Build the rotation-to-translation block Q (..., 3, 3) of the left Jacobian of SE(3).

    Notes
    -----
    Barfoot 2017, "State estimation for robotics", eq. 7.86b; Sola et al. 2018, eq. 180.  The textbook
    coefficients are c_3, c_4 and (c_4 - 3 c_5) / 2 of `stumpff`.  The right Jacobian has Q(-phi, -rho).
    """
    w, r = skew(phi), skew(rho)
    squared = np.sum(phi * phi, axis=-1)[..., None, None]
    c3, c4, c5 = (stumpff(k, squared) for k in (3, 4, 5))
    wr, rw, wrw, ww = w @ r, r @ w, w @ r @ w, w @ w
    first = c3 * (wr + rw + wrw)
    second = c4 * (ww @ r + r @ ww - 3.0 * wrw)
    third = 0.5 * (c4 - 3.0 * c5) * (wrw @ w + w @ wrw)
    return 0.5 * r + first + second + third


def _lower_triangular(diagonal: Array, corner: Array) -> Array:
    """Fill [[diagonal, 0], [corner, diagonal]], shape (..., 6, 6)."""
    matrix = np.zeros((*corner.shape[:-2], 6, 6))
    matrix[..., :3, :3] = matrix[..., 3:, 3:] = diagonal
    matrix[..., 3:, :3] = corner
    return matrix
