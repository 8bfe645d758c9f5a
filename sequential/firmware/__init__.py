"""The filters of the firmware in Python: the same C sources, compiled for this machine."""

from sequential.firmware.build import compile_core, library_path, source_folder
from sequential.firmware.filters import FirmwareFilter
from sequential.firmware.library import load_library, missing
from sequential.firmware.mahony import CMahony

__all__ = [
    "CMahony",
    "FirmwareFilter",
    "compile_core",
    "library_path",
    "load_library",
    "missing",
    "source_folder",
]
