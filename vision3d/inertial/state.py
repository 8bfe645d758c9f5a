"""What a camera-IMU calibration estimates, and how a step changes it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.manifold import SE3, SO3
from vision3d.inertial.banded import Solved
from vision3d.inertial.basis import weights
from vision3d.inertial.grid import Grid
from vision3d.inertial.rotation_spline import turning_only

__all__ = ["IMU_MODELS", "Constants", "State"]

Array = NDArray[np.float64]
IMU_MODELS = ("calibrated", "scale", "scale-misalignment")
Entries = tuple[NDArray[np.intp], NDArray[np.intp]]


@dataclass(frozen=True)
class Constants:
    """Which columns of the border are what.

    Parameters
    ----------
    imu_model : of `IMU_MODELS`: nothing of the IMU's gains, three gains each, or accelerometer lower
        triangular (6) and gyro full (9), so that the accelerometer's axes are the body's
    board_scale : the size of the board is estimated as well
    """

    imu_model: str = "calibrated"
    board_scale: bool = False

    def __post_init__(self) -> None:
        if self.imu_model not in IMU_MODELS:
            raise ModelError(f"no IMU model {self.imu_model!r}; known are {', '.join(IMU_MODELS)}")

    @property
    def names(self) -> tuple[str, ...]:
        """A name for every column."""
        own = [f"camera_T_imu.{name}" for name in SE3().labels()]
        own += ["time_offset", "gravity.1", "gravity.2"]
        own += ["board_scale"] * self.board_scale
        own += [f"accel_matrix.{i}{j}" for i, j in zip(*self.accel_entries, strict=True)]
        own += [f"gyro_matrix.{i}{j}" for i, j in zip(*self.gyro_entries, strict=True)]
        return tuple(own)

    @property
    def count(self) -> int:
        """How many constants."""
        return 9 + self.board_scale + len(self.accel_entries[0]) + len(self.gyro_entries[0])

    @property
    def accel_entries(self) -> Entries:
        """Rows and columns of the accelerometer's matrix that are estimated."""
        return _entries({"calibrated": 0, "scale": 1, "scale-misalignment": 2}[self.imu_model])

    @property
    def gyro_entries(self) -> Entries:
        """The same of the gyro's."""
        return _entries({"calibrated": 0, "scale": 1, "scale-misalignment": 3}[self.imu_model])

    @property
    def scale_column(self) -> int:
        """Column of the board's scale."""
        return 9

    @property
    def matrix_columns(self) -> tuple[slice, slice]:
        """Columns of the accelerometer's and of the gyro's matrix."""
        first = 9 + self.board_scale
        middle = first + len(self.accel_entries[0])
        return slice(first, middle), slice(middle, middle + len(self.gyro_entries[0]))


def _entries(kind: int) -> Entries:
    """Of a (3, 3) matrix: none, the diagonal, the lower triangle, all."""
    mask = (np.zeros((3, 3)), np.eye(3), np.tri(3), np.ones((3, 3)))[kind]
    rows, columns = np.nonzero(mask)
    return rows, columns


@dataclass(frozen=True, eq=False)
class State:
    """Everything that is unknown.

    Parameters
    ----------
    grid : knots of trajectory and biases
    rotations : (K, 4) control values of board_q_imu
    positions : (K, 3) of the IMU in the board's frame, m
    camera_T_imu : (7,)
    time_offset_s : IMU clock less camera clock
    gravity : (3,) in the board's frame, m/s²; its length is given
    accel_matrix, gyro_matrix : (3, 3), reading = matrix @ true + bias
    gyro_bias, accel_bias : (B, 3) at the nodes, rad/s and m/s²
    board_scale : true size of the board over the told one
    """

    grid: Grid
    rotations: Array
    positions: Array
    camera_T_imu: Array
    time_offset_s: float
    gravity: Array
    gyro_bias: Array
    accel_bias: Array
    accel_matrix: Array
    gyro_matrix: Array
    board_scale: float = 1.0

    @property
    def gravity_plane(self) -> Array:
        """(3, 2) unit vectors across gravity."""
        unit = self.gravity / np.linalg.norm(self.gravity)
        helper = np.eye(3)[int(np.argmin(np.abs(unit)))]
        first = np.cross(unit, helper)
        first /= np.linalg.norm(first)
        return np.column_stack([first, np.cross(unit, first)])

    def moved(self, step: Solved, constants: Constants, share: float = 1.0) -> State:
        """The state after a step, or a share of it."""
        controls, own, nodes = share * step.controls, share * step.constants, share * step.nodes
        length = float(np.linalg.norm(self.gravity))
        turned = self.gravity + self.gravity_plane @ own[7:9]
        accel, gyro = self.accel_matrix.copy(), self.gyro_matrix.copy()
        columns = constants.matrix_columns
        accel[constants.accel_entries] += own[columns[0]]
        gyro[constants.gyro_entries] += own[columns[1]]
        # linear, as positions are: board and path grow together without a residual
        grown = 1.0 + own[constants.scale_column] if constants.board_scale else 1.0
        return replace(
            self,
            rotations=SO3().retract(self.rotations, controls[:, :3]),
            positions=self.positions + controls[:, 3:],
            camera_T_imu=SE3().retract(self.camera_T_imu, own[:6]),
            time_offset_s=self.time_offset_s + float(own[6]),
            gravity=turned * (length / np.linalg.norm(turned)),
            accel_matrix=accel,
            gyro_matrix=gyro,
            gyro_bias=self.gyro_bias + nodes[:, :3],
            accel_bias=self.accel_bias + nodes[:, 3:],
            board_scale=float(self.board_scale * grown),
        )

    def motion(self, t: Array) -> tuple[Array, Array, Array, Array, Array]:
        """R (N, 3, 3), and (N, 3) each: rate, position, velocity, acceleration, at the IMU's times (N,)."""
        grid = self.grid
        at = grid.locate(t)
        R, rate = turning_only(self.rotations, at.first, at.u, at.step_s, grid.order)
        near = self.positions[at.first[:, None] + np.arange(grid.order)]
        position, velocity, acceleration = (
            np.einsum("nk,nki->ni", weights(grid.order, at.u, n) / at.step_s[:, None] ** n, near)
            for n in range(3)
        )
        return R, rate, position, velocity, acceleration

    def biases(self, t: Array) -> tuple[Array, Array]:
        """Gyro's and accelerometer's (N, 3) at times (N,)."""
        at = self.grid.locate(t)
        share = at.share[:, None]
        gyro, accel = (
            (1.0 - share) * one[at.node] + share * one[at.node + 1]
            for one in (self.gyro_bias, self.accel_bias)
        )
        return gyro, accel
