"""Navigation state: attitude, position and velocity of a body that carries an inertial unit."""

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
from sequential.manifold.so3 import right_jacobian, skew

__all__ = ["NavState"]


@final
@dataclass(frozen=True, slots=True)
class NavState(Manifold):
    """Attitude, position, velocity: storage (qw, qx, qy, qz, p, v), tangent (rotation, position, velocity).

    Units are rad, m, m/s.  The chart is gtsam.NavState's, decoupled but in the body frame: with R the
    attitude before the step, ``R' = R Exp(dtheta)``, ``p' = p + R dp``, ``v' = v + R dv``.  Forster et al.
    2017, "On-manifold preintegration for real-time visual-inertial odometry", eq. 22 (its velocity step is
    in the world frame; GTSAM's and ours is not).
    """

    size = 10
    dim = 9

    def retract(self, x: Array, xi: Array) -> Array:
        """Move ``x`` (..., 10) by ``xi`` (..., 9)."""
        q = x[..., :4]
        attitude = quaternion_normalize(quaternion_multiply(q, quaternion_exp(xi[..., :3])))
        position = x[..., 4:7] + rotate(q, xi[..., 3:6])
        velocity = x[..., 7:] + rotate(q, xi[..., 6:])
        return np.concatenate([attitude, position, velocity], axis=-1)

    def local(self, x: Array, y: Array) -> Array:
        """Give the step (..., 9) from ``x`` to ``y``, its rotation of norm at most pi."""
        inverse = quaternion_inverse(x[..., :4])
        rotation = quaternion_log(quaternion_multiply(inverse, y[..., :4]))
        position = rotate(inverse, y[..., 4:7] - x[..., 4:7])
        velocity = rotate(inverse, y[..., 7:] - x[..., 7:])
        return np.concatenate([rotation, position, velocity], axis=-1)

    def transport(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Return T and Jinv, both (..., 9, 9).

        Notes
        -----
        With ``A = R_xᵀ R_y`` and e = (phi, yp, yv) = local(x, y): ``Jinv = diag(Jr(phi), Aᵀ, Aᵀ)`` and
        ``T = [[Aᵀ, 0, 0], [-Aᵀ skew(yp), Aᵀ, 0], [-Aᵀ skew(yv), 0, Aᵀ]]``, since a turn of ``x`` by d
        changes yp by ``skew(yp) d``.
        """
        e = self.local(x, y)
        back = rotation_matrix(quaternion_multiply(quaternion_inverse(y[..., :4]), x[..., :4]))
        inverse_jacobian = _block_diagonal(right_jacobian(e[..., :3]), back, back)
        carried = _block_diagonal(back, back, back)
        carried[..., 3:6, :3] = -back @ skew(e[..., 3:6])
        carried[..., 6:, :3] = -back @ skew(e[..., 6:])
        return carried, inverse_jacobian

    def identity(self) -> Array:
        """Give the body at rest at the origin, (10,)."""
        return np.array([1.0, *[0.0] * 9])

    def normalize(self, x: Array) -> Array:
        """Scale the quaternion of (..., 10) to unit norm, with ``qw >= 0``."""
        state = np.array(x, dtype=np.float64)
        state[..., :4] = quaternion_normalize(state[..., :4])
        return state

    def blocks(self) -> tuple[Block, ...]:
        """List the single block."""
        return (Block(Kind.NAV, 0, 0, 10, 9),)

    def labels(self) -> tuple[str, ...]:
        """Name rotation, position and velocity along the body axes."""
        return ("rx", "ry", "rz", "px", "py", "pz", "vx", "vy", "vz")


def _block_diagonal(a: Array, b: Array, c: Array) -> Array:
    """Fill a (..., 9, 9) matrix with three blocks (..., 3, 3) on its diagonal."""
    matrix = np.zeros((*a.shape[:-2], 9, 9))
    matrix[..., :3, :3], matrix[..., 3:6, 3:6], matrix[..., 6:, 6:] = a, b, c
    return matrix
