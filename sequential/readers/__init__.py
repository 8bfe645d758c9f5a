"""Files become logs, recordings and trajectories here; whatever leaves this room is in SI units."""

from sequential.readers.broad import BroadTruth, read_broad
from sequential.readers.files import replacing
from sequential.readers.imu import read_imu, read_repoimu, write_imu
from sequential.readers.kalibr import KalibrImu, read_kalibr_imu, write_kalibr_imu
from sequential.readers.table import read_log, write_log
from sequential.readers.tum import read_tum, write_tum

__all__ = [
    "BroadTruth",
    "KalibrImu",
    "read_broad",
    "read_imu",
    "read_kalibr_imu",
    "read_log",
    "read_repoimu",
    "read_tum",
    "replacing",
    "write_imu",
    "write_kalibr_imu",
    "write_log",
    "write_tum",
]
