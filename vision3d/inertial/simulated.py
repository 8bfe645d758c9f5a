"""A camera and an IMU carried past a board, from a motion that is known exactly.

The motion is a sum of sines: position, velocity, acceleration, rotation and rate are closed formulas, so that
the readings owe nothing to a spline or an integration.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sequential.manifold.quaternion import (
    quaternion_exp,
    quaternion_multiply,
    quaternion_normalize,
    rotate,
    rotation_matrix,
)
from sequential.manifold.so3 import right_jacobian
from sequential.noise import ImuNoise
from vision3d.boards import Board, Checkerboard
from vision3d.camera import Camera
from vision3d.inertial.problem import Corners, Imu
from vision3d.rigid import compose, inverse

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["CAMERA", "Carried", "Rig", "Waves", "project_corners", "read_imu", "render_frames"]

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
GRAVITY = 9.80665
CAMERA = Camera("brown4", (458.2, 457.6, 323.4, 236.8), (-0.201, 0.047, 0.0006, -0.0004), (640, 480))


@dataclass(frozen=True)
class Rig:
    """What is to be found: the truth of a calibration.

    Parameters
    ----------
    camera : with its intrinsics
    camera_T_imu : (7,)
    time_offset_s : IMU clock less camera clock
    gyro_bias, accel_bias : (3,) rad/s, m/s²
    gyro_matrix, accel_matrix : (3, 3)
    noise : of the IMU; biases walk
    """

    camera: Camera = CAMERA
    camera_T_imu: Array = field(default_factory=lambda: _mount((0.10, -0.06, 1.52), (0.031, -0.018, 0.012)))
    time_offset_s: float = 0.0137
    gyro_bias: tuple[float, float, float] = (0.011, -0.017, 0.008)
    accel_bias: tuple[float, float, float] = (0.11, -0.07, 0.16)
    gyro_matrix: Array = field(default_factory=lambda: np.eye(3))
    accel_matrix: Array = field(default_factory=lambda: np.eye(3))
    noise: ImuNoise = ImuNoise(1.6e-4, 2.0e-3, 2.0e-5, 3.0e-4)  # noqa: RUF009 - frozen


def _mount(turn: tuple[float, float, float], shift: tuple[float, float, float]) -> Array:
    return np.concatenate([quaternion_exp(np.array(turn)), shift])


@dataclass(frozen=True, eq=False)
class Waves:
    """Sums of sines in three axes: amplitude (n, 3), rate (n, 3) rad/s, phase (n, 3)."""

    amplitude: Array
    rate: Array
    phase: Array

    def at(self, t: Array, derivative: int = 0) -> Array:
        """(N, 3) at times (N,), or a derivative by time."""
        angle = self.rate * t[:, None, None] + self.phase + 0.5 * np.pi * derivative
        return np.asarray(np.sum(self.amplitude * self.rate**derivative * np.sin(angle), axis=1))


@dataclass(frozen=True, eq=False)
class Carried:
    """A motion of the IMU in front of a board.

    Parameters
    ----------
    start : (7,) board_T_imu about which it moves
    turns : rotation vector in the body, rad
    shifts : in the board's frame, m
    gravity : (3,) in the board's frame, m/s²
    """

    start: Array
    turns: Waves
    shifts: Waves
    gravity: Array

    @staticmethod
    def random(
        rng: np.random.Generator,
        rig: Rig,
        board: Board,
        *,
        turn_rad: Sequence[float] = (0.30, 0.30, 0.45),
        shift_m: Sequence[float] = (0.10, 0.10, 0.10),
        fill: float = 0.45,
    ) -> Carried:
        """A hand that turns and shifts the rig about every axis, the board in view.

        Parameters
        ----------
        turn_rad, shift_m : amplitudes about and along the camera's axes; 0 leaves a motion out
        fill : extent of the board's diagonal, as a share of the image's, in the middle of the motion
        """
        points = board.points
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
        focal = float(np.mean(rig.camera.intrinsics[:2]))
        distance = focal * diagonal / (fill * float(np.linalg.norm(rig.camera.size)))
        tilt = quaternion_exp(rng.uniform(-0.15, 0.15, 3))
        camera_T_board = np.concatenate([tilt, [0.0, 0.0, distance] - rotate(tilt, middle)])
        start = compose(inverse(camera_T_board), rig.camera_T_imu)
        board_R_camera = rotation_matrix(inverse(camera_T_board)[:4])
        imu_R_camera = rotation_matrix(rig.camera_T_imu[:4]).T
        turns = _waves(rng, np.asarray(turn_rad), 3, (0.25, 1.1))
        down = np.array([0.0, 1.0, 0.0]) + rng.normal(0.0, 0.08, 3)  # a board on a wall
        shifts = _waves(rng, np.asarray(shift_m), 3, (0.3, 1.3))
        return Carried(
            start, _Turned(turns.amplitude, turns.rate, turns.phase, imu_R_camera),
            _Turned(shifts.amplitude, shifts.rate, shifts.phase, board_R_camera),
            GRAVITY * down / np.linalg.norm(down),
        )  # fmt: skip

    def pose(self, t: Array) -> Array:
        """board_T_imu (N, 7) at true times (N,) s."""
        turned = quaternion_multiply(self.start[:4], quaternion_exp(self.turns.at(t)))
        return np.hstack([quaternion_normalize(turned), self.start[4:] + self.shifts.at(t)])

    def rate(self, t: Array) -> Array:
        """(N, 3) rad/s in the body."""
        jacobian = right_jacobian(self.turns.at(t))
        return np.asarray(np.einsum("nij,nj->ni", jacobian, self.turns.at(t, 1)))

    def specific_force(self, t: Array) -> Array:
        """(N, 3) m/s² in the body."""
        q = self.pose(t)[:, :4].copy()
        q[:, 1:] *= -1.0
        return rotate(q, self.shifts.at(t, 2) - self.gravity)


@dataclass(frozen=True, eq=False)
class _Turned(Waves):
    """Waves about axes of another frame."""

    R: Array = field(default_factory=lambda: np.eye(3))

    def at(self, t: Array, derivative: int = 0) -> Array:
        """Waves in the frame that R leads to."""
        return np.asarray(Waves.at(self, t, derivative) @ self.R.T)


def _waves(rng: np.random.Generator, reach: Array, count: int, band_hz: tuple[float, float]) -> Waves:
    """Sines whose amplitudes in each axis add up to about `reach`."""
    share = rng.dirichlet(np.full(count, 4.0), 3).T
    rate = 2.0 * np.pi * rng.uniform(*band_hz, (count, 3))
    return Waves(share * reach, rate, rng.uniform(0.0, 2.0 * np.pi, (count, 3)))


def read_imu(
    motion: Carried, rig: Rig, seconds: float, rate_hz: float, rng: np.random.Generator
) -> tuple[Imu, Array, Array]:
    """Readings of the IMU, stamped by its own clock, and its biases (N, 3) as they walked."""
    t = np.arange(0.0, seconds, 1.0 / rate_hz)
    step = 1.0 / rate_hz
    noise = rig.noise
    walks = []
    for begin, walk in ((rig.gyro_bias, noise.gyro_bias_walk), (rig.accel_bias, noise.accel_bias_walk)):
        steps = walk * np.sqrt(step) * rng.standard_normal((len(t), 3))
        walks.append(np.asarray(begin) + np.cumsum(steps, axis=0))
    sigma_gyro, sigma_accel = noise.sample_sigmas(step)
    gyro = motion.rate(t) @ rig.gyro_matrix.T + walks[0] + sigma_gyro * rng.standard_normal((len(t), 3))
    accel = motion.specific_force(t) @ rig.accel_matrix.T + walks[1]
    accel = accel + sigma_accel * rng.standard_normal((len(t), 3))
    return Imu(t + rig.time_offset_s, gyro, accel), walks[0], walks[1]


def frame_poses(motion: Carried, rig: Rig, t: Array) -> Array:
    """camera_T_board (N, 7) at true times (N,), which the camera's stamps are."""
    return compose(rig.camera_T_imu, inverse(motion.pose(t)))


