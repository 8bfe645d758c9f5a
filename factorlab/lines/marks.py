"""Marks on the ground: where they are seen, and where they are."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, FileFormatError

__all__ = ["read_marks"]

NAMES = ("x_px", "y_px", "x_m", "y_m")


def read_marks(path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Pixels (N, 2) and places on the ground (N, 2), m, of a CSV file with those four columns.

    Raises
    ------
    DataError
        where there is no such file.
    FileFormatError
        where a column is missing, or a cell is no number.
    """
    if not path.is_file():
        raise DataError(f"there is no file {path}")
    with path.open(encoding="utf-8-sig", newline="") as file:
        reader = csv.DictReader(file, skipinitialspace=True)
        names = [name.strip() for name in reader.fieldnames or ()]
        if missing := [name for name in NAMES if name not in names]:
            raise FileFormatError(
                f"{path} has the columns {', '.join(names) or 'none'}; expected {', '.join(NAMES)}: "
                f"{', '.join(missing)} missing"
            )
        reader.fieldnames = names
        rows = []
        for number, row in enumerate(reader, 2):
            try:
                rows.append([float(row[name]) for name in NAMES])
            except (TypeError, ValueError):
                raise FileFormatError(f"{path}, line {number}: expected four numbers, got {row}") from None
    table = np.array(rows).reshape(-1, 4)
    return table[:, :2], table[:, 2:]
