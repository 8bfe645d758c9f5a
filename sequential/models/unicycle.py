"""A planar vehicle driven by its odometry: speed and turn rate."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from sequential.errors import ModelError
from sequential.manifold import SE2, Manifold, Vector
from sequential.model import Functions, ProcessModel, as_params
from sequential.models.parts import find_part, walk_variances

__all__ = ["Unicycle"]

STRAIGHT = 1e-3  # rad: below this turn the series are exact to 1e-13, and the closed forms lose digits


@dataclass(frozen=True, eq=False)
class Unicycle(ProcessModel):
    """Exact circular arcs on SE(2), input u = (speed m/s, turn rate rad/s); other parts stand still.

    Parameters
    ----------
    along, across : spectral densities' square roots, m/√s: what the wheels do not say
    heading : rad/√s
    slip : m/√m, error along the track that grows with the distance driven
    turn_slip : rad/√rad, heading error that grows with the angle turned
    drift : rad/√m, heading error that grows with the distance driven
    scale : name of a vector part of two numbers, the shares by which speed and turn rate are really larger
        than the wheels say: u is taken as ((1 + scale[0]) u[0], (1 + scale[1]) u[1])
    pose : name of the SE(2) part; the first one unless given
    walks : of further parts of the state, by name: random walk, unit/√s; parts without one stand still

    Notes
    -----
    The noise terms add variances in proportion to dt, |v|dt or |ω|dt, so that a step may be cut in two
    without changing the result.  Tangent order (x, y, heading), right perturbations: GTSAM's Pose2.
    """

    along: float
    across: float
    heading: float
    slip: float = 0.0
    turn_slip: float = 0.0
    drift: float = 0.0
    scale: str | None = None
    pose: str | None = None
    walks: Mapping[str, ArrayLike] | None = None

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `ProcessModel.functions`."""
        sigmas = (self.along, self.across, self.heading, self.slip, self.turn_slip, self.drift)
        if min(sigmas) < 0:
            msg = f"Unicycle's densities must be zero or more, got {sigmas}"
            raise ModelError(msg)
        storage, tangent, _ = find_part(manifold, (SE2,), self.pose, "Unicycle")
        scale = (0, 0, 0)
        if self.scale is not None:
            s_storage, s_tangent, part = find_part(manifold, (Vector,), self.scale, "Unicycle's scale")
            if part.size != 2:
                msg = f"Unicycle's scale {self.scale!r} has {part.size} numbers; 2, for speed and turn rate"
                raise ModelError(msg)
            scale = (1, s_storage, s_tangent)
        variances = [s * s for s in sigmas]
        others = walk_variances(manifold, self.walks, 0, "Unicycle")
        if others[tangent : tangent + 3].any():
            msg = "Unicycle moves the pose itself; its noise is along, across and heading"
            raise ModelError(msg)
        walking = (1.0, others) if others.any() else (0.0,)
        params = as_params(storage, tangent, manifold.size, manifold.dim, variances, scale, *walking)
        return Functions(drive, drive_jacobian, params, 2, drive_noise, helpers=HELPERS)


def travel(x: Any, u: Any, dt: float, p: Any) -> tuple[float, float]:
    """Length and angle of the arc, as the scales have it."""
    length, turn = u[0] * dt, u[1] * dt
    if p[10] > 0.0:
        length *= 1.0 + x[int(p[11])]
        turn *= 1.0 + x[int(p[11]) + 1]
    return length, turn


def arc(length: float, turn: float) -> tuple[float, float]:
    """Where the vehicle stands after an arc, in its own starting frame."""
    if abs(turn) < STRAIGHT:
        square = turn * turn
        return length * (1.0 - square / 6.0), length * turn * (0.5 - square / 24.0)
    return length * math.sin(turn) / turn, length * (1.0 - math.cos(turn)) / turn


def drive(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Compose the pose with the arc; p = [storage, tangent, n, d, variances (6), scale (3), walks (d)]."""
    at = int(p[0])
    length, turn = travel(x, u, dt, p)
    a, b = arc(length, turn)
    c, s = math.cos(x[at + 2]), math.sin(x[at + 2])
    for i in range(int(p[2])):
        out[i] = x[i]
    out[at] = x[at] + c * a - s * b
    out[at + 1] = x[at + 1] + s * a + c * b
    heading = x[at + 2] + turn
    out[at + 2] = math.atan2(math.sin(heading), math.cos(heading))


def drive_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Adjoint of the inverse arc on the pose, identity elsewhere; right Jacobian of the arc on the scales."""
    at, d = int(p[1]), int(p[3])
    length, turn = travel(x, u, dt, p)
    a, b = arc(length, turn)
    c, s = math.cos(turn), math.sin(turn)
    for i in range(d * d):
        out[i] = 0.0
    for i in range(d):
        out[i * d + i] = 1.0
    row = at * d + at
    out[row] = c
    out[row + 1] = s
    out[row + 2] = s * a - c * b
    out[row + d] = -s
    out[row + d + 1] = c
    out[row + d + 2] = c * a + s * b
    if p[10] > 0.0:
        column = at * d + int(p[12])
        along, across = arc(u[0] * dt, turn)
        out[column], out[column + d] = along, -across
        bend, lead = bent(turn)
        angle = u[1] * dt
        out[column + 1] = bend * length * angle
        out[column + d + 1] = lead * length * angle
        out[column + 2 * d + 1] = angle


def bent(turn: float) -> tuple[float, float]:
    """(θ - sin θ) / θ² and (1 - cos θ) / θ²: how an arc's end answers to its angle, along the end's axes."""
    square = turn * turn
    if abs(turn) < STRAIGHT:
        return turn / 6.0, 0.5 - square / 24.0
    return (turn - math.sin(turn)) / square, (1.0 - math.cos(turn)) / square


def drive_noise(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Variances that grow with time, distance and angle."""
    at, d = int(p[1]), int(p[3])
    distance, angle = abs(u[0]) * dt, abs(u[1]) * dt
    out[at * d + at] += p[4] * dt + p[7] * distance
    out[(at + 1) * d + at + 1] += p[5] * dt
    out[(at + 2) * d + at + 2] += p[6] * dt + p[8] * angle + p[9] * distance
    if p[13] > 0.0:
        for i in range(d):
            out[i * d + i] += p[14 + i] * dt


HELPERS = (travel, arc, bent)