def project_corners(
    motion: Carried, rig: Rig, board: Board, t: Array, sigma_px: float, rng: np.random.Generator
) -> Corners:
    """Corners as a detector would find them in frames at times (N,): whole boards, with noise."""
    kept, pixels = [], []
    width, height = rig.camera.size
    for k, pose in enumerate(frame_poses(motion, rig, t)):
        own = rig.camera.project(rotate(pose[:4], board.points) + pose[4:])
        inside = np.isfinite(own).all() and (own > 8.0).all() and (own < [width - 9.0, height - 9.0]).all()
        if inside:
            kept.append(k)
            pixels.append(own + sigma_px * rng.standard_normal(own.shape))
    n = board.count
    return Corners(
        t[kept], np.repeat(np.arange(len(kept)), n), np.tile(board.points, (len(kept), 1)),
        np.concatenate(pixels) if pixels else np.zeros((0, 2)), np.full(n * len(kept), sigma_px),
    )  # fmt: skip


def render_frames(
    motion: Carried, rig: Rig, board: Board, t: Array, rng: np.random.Generator, **settings: Any
) -> list[Image]:
    """Photographs of the board at times (N,); settings as of `render_planes`."""
    from vision3d.render import board_planes, render_planes

    return [
        render_planes(rig.camera, board_planes(board, pose), rng=rng, **settings)
        for pose in frame_poses(motion, rig, t)
    ]


DEMO_BOARD = Checkerboard(9, 6, 0.035)
