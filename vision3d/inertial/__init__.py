"""A camera and an IMU on one rig: how they are mounted, how their clocks differ, how sure that is."""

from vision3d.inertial.calibrate import CamImuSettings, calibrate_cam_imu
from vision3d.inertial.problem import Corners, Imu
from vision3d.inertial.result import CamImuCalibration
from vision3d.inertial.state import IMU_MODELS

__all__ = ["IMU_MODELS", "CamImuCalibration", "CamImuSettings", "Corners", "Imu", "calibrate_cam_imu"]
