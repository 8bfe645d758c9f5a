"""Which format a file or folder has, by its name and its first lines."""

from __future__ import annotations

import os
import re
from pathlib import Path

from sequential.errors import FileFormatError
from sequential.readers.imu.archive import Export, open_export
from sequential.readers.imu.arrays import is_imu_tk_text
from sequential.readers.imu.csv_file import names_sensors
from sequential.readers.imu.phone import is_phone_header
from sequential.readers.imu.text_table import decoded
from sequential.readers.npz import read_arrays

__all__ = ["found_out", "holds_imu"]

WIDE = re.compile(r"[A-Za-z_]\w*[.@][A-Za-z_]\w*")  # a column of a log of streams, such as gps.x
BY_ENDING = {
    ".npz": "npz",
    ".ulg": "ulog",
    ".mat": "broad",
    ".h5": "broad",
    ".hdf5": "broad",
    ".json": "sensor_logger",
}


def found_out(place: Path) -> str:
    """The kind of a file by its name, and of a folder by what is in it."""
    ending = place.suffix.lower()
    if place.is_dir() or ending == ".zip":
        return _export_kind(open_export(place), place)
    if is_imu_tk_text(place):  # whatever it is called: IMU-TK's own are named .mat
        return "imu_tk"
    return BY_ENDING.get(ending, "csv")


def holds_imu(path: str | os.PathLike[str]) -> bool:
    """Whether a file or folder looks like a recording of an IMU, and not like a log of named streams."""
    place = Path(path)
    if place.is_dir() or place.suffix.lower() in {".zip", ".ulg", ".mat", ".h5", ".hdf5", ".json"}:
        return True
    if not place.is_file():
        return False
    if place.suffix.lower() == ".npz":
        arrays = read_arrays(os.fspath(place))
        return not any(key.endswith("_t") and key.removesuffix("_t") in arrays for key in arrays)
    with place.open("rb") as file:
        top = decoded(file.read(4000), os.fspath(place)).splitlines()[:20]
    split = [[cell.strip() for cell in line.replace(";", ",").replace("\t", ",").split(",")] for line in top]
    if any("stream" in cells or any(WIDE.fullmatch(cell) for cell in cells) for cells in split):
        return False
    return any(names_sensors(cells) or is_phone_header(cells) for cells in split)


def _export_kind(export: Export, place: Path) -> str:
    if export.find("imu0/data.csv") or (export.find("data.csv") and export.find("sensor.yaml")):
        return "euroc"
    if place.is_dir() and any(is_imu_tk_text(place / name) for name in export.inside if "/" not in name):
        return "imu_tk"
    tables = export.names("csv")
    if place.is_dir() and len(tables) == 1 and holds_imu(place / tables[0]):
        return "alone"
    if not tables:
        has = ", ".join(export.inside[:8]) or "nothing"
        raise FileFormatError(
            f"{place} holds {has}; expected are the CSV files of a phone's export (Accelerometer.csv, "
            "Gyroscope.csv …; in phyphox choose CSV, not Excel) or EuRoC's mav0/imu0/data.csv"
        )
    return "phone"
