"""A smooth rotation over time: cumulative B-spline on SO(3), its rate, and how both change.

Sommer, Usenko, Schubert, Demmel, Cremers 2020, "Efficient derivative computation for cumulative B-splines on
Lie groups": time derivatives and Jacobians by a recursion that is linear in the order.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sequential.manifold.quaternion import quaternion_exp, rotation_matrix
from sequential.manifold.so3 import SO3, right_jacobian, right_jacobian_inverse, skew
from vision3d.inertial.basis import cumulative_weights

__all__ = ["Turning", "turning", "turning_only"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class Turning(NamedTuple):
    """A rotation spline at N times, `order` control values each.

    R : (N, 3, 3), board_R_body
    rate : (N, 3) rad/s in the body's axes
    d_R, d_rate : (N, order, 3, 3), of R (right chart) and of the rate by the right charts of the controls
    """

    R: Array
    rate: Array
    d_R: Array
    d_rate: Array


def turning(controls: Array, first: Integers, u: Array, step_s: Array, order: int) -> Turning:
    """Evaluate with Jacobians.

    Parameters
    ----------
    controls : (K, 4) quaternions
    first : (N,) the first of the `order` controls that act at each time
    u : (N,) local time within the interval of knots
    step_s : (N,) between knots, there
    """
    count = len(u)
    steps = SO3().local(controls[:-1], controls[1:])
    ahead = right_jacobian_inverse(steps)[first[:, None] + np.arange(order - 1)]  # d_j by its later end
    behind = -np.swapaxes(ahead, -1, -2)  # and by its earlier one: Jl⁻¹ = Jr⁻ᵀ
    parts, share, speed = _parts(steps, first, u, step_s, order)
    rate = np.zeros((count, 3))
    by_step = np.empty((count, order - 1, 3, 3))
    by_step_rate = np.empty_like(by_step)
    eye = np.eye(3)
    for j in range(order - 1):
        own = steps[first + j]
        turned = np.einsum("nji,nj->ni", parts[:, j], rate)
        jacobian = share[:, j, None, None] * right_jacobian(share[:, j, None] * own)
        by_step[:, j] = jacobian
        by_step_rate[:, j] = speed[:, j, None, None] * eye + skew(turned) @ jacobian
        rate = turned + speed[:, j, None] * own
    after = np.broadcast_to(eye, (count, 3, 3))
    for j in range(order - 2, -1, -1):
        back = np.swapaxes(after, -1, -2)
        by_step[:, j], by_step_rate[:, j] = back @ by_step[:, j], back @ by_step_rate[:, j]
        after = parts[:, j] @ after
    d_R, d_rate = np.zeros((count, order, 3, 3)), np.zeros((count, order, 3, 3))
    d_R[:, 0] = np.swapaxes(after, -1, -2)
    for out, one in ((d_R, by_step), (d_rate, by_step_rate)):
        out[:, :-1] += one @ behind
        out[:, 1:] += one @ ahead
    return Turning(rotation_matrix(controls[first]) @ after, rate, d_R, d_rate)


def turning_only(
    controls: Array, first: Integers, u: Array, step_s: Array, order: int
) -> tuple[Array, Array]:
    """R (N, 3, 3) and rate (N, 3) without Jacobians."""
    steps = SO3().local(controls[:-1], controls[1:])
    parts, _, speed = _parts(steps, first, u, step_s, order)
    R, rate = rotation_matrix(controls[first]), np.zeros((len(u), 3))
    for j in range(order - 1):
        R = R @ parts[:, j]
        rate = np.einsum("nji,nj->ni", parts[:, j], rate) + speed[:, j, None] * steps[first + j]
    return R, rate


def _parts(steps: Array, first: Integers, u: Array, step_s: Array, order: int) -> tuple[Array, Array, Array]:
    """Rotation (N, order - 1, 3, 3) of every step as far as it is done, that share, its change a second."""
    share = cumulative_weights(order, u)
    speed = cumulative_weights(order, u, 1) / step_s[:, None]
    chosen = steps[first[:, None] + np.arange(order - 1)]
    return rotation_matrix(quaternion_exp(share[..., None] * chosen)), share, speed
