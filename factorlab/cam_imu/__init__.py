"""Calibration of a camera and an IMU on one rig, from a recording of both before a board."""

from factorlab.cam_imu.document import cam_imu_document
from factorlab.cam_imu.exports import cam_imu_files
from factorlab.cam_imu.job import CamImuJob, CamImuRun, calibrate_recording

__all__ = ["CamImuJob", "CamImuRun", "calibrate_recording", "cam_imu_document", "cam_imu_files"]
