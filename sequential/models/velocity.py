"""Velocity in the world's axes, and the one that is known without a sensor: of a body that stands still."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from sequential.errors import ModelError
from sequential.log import Stream
from sequential.manifold import Manifold, NavState, Vector
from sequential.model import Functions, Loss, SensorModel, as_params
from sequential.models.parts import find_part
from sequential.models.rotation import rotation
from sequential.noise import require_covariance

if TYPE_CHECKING:
    from sequential.sensors.recording import ImuRecording
    from sequential.sensors.still import StillDetector

__all__ = ["Velocity", "ZeroVelocity", "still_velocity"]


@dataclass(frozen=True, eq=False)
class Velocity(SensorModel):
    """World velocity (3), m/s: Doppler of a GPS, motion capture.

    Parameters
    ----------
    noise_cov : (3, 3), (3,) variances or a number, m²/s², along the world's axes
    part : name of the navigation state, or of a vector part that is a world velocity; the first navigation
        state unless given
    """

    noise_cov: ArrayLike  # type: ignore[assignment]
    part: str | None = None
    gate: float | None = None
    loss: Loss | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "manifold", Vector(3))
        cov = require_covariance(self.noise_cov, 3, f"the noise_cov of a {type(self).__name__}")
        object.__setattr__(self, "noise_cov", cov)

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `SensorModel.functions`."""
        return world_velocity(manifold, self.part, "Velocity")


@dataclass(frozen=True, eq=False)
class ZeroVelocity(SensorModel):
    """A body that stands still (ZUPT): world velocity (3) whose readings are all zero, m/s.

    `still_velocity` makes the readings from an inertial recording.

    Parameters
    ----------
    noise_cov : (3, 3), (3,) variances or a number, m²/s²: how still the body is when it stands still
    part : as of `Velocity`
    """

    noise_cov: ArrayLike  # type: ignore[assignment]
    part: str | None = None
    gate: float | None = None
    loss: Loss | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "manifold", Vector(3))
        cov = require_covariance(self.noise_cov, 3, "the noise_cov of a ZeroVelocity")
        object.__setattr__(self, "noise_cov", cov)

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `SensorModel.functions`."""
        return world_velocity(manifold, self.part, "ZeroVelocity")


def world_velocity(manifold: Manifold, part: str | None, who: str) -> Functions:
    """Lowered: the last three numbers of a navigation state, or a vector part of three."""
    kinds = (NavState,) if part is None else (NavState, Vector)
    storage, tangent, member = find_part(manifold, kinds, part, who)
    if isinstance(member, Vector):
        if member.size != 3:
            raise ModelError(f"{who} reads a velocity of three numbers; the part {part!r} has {member.size}")
        params = as_params(storage, tangent, manifold.dim, -1)
    else:
        params = as_params(storage + 7, tangent + 6, manifold.dim, storage)
    return Functions(moving, moving_jacobian, params, helpers=HELPERS)


def moving(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """p = [storage of the velocity, tangent, d, storage of the quaternion or -1]."""
    for i in range(3):
        out[i] = x[int(p[0]) + i]


def moving_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """R on the velocity of a navigation state, whose steps are along the body's axes; else the identity."""
    t, d, q = int(p[1]), int(p[2]), int(p[3])
    for i in range(3 * d):
        out[i] = 0.0
    if q < 0:
        for i in range(3):
            out[i * d + t + i] = 1.0
        return
    r = rotation(x[q], x[q + 1], x[q + 2], x[q + 3])
    for i in range(3):
        for j in range(3):
            out[i * d + t + j] = r[3 * i + j]


HELPERS = (rotation,)


def still_velocity(
    recording: ImuRecording, detector: StillDetector | None = None, every: float = 0.1
) -> Stream:
    """Readings for a `ZeroVelocity` at the times at which an inertial recording is still.

    Parameters
    ----------
    detector : what counts as still
    every : s between readings of one dwell; neighbouring samples of one dwell say the same thing

    Raises
    ------
    MissingStreamError, DataError
        where stillness cannot be seen.
    """
    from sequential.sensors.still import StillDetector

    if not every > 0:
        raise ModelError(f"readings of a dwell are some time apart; got every = {every} s")
    dwells = (detector or StillDetector()).find(recording)
    chosen = []
    for rows in dwells:
        slot = np.floor((recording.seconds[rows] - recording.seconds[rows[0]]) / every + 1e-9)
        chosen.append(rows[np.flatnonzero(np.diff(slot, prepend=-1.0))])
    rows = np.concatenate(chosen) if chosen else np.zeros(0, dtype=np.int64)
    return Stream(recording.t[rows], np.zeros((len(rows), 3)))
