"""Recordings of inertial sensors from the files of loggers, phones, autopilots and published sets."""

from sequential.readers.imu.csv_file import read_repoimu
from sequential.readers.imu.detect import holds_imu
from sequential.readers.imu.read import KINDS, read_imu
from sequential.readers.imu.write import write_imu

__all__ = ["KINDS", "holds_imu", "read_imu", "read_repoimu", "write_imu"]
