"""What a camera-IMU calibration found, and how sure it is."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sequential.manifold.quaternion import rotation_matrix
from vision3d.inertial.adjust import Adjusted, BiasWalk
from vision3d.inertial.alignment import Aligned
from vision3d.inertial.problem import Problem
from vision3d.inertial.start import FramePoses

if TYPE_CHECKING:
    from vision3d.inertial.calibrate import CamImuSettings

__all__ = ["CamImuCalibration"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CamImuCalibration:
    """A calibration with its covariance.

    Parameters
    ----------
    settings : what was asked for
    problem : readings with their final noise and weights
    adjusted : the solution, its residuals, its normal equations
    aligned : what turns alone had said
    poses : each frame's own pose of the board
    walk : of the biases
    knots_per_s : of the trajectory
    """

    settings: CamImuSettings
    problem: Problem
    adjusted: Adjusted
    aligned: Aligned
    poses: FramePoses
    walk: BiasWalk
    knots_per_s: float

    @property
    def camera_T_imu(self) -> Array:  # noqa: N802 - frames are written so
        """(7,) pose of the IMU in the camera's frame: Kalibr's T_cam_imu."""
        return self.adjusted.state.camera_T_imu

    @property
    def time_offset_s(self) -> float:
        """Added to a camera's stamp it gives the IMU's: Kalibr's timeshift_cam_imu."""
        return self.adjusted.state.time_offset_s

    @property
    def names(self) -> tuple[str, ...]:
        """Of the constants, in the order of `cov`."""
        return self.problem.constants.names

    @cached_property
    def border_cov(self) -> Array:
        """Covariance of constants and bias nodes, the trajectory marginalised."""
        return self.adjusted.system.border_cov

    @property
    def cov(self) -> Array:
        """(q, q) of the constants: camera_T_imu in its right chart, offset s, gravity m/s², board, gains."""
        q = self.problem.constants.count
        return self.border_cov[:q, :q]

    @property
    def std(self) -> Array:
        """(q,) standard deviations of the constants."""
        return np.sqrt(np.diagonal(self.cov))

    @property
    def rotation_std(self) -> Array:
        """(3,) rad, about the camera's axes."""
        R = rotation_matrix(self.camera_T_imu[:4])
        return np.sqrt(np.diagonal(R @ self.cov[:3, :3] @ R.T))

    @property
    def translation_std(self) -> Array:
        """(3,) m, of where the IMU is in the camera's frame."""
        R = rotation_matrix(self.camera_T_imu[:4])
        return np.sqrt(np.diagonal(R @ self.cov[3:6, 3:6] @ R.T))

    @property
    def time_offset_std_s(self) -> float:
        """Of the offset of the clocks."""
        return float(self.std[6])

    def bias_std(self) -> tuple[Array, Array]:
        """Of gyro and accelerometer bias at the nodes, (B, 3) each."""
        q = self.problem.constants.count
        own = np.sqrt(np.diagonal(self.border_cov)[q:]).reshape(-1, 6)
        return own[:, :3], own[:, 3:]

    @property
    def frames_used(self) -> NDArray[np.bool_]:
        """(F,) frames that count."""
        corners = self.problem.corners
        counted = np.bincount(corners.frame, self.problem.corner_weight > 0.0, minlength=len(corners.t))
        return np.asarray(counted > 0)

    @property
    def rms_px(self) -> float:
        """Root mean squared length of the residuals of the corners that count."""
        kept = self.problem.corner_weight > 0.0
        return float(np.sqrt(np.mean(np.sum(self.adjusted.linear.residuals_px[kept] ** 2, axis=1))))
