"""Calibration of an IMU as one job: what `factorlab calibrate` runs, and the page that it writes."""

from factorlab.calibration.job import Calibrated, calibrate_accel, calibrate_gyro, calibrate_imu
from factorlab.calibration.page import calibration_document, export_files

__all__ = [
    "Calibrated",
    "calibrate_accel",
    "calibrate_gyro",
    "calibrate_imu",
    "calibration_document",
    "export_files",
]
