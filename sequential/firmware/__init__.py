"""The filters of the firmware in Python: the same C sources, compiled for this machine."""

from sequential.firmware.build import compile_core, library_path, source_folder
from sequential.firmware.complementary import CComplementary, CComplementaryFixed
from sequential.firmware.error_state import CErrorState
from sequential.firmware.filters import FirmwareFilter, FixedPointFilter
from sequential.firmware.library import load_library, missing
from sequential.firmware.mahony import CMahony, CMahonyFixed
from sequential.firmware.tilt_kalman import CTiltKalman, CTiltKalmanFixed

__all__ = [
    "CComplementary",
    "CComplementaryFixed",
    "CErrorState",
    "CMahony",
    "CMahonyFixed",
    "CTiltKalman",
    "CTiltKalmanFixed",
    "FirmwareFilter",
    "FixedPointFilter",
    "compile_core",
    "library_path",
    "load_library",
    "missing",
    "source_folder",
]
