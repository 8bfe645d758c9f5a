"""Sections of a recording that somebody has named: a column of labels, or a JSON list of starts and ends."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError
from sequential.readers.files import read_text
from sequential.readers.imu.text_table import TextTable, read_table

__all__ = ["read_labels", "read_section_list"]

Rows = NDArray[np.int64]
LABELS = ("part", "section", "label", "phase")
SAMPLES = ("samples", "sample", "n_samples", "index")


def read_labels(path: str | os.PathLike[str]) -> dict[str, Rows]:
    """Rows of every label of a CSV file, as `read_imu` numbers them: in the order of the sample numbers.

    Empty where the file has no column named part, section, label or phase.

    Raises
    ------
    FileFormatError
    """
    table = read_table(path, _names_labels)
    names = [name.strip().lower() for name in table.header]
    column = next((names.index(name) for name in LABELS if name in names), None)
    if column is None:
        return {}
    labels = np.array(table.text(column))[_order(table, names)]
    return {str(label): np.flatnonzero(labels == label) for label in dict.fromkeys(labels) if label}


def _names_labels(cells: Sequence[str]) -> bool:
    return any(cell.strip().lower() in LABELS for cell in cells)


def _order(table: TextTable, names: list[str]) -> Rows:
    column = next((names.index(name) for name in SAMPLES if name in names), None)
    if column is None:
        return np.arange(len(table))
    return np.argsort(table.numbers([column])[:, 0], kind="stable")


def read_section_list(path: str | os.PathLike[str]) -> dict[str, slice]:
    """Sections from JSON: `{"x_p": {"start": 540, "end": 1271}, …}`, ends not included; or `[540, 1271]`.

    Raises
    ------
    DataError, FileFormatError
    """
    where = os.fspath(path)
    try:
        values = json.loads(read_text(path))
    except ValueError as error:
        raise FileFormatError(f"{where} is not JSON: {error}") from error
    if not isinstance(values, Mapping) or not values:
        raise FileFormatError(
            f'{where}: expected sections by name, {{"x_p": {{"start": 540, "end": 1271}}, …}}'
        )
    return {str(name): _slice(one, f"{where}, section {name}") for name, one in values.items()}


def _slice(one: Any, where: str) -> slice:
    ends = [one.get("start"), one.get("end")] if isinstance(one, Mapping) else one
    if (
        not isinstance(ends, list)
        or len(ends) != 2
        or any(isinstance(end, bool) or not isinstance(end, int) for end in ends)
        or not 0 <= ends[0] < ends[1]
    ):
        raise FileFormatError(f"{where}: expected the samples start and end, start below end, got {one!r}")
    return slice(ends[0], ends[1])
