"""Trajectories in TUM format, `t x y z qx qy qz qw`: the file that evo and most SLAM tools read."""

from __future__ import annotations

import math
import os

import numpy as np

from sequential.errors import FileFormatError, NotFiniteError, TimeOrderError
from sequential.evaluate.trajectory import Trajectory
from sequential.readers.files import read_text, replacing
from sequential.readers.stamps import decimal_seconds, stamp_s

__all__ = ["read_tum", "write_tum"]

COLUMNS = ("t", "x", "y", "z", "qx", "qy", "qz", "qw")


def read_tum(path: str | os.PathLike[str]) -> Trajectory:
    """Read a trajectory; stamps keep every digit, quaternions become scalar first and unit.

    Lines that begin with `#` and empty lines are skipped; numbers are separated by blanks or tabs.
    Stamps may repeat, as they do in published truth files, but not go backwards.

    Raises
    ------
    DataError
        if there is no such file.
    FileFormatError, NotFiniteError, TimeOrderError
        naming the line.
    """
    stamps: list[int] = []
    rows: list[list[float]] = []
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        where = f"{os.fspath(path)}, line {number}"
        if len(words) != len(COLUMNS):
            raise FileFormatError(
                f"{where}: a TUM line is '{' '.join(COLUMNS)}', {len(COLUMNS)} numbers separated by blanks; "
                f"this one has {len(words)}"
            )
        stamps.append(_stamp(words[0], where))
        rows.append(_numbers(words[1:], where))
        if len(stamps) > 1 and stamps[-1] < stamps[-2]:
            raise TimeOrderError(
                f"{where}: the stamp {words[0]} comes before that of the pose above it "
                f"({decimal_seconds(stamps[-2])}); sort the lines by time"
            )
    if not rows:
        raise FileFormatError(f"{os.fspath(path)} holds no pose; a TUM line is '{' '.join(COLUMNS)}'")
    table = np.array(rows)
    return Trajectory(np.array(stamps, dtype=np.int64), table[:, :3], table[:, [6, 3, 4, 5]])


def _stamp(word: str, where: str) -> int:
    try:
        return stamp_s(word)
    except ValueError as fault:
        raise FileFormatError(f"{where}: {fault}") from None


def _numbers(words: list[str], where: str) -> list[float]:
    values = []
    for name, word in zip(COLUMNS[1:], words, strict=True):
        try:
            values.append(float(word))
        except ValueError:
            raise FileFormatError(f"{where}: {name} is {word!r}, which is not a number") from None
        if not math.isfinite(values[-1]):
            raise NotFiniteError(f"{where}: {name} is {word}; drop poses that are not known")
    if not any(values[3:]):
        raise FileFormatError(f"{where}: the quaternion is zero; a rotation has qx² + qy² + qz² + qw² = 1")
    return values


def write_tum(path: str | os.PathLike[str], trajectory: Trajectory) -> None:
    """Write a trajectory so that reading it gives the same stamps and the same numbers.

    Positions without rotations are written with the identity.  The file appears whole or not at all.
    """
    quaternion = trajectory.quaternion
    if quaternion is None:
        quaternion = np.tile([1.0, 0.0, 0.0, 0.0], (len(trajectory), 1))
    table = np.column_stack([trajectory.position, quaternion[:, 1:], quaternion[:, 0]]).tolist()
    with replacing(path) as file:
        file.write(f"# {' '.join(COLUMNS)}\n")
        for t, row in zip(trajectory.t.tolist(), table, strict=True):
            file.write(f"{decimal_seconds(t)} {' '.join(map(repr, row))}\n")
