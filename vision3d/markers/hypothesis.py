"""Hypotheses of where markers are and how they move: prediction, and the update by a reading of a picture.

Many markers are followed at once, so all functions take H hypotheses in one batch.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.manifold import SE3
from sequential.manifold.quaternion import quaternion_exp, rotation_matrix
from sequential.manifold.so3 import skew

__all__ = ["POSES", "Hypotheses", "MarkerMotion", "born", "predicted", "updated"]

Array = NDArray[np.float64]
POSES = SE3()
FURTHEST = 1.4  # rad: charts of hypotheses and readings further apart no longer fit, and neither do they


@dataclass(frozen=True, slots=True)
class MarkerMotion:
    """How a marker may move against the camera between pictures.

    Parameters
    ----------
    turning, moving : white accelerations, rad/s² and m/s² per root hertz; the defaults are of a hand
    walk : True takes the velocity for zero and `turning`, `moving` for rad/√s and m/√s: things that rest
    start_turning, start_moving : standard deviation of the velocity of a marker just found, rad/s and m/s
    coasting_s : time in which the velocity of a marker that is not seen dies away
    """

    turning: float = 4.0
    moving: float = 1.0
    walk: bool = False
    start_turning: float = 1.0
    start_moving: float = 0.5
    coasting_s: float = 0.5

    def __post_init__(self) -> None:
        for name in ("turning", "moving", "start_turning", "start_moving", "coasting_s"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise ModelError(f"{name} of the motion of markers is a positive number, got {value}")

    @property
    def noise(self) -> Array:
        """(6,) spectral densities of the tangent."""
        return np.repeat([self.turning, self.moving], 3) ** 2


@dataclass(frozen=True, slots=True, eq=False)
class Hypotheses:
    """Poses (H, 7), velocities (H, 6) in the marker's axes, covariances (H, 12, 12), log weights (H,)."""

    pose: Array
    velocity: Array
    cov: Array
    log_weight: Array

    def __len__(self) -> int:
        return len(self.pose)

    def take(self, rows: NDArray[np.intp] | list[int]) -> Hypotheses:
        """Some of them."""
        return Hypotheses(self.pose[rows], self.velocity[rows], self.cov[rows], self.log_weight[rows])

    def weighing(self, log_weight: Array) -> Hypotheses:
        """The same with other weights."""
        return Hypotheses(self.pose, self.velocity, self.cov, log_weight)

    @staticmethod
    def joined(parts: list[Hypotheses]) -> Hypotheses:
        """One batch of several."""
        fields = ("pose", "velocity", "cov", "log_weight")
        return Hypotheses(*(np.concatenate([getattr(one, name) for one in parts]) for name in fields))


def born(pose: Array, cov: Array, log_weight: Array, motion: MarkerMotion) -> Hypotheses:
    """Markers just found: their velocity is anything plausible."""
    whole = np.zeros((len(pose), 12, 12))
    whole[:, :6, :6] = cov
    start = np.repeat([motion.start_turning, motion.start_moving], 3) * (0.0 if motion.walk else 1.0)
    whole[:, 6:, 6:] = np.diag(start**2)
    return Hypotheses(pose, np.zeros((len(pose), 6)), whole, log_weight)


def predicted(
    given: Hypotheses, dt: Array, motion: MarkerMotion, *, seen: bool | NDArray[np.bool_]
) -> Hypotheses:
    """Where they are `dt` (H,) seconds later; without pictures the velocity dies away."""
    dt = np.asarray(dt, dtype=np.float64)[:, None, None]
    noise = np.diag(motion.noise)
    if motion.walk:
        cov = given.cov.copy()
        cov[:, :6, :6] += noise * dt
        return Hypotheses(given.pose, given.velocity, cov, given.log_weight)
    step = given.velocity * dt[:, 0]
    keep = np.where(np.asarray(seen)[..., None, None], 1.0, np.exp(-dt / motion.coasting_s))
    F = np.zeros((len(given), 12, 12))
    F[:, :6, :6] = _adjoint_of_inverse(step)
    F[:, :6, 6:] = dt * np.eye(6)
    F[:, 6:, 6:] = keep * np.eye(6)
    cov = F @ given.cov @ F.transpose(0, 2, 1)
    cov[:, :6, :6] += noise * dt**3 / 3.0
    cov[:, :6, 6:] += noise * dt**2 / 2.0
    cov[:, 6:, :6] += noise * dt**2 / 2.0
    cov[:, 6:, 6:] += noise * dt
    return Hypotheses(POSES.retract(given.pose, step), keep[:, 0] * given.velocity, cov, given.log_weight)


def updated(given: Hypotheses, pose: Array, cov: Array, log_evidence: Array) -> Hypotheses:
    """The product of each with a reading (pose (H, 7), cov (H, 6, 6)), weighed by how well they agree."""
    step = POSES.local(given.pose, pose)
    carry = _adjoint_of_inverse(-step)
    S = given.cov[:, :6, :6] + carry @ cov @ carry.transpose(0, 2, 1)
    factor = np.linalg.cholesky(S)
    white = np.linalg.solve(factor, np.concatenate([step[:, :, None], given.cov[:, :6]], axis=2))
    agreement = -0.5 * np.sum(white[:, :, 0] ** 2, axis=1)
    agreement -= np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1)
    gain = white[:, :, 1:].transpose(0, 2, 1)
    move = (gain @ white[:, :, :1])[:, :, 0]
    rest = given.cov - gain @ white[:, :, 1:]
    weight = given.log_weight + log_evidence + agreement
    weight[np.linalg.norm(step[:, :3], axis=1) > FURTHEST] = -np.inf
    return Hypotheses(
        POSES.retract(given.pose, move[:, :6]), given.velocity + move[:, 6:],
        0.5 * (rest + rest.transpose(0, 2, 1)), weight,
    )  # fmt: skip


def _adjoint_of_inverse(step: Array) -> Array:
    """Ad(Exp(-step)) (H, 6, 6) to first order in translation: how tangent vectors look after the step."""
    R = rotation_matrix(quaternion_exp(-step[:, :3]))
    matrix = np.zeros((len(step), 6, 6))
    matrix[:, :3, :3] = matrix[:, 3:, 3:] = R
    matrix[:, 3:, :3] = skew(-step[:, 3:]) @ R
    return matrix
