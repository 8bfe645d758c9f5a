"""The body of the marker filter: how it begins, and how the IMU carries it and its covariance on.

Errors are (turn in the body, place, velocity, accelerometer bias, gyro bias), place and velocity in the
world's axes; Solà 2017, "Quaternion kinematics for the error-state Kalman filter", section 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from factorlab.marker_map.inertial_start import start_inertial, upright
from sequential.manifold import (
    quaternion_exp,
    quaternion_multiply,
    quaternion_normalize,
    right_jacobian,
    rotate,
    rotation_matrix,
    skew,
)
from sequential.noise import ImuNoise
from vision3d.rigid import compose

if TYPE_CHECKING:
    from factorlab.graph.marker_inertial import Segment
    from factorlab.marker_map.mapping import Inertial

__all__ = ["Body", "propagated", "started"]

Array = NDArray[np.float64]
TILT_SIGMA = 0.03  # rad: gravity from a second of motion, with a bias of the accelerometer
SPEED_SIGMA = 0.15  # m/s
GRAVITY_GAP, GYRO_GAP = 0.5, 0.2  # m/s² and rad/s: beyond these the poses of a start contradict the IMU
GYRO_SIGMA = 0.02  # rad/s, of the bias that a second of turns tells
KNOWN_RAD, KNOWN_M = 1e-3, 1e-5
"""Heading and place are zero by definition, but tilts of a degree move the heading to second order."""


@dataclass(frozen=True, eq=False)
class Body:
    """world_T_body (7,), velocity (3,) in the world, biases (6,): accelerometer, gyro."""

    pose: Array
    velocity: Array
    bias: Array

    def moved(self, step: Array) -> Body:
        """Step by (15,)."""
        turned = quaternion_normalize(quaternion_multiply(self.pose[:4], quaternion_exp(step[:3])))
        pose = np.concatenate([turned, self.pose[4:] + step[3:6]])
        return Body(pose, self.velocity + step[6:9], self.bias + step[9:15])


def started(
    poses: Array, segments: Sequence[Segment | None], inertial: Inertial
) -> tuple[Body, Array] | None:
    """Level by a second of motion beside one marker; heading and place of the last frame are the origin.

    Parameters
    ----------
    poses : (K, 7) marker_T_body at K frames, `segments` (K-1) between them

    Returns
    -------
    tuple
        the body at the last of them, and its covariance (15, 15); None where gravity or the gyro's bias that
        poses and IMU imply together are not to be believed.

    Raises
    ------
    DataError
        where they share too little with the IMU.
    """
    first = start_inertial(poses, segments)
    unlike = abs(float(np.linalg.norm(first.gravity)) - inertial.gravity) > GRAVITY_GAP
    if unlike or float(np.linalg.norm(first.gyro_bias)) > GYRO_GAP:
        return None  # some of the poses are the other reading of their corners, or too far away to tell
    level = compose(upright(first.gravity), poses[-1])
    attitude = rotation_matrix(level[:4])
    heading = quaternion_exp(np.array([0.0, 0.0, -np.arctan2(attitude[1, 0], attitude[0, 0])]))
    pose = np.concatenate([quaternion_multiply(heading, level[:4]), np.zeros(3)])
    speed = rotate(heading, rotate(upright(first.gravity)[:4], first.velocities[-1]))
    up = rotation_matrix(pose[:4])[2]
    P = np.zeros((15, 15))
    P[:3, :3] = TILT_SIGMA**2 * (np.eye(3) - np.outer(up, up)) + KNOWN_RAD**2 * np.eye(3)
    P[3:6, 3:6] = KNOWN_M**2 * np.eye(3)
    P[6:9, 6:9] = SPEED_SIGMA**2 * np.eye(3)
    P[9:12, 9:12] = inertial.bias_sigmas[0] ** 2 * np.eye(3)
    P[12:, 12:] = GYRO_SIGMA**2 * np.eye(3)
    return Body(pose, speed, np.concatenate([np.zeros(3), first.gyro_bias])), P


def propagated(body: Body, P: Array, segment: Segment, inertial: Inertial) -> tuple[Body, Array]:
    """Carry the body and the joint covariance (15 + 6 M) over a segment."""
    noise, down = inertial.noise, np.array([0.0, 0.0, -inertial.gravity])
    forces = segment.turned(body.bias) - body.bias[:3]
    rates = segment.gyro - body.bias[3:]
    pose, velocity = body.pose, body.velocity
    through, Q = np.eye(15), np.zeros((15, 15))
    turns = rates * segment.dt[:, None]
    steps, back, bends = quaternion_exp(turns), rotation_matrix(quaternion_exp(-turns)), right_jacobian(turns)
    for force, dt, step, turn, bend in zip(forces, segment.dt.tolist(), steps, back, bends, strict=True):
        R = rotation_matrix(pose[:4])
        F = np.eye(15)
        F[:3, :3], F[:3, 12:] = turn, -dt * bend
        F[6:9, :3], F[6:9, 9:12] = -dt * R @ skew(force), -dt * R
        F[6:9, 12:] = -0.5 * dt * F[6:9, :3]  # the force is met half way through the turn
        F[3:6] = 0.5 * dt * F[6:9]
        F[3:6, 3:6], F[3:6, 6:9] = np.eye(3), dt * np.eye(3)
        through, Q = F @ through, F @ Q @ F.T
        _add_noise(Q, noise, dt)
        pushed = R @ force + down
        place = pose[4:] + velocity * dt + 0.5 * dt * dt * pushed
        velocity = velocity + dt * pushed
        pose = np.concatenate([quaternion_multiply(pose[:4], step), place])
    pose[:4] = quaternion_normalize(pose[:4])
    P = P.copy()
    P[:15] = through @ P[:15]
    P[:, :15] = P[:, :15] @ through.T
    P[:15, :15] += Q
    return Body(pose, velocity, body.bias), P


def _add_noise(Q: Array, noise: ImuNoise, dt: float) -> None:
    """White force and rate, and the walks of the biases, in place."""
    eye = np.arange(3)
    accel, gyro = noise.accel_density**2, noise.gyro_density**2
    Q[eye, eye] += gyro * dt
    Q[3 + eye, 3 + eye] += accel * dt**3 / 3.0
    Q[3 + eye, 6 + eye] += accel * dt**2 / 2.0
    Q[6 + eye, 3 + eye] += accel * dt**2 / 2.0
    Q[6 + eye, 6 + eye] += accel * dt
    Q[9 + eye, 9 + eye] += noise.accel_bias_walk**2 * dt
    Q[12 + eye, 12 + eye] += noise.gyro_bias_walk**2 * dt
