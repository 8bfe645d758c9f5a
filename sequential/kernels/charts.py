"""Retract, local and transport of product manifolds, compiled: one row of the table is one block.

The same formulas as `sequential.manifold`, in scalars; the tests hold the two against each other.
A row is (kind, storage start, tangent start, storage size, tangent size), with the kinds of `Kind`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types
from numba.extending import register_jitable

from sequential.kernels.arrays import f0, f1, i0, i2, w1, w2
from sequential.kernels.call import bare, bare_as, inlined_as
from sequential.kernels.poses import (
    se2_adjoint_inverse,
    se2_exp,
    se2_log,
    se2_right_jacobian,
    se3_exp,
    se3_local,
    se3_transport,
    so3_local,
)
from sequential.models.rotation import quaternion_exp, quaternion_product, right_jacobian, rotation

__all__ = ["local", "retract", "transport"]

for helper in (rotation, quaternion_exp, quaternion_product, right_jacobian):
    register_jitable(helper)

VECTOR, SO2, SO3, SE2, SE3, NAV = range(6)
TURN, TURN_REST = 6.2831853069365025, 2.430840202602477e-10  # 2π; the first part has 31 bits
FAR = 1e6  # rad: up to here multiples of it are exact


@bare_as(f0(f0))
def unwind(angle):
    """Angle in ]-π, π] of one that is not there."""
    if not abs(angle) < FAR:
        return math.atan2(math.sin(angle), math.cos(angle))
    turns = np.floor(angle * (0.5 / math.pi) + 0.5)
    left = (angle - turns * TURN) - turns * TURN_REST
    if left > math.pi:
        left -= 2.0 * math.pi
    elif left <= -math.pi:
        left += 2.0 * math.pi
    return left


@inlined_as(f0(f0))
def wrap(angle):
    """Angle in ]-π, π]; one that is there already stays as it is, to the last bit."""
    return angle if -math.pi < angle <= math.pi else unwind(angle)


@bare_as(types.void(i2, i0, i0, f1, i0, f1, i0, w1, i0))
def retract(table, first, last, x, x_at, xi, xi_at, out, out_at):
    """out = x ⊕ xi over the blocks first:last, arrays flat from their offsets; out may be x."""
    for b in range(first, last):
        kind = table[b, 0]
        s, t, o = x_at + table[b, 1], xi_at + table[b, 2], out_at + table[b, 1]
        if kind == VECTOR:
            for i in range(table[b, 3]):
                out[o + i] = x[s + i] + xi[t + i]
        elif kind == SO2:
            out[o] = wrap(x[s] + xi[t])
        elif kind == SE2:
            dx, dy = se2_exp(xi[t], xi[t + 1], xi[t + 2])
            c, n = math.cos(x[s + 2]), math.sin(x[s + 2])
            px, py, angle = x[s], x[s + 1], x[s + 2]
            out[o] = px + c * dx - n * dy
            out[o + 1] = py + n * dx + c * dy
            out[o + 2] = wrap(angle + xi[t + 2])
        else:
            w, a, bb, cc = x[s], x[s + 1], x[s + 2], x[s + 3]
            e = quaternion_exp(xi[t], xi[t + 1], xi[t + 2])
            q = quaternion_product(w, a, bb, cc, e[0], e[1], e[2], e[3])
            out[o], out[o + 1], out[o + 2], out[o + 3] = q[0], q[1], q[2], q[3]
            if kind == SO3:
                continue
            r = rotation(w, a, bb, cc)
            if kind == SE3:
                v = se3_exp(xi[t], xi[t + 1], xi[t + 2], xi[t + 3], xi[t + 4], xi[t + 5])
                for i in range(3):
                    turned = r[3 * i] * v[0] + r[3 * i + 1] * v[1] + r[3 * i + 2] * v[2]
                    out[o + 4 + i] = x[s + 4 + i] + turned
            else:
                for i in range(3):
                    for at in (3, 6):
                        k = t + at
                        turned = r[3 * i] * xi[k] + r[3 * i + 1] * xi[k + 1] + r[3 * i + 2] * xi[k + 2]
                        out[o + 1 + at + i] = x[s + 1 + at + i] + turned


@bare_as(types.void(i2, i0, i0, f1, i0, f1, i0, w1, i0))
def local(table, first, last, x, x_at, y, y_at, out, out_at):
    """out = the tangent vector at x that leads to y."""
    for b in range(first, last):
        kind = table[b, 0]
        s, k, o = x_at + table[b, 1], y_at + table[b, 1], out_at + table[b, 2]
        if kind == VECTOR:
            for i in range(table[b, 3]):
                out[o + i] = y[k + i] - x[s + i]
        elif kind == SO2:
            out[o] = wrap(y[k] - x[s])
        elif kind == SE2:
            c, n = math.cos(x[s + 2]), math.sin(x[s + 2])
            dx, dy = y[k] - x[s], y[k + 1] - x[s + 1]
            angle = wrap(y[k + 2] - x[s + 2])
            v = se2_log(c * dx + n * dy, c * dy - n * dx, angle)
            out[o], out[o + 1], out[o + 2] = v[0], v[1], angle
        else:
            e = so3_local(x[s], x[s + 1], x[s + 2], x[s + 3], y[k], y[k + 1], y[k + 2], y[k + 3])
            out[o], out[o + 1], out[o + 2] = e[0], e[1], e[2]
            if kind == SO3:
                continue
            r = rotation(x[s], x[s + 1], x[s + 2], x[s + 3])
            for at in range(4, table[b, 3], 3):
                a, bb, cc = (
                    y[k + at] - x[s + at],
                    y[k + at + 1] - x[s + at + 1],
                    y[k + at + 2] - x[s + at + 2],
                )
                for i in range(3):
                    out[o + at - 1 + i] = r[i] * a + r[3 + i] * bb + r[6 + i] * cc
            if kind == SE3:
                v = se3_local(e[0], e[1], e[2], out[o + 3], out[o + 4], out[o + 5])
                out[o + 3], out[o + 4], out[o + 5] = v[0], v[1], v[2]


@bare
def nav_transport(a, e, t, turn, inverse):
    """Position and velocity blocks: Aᵀ, and -Aᵀ [e]x from the rotation, with Aᵀ given row by row."""
    for at in (3, 6):
        p, q, r = e[t + at], e[t + at + 1], e[t + at + 2]
        for i in range(3):
            u, v, w = a[3 * i], a[3 * i + 1], a[3 * i + 2]
            turn[t + at + i, t] = -(v * r - w * q)
            turn[t + at + i, t + 1] = -(w * p - u * r)
            turn[t + at + i, t + 2] = -(u * q - v * p)
            for k in range(3):
                turn[t + at + i, t + at + k] = a[3 * i + k]
                inverse[t + at + i, t + at + k] = a[3 * i + k]


@bare_as(types.void(i2, i0, i0, f1, i0, f1, i0, w1, w2, w2))
def transport(table, blocks, d, x, x_at, y, y_at, e, turn, inverse):
    """Linearise e = local(x, y): `inverse` = (∂e/∂y)⁻¹ and `turn` = -(∂e/∂y)⁻¹ ∂e/∂x, both (d, d)."""
    local(table, 0, blocks, x, x_at, y, y_at, e, 0)
    for i in range(d):
        for j in range(d):
            turn[i, j] = 0.0
            inverse[i, j] = 0.0
    for b in range(blocks):
        kind, t = table[b, 0], table[b, 2]
        if kind == VECTOR or kind == SO2:  # noqa: PLR1714, SIM109 - a set would be built at run time
            for i in range(table[b, 4]):
                turn[t + i, t + i] = 1.0
                inverse[t + i, t + i] = 1.0
        elif kind == SE2:
            se2_adjoint_inverse(e[t], e[t + 1], e[t + 2], turn, t)
            se2_right_jacobian(e[t], e[t + 1], e[t + 2], inverse, t)
        else:
            j = right_jacobian(e[t], e[t + 1], e[t + 2])
            q = quaternion_exp(-e[t], -e[t + 1], -e[t + 2])
            a = rotation(q[0], q[1], q[2], q[3])
            for i in range(3):
                for k in range(3):
                    turn[t + i, t + k] = a[3 * i + k]
                    inverse[t + i, t + k] = j[3 * i + k]
            if kind == SE3:
                se3_transport(e, t, turn, inverse)
            elif kind == NAV:
                nav_transport(a, e, t, turn, inverse)
