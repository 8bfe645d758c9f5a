"""A planar vehicle driven by its odometry: speed and turn rate."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from sequential.errors import ModelError
from sequential.manifold import SE2, Manifold
from sequential.model import Functions, ProcessModel, as_params
from sequential.models.parts import find_part

__all__ = ["Unicycle"]

STRAIGHT = 1e-6  # rad: below this turn, the series of the arc is exact to double precision


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
    pose : name of the SE(2) part; the first one unless given

    Notes
    -----
    All five add variances in proportion to dt, |v|dt or |ω|dt, so that a step may be cut in two without
    changing the result.  Tangent order (x, y, heading), right perturbations: GTSAM's Pose2.
    """

    along: float
    across: float
    heading: float
    slip: float = 0.0
    turn_slip: float = 0.0
    drift: float = 0.0
    pose: str | None = None

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `ProcessModel.functions`."""
        sigmas = (self.along, self.across, self.heading, self.slip, self.turn_slip, self.drift)
        if min(sigmas) < 0:
            msg = f"Unicycle's densities must be zero or more, got {sigmas}"
            raise ModelError(msg)
        storage, tangent, _ = find_part(manifold, (SE2,), self.pose, "Unicycle")
        params = as_params(storage, tangent, manifold.size, manifold.dim, [s * s for s in sigmas])
        return Functions(drive, drive_jacobian, params, 2, drive_noise, helpers=HELPERS)


def arc(u: Any, dt: float) -> tuple[float, float, float]:
    """Pose of the vehicle after dt in its own starting frame."""
    turn = u[1] * dt
    length = u[0] * dt
    if abs(turn) < STRAIGHT:
        return length * (1.0 - turn * turn / 6.0), length * turn / 2.0, turn
    return length * math.sin(turn) / turn, length * (1.0 - math.cos(turn)) / turn, turn


def drive(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Compose the pose with the arc; p = [storage, tangent, n, d, variances (6)]."""
    at = int(p[0])
    a, b, turn = arc(u, dt)
    c, s = math.cos(x[at + 2]), math.sin(x[at + 2])
    for i in range(int(p[2])):
        out[i] = x[i]
    out[at] = x[at] + c * a - s * b
    out[at + 1] = x[at + 1] + s * a + c * b
    heading = x[at + 2] + turn
    out[at + 2] = math.atan2(math.sin(heading), math.cos(heading))


def drive_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Adjoint of the inverse arc on the pose, identity elsewhere."""
    at, d = int(p[1]), int(p[3])
    a, b, turn = arc(u, dt)
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


def drive_noise(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Variances that grow with time, distance and angle."""
    at, d = int(p[1]), int(p[3])
    distance, angle = abs(u[0]) * dt, abs(u[1]) * dt
    out[at * d + at] += p[4] * dt + p[7] * distance
    out[(at + 1) * d + at + 1] += p[5] * dt
    out[(at + 2) * d + at + 2] += p[6] * dt + p[8] * angle + p[9] * distance


HELPERS = (arc,)
