"""The attitude that EuRoC's sets give beside the IMU: mav0/state_groundtruth_estimate0/data.csv."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError
from sequential.log import frozen
from sequential.readers.imu.archive import open_export
from sequential.readers.imu.clock import stamps_of
from sequential.readers.imu.text_table import table_of
from sequential.readers.imu.units import scale_of

__all__ = ["euroc_truth"]

Array = NDArray[np.float64]
QUATERNION = ("q_RS_w", "q_RS_x", "q_RS_y", "q_RS_z")
NEAR_NS = 2_600_000  # half an interval of the 200 Hz at which IMU and truth are given


def euroc_truth(path: str | os.PathLike[str], t: NDArray[np.int64]) -> Array | None:
    """The true attitude at stamps (N,) ns, from a folder in EuRoC's layout; None where it holds none.

    Returns
    -------
    world_q_body : (N, 4) w x y z, world with z up and a heading of its own; NaN where no truth is near

    Raises
    ------
    FileFormatError
    """
    export = open_export(path)
    inside = export.find("state_groundtruth_estimate0/data.csv")
    if inside is None:
        return None
    where = f"{os.fspath(path)}/{inside}"
    table = table_of(export.text(inside), where, _names_attitude)
    names = [_bare(cell) for cell in table.header]
    if missing := [name for name in QUATERNION if name not in names]:
        raise FileFormatError(f"{where} has no column {missing[0]}; it has {', '.join(names)}")
    stamps, _ = stamps_of(table.text(0), scale_of("t", "ns"), where)
    q = table.numbers([names.index(name) for name in QUATERNION])
    after = np.clip(np.searchsorted(stamps, t), 1, max(len(stamps) - 1, 1))
    after = np.minimum(after, len(stamps) - 1)
    before = np.maximum(after - 1, 0)
    nearest = np.where(t - stamps[before] <= stamps[after] - t, before, after)
    length = np.linalg.norm(q[nearest], axis=1)
    seen = (np.abs(stamps[nearest] - t) <= NEAR_NS) & (length > 0.5)
    return frozen(np.where(seen[:, None], q[nearest] / np.where(seen, length, 1.0)[:, None], np.nan))


def _names_attitude(cells: Sequence[str]) -> bool:
    return QUATERNION[0] in [_bare(cell) for cell in cells]


def _bare(cell: str) -> str:
    """The name of a column without its unit."""
    return cell.strip("#\"' ").split("[", 1)[0].strip()
