"""Logs of named streams in one file, CSV or NPZ; docs/logs.md describes the formats."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError, MissingStreamError, NotFiniteError, TimeOrderError
from sequential.log import SensorLog, Stream, check_stream
from sequential.readers.csv_table import CsvTable, Reading, numbers, read_csv_table, stamps
from sequential.readers.files import replacing, require_file
from sequential.readers.npz import read_npz, write_npz
from sequential.readers.stamps import decimal_seconds

__all__ = ["read_log", "write_log"]

Covers = Literal["after", "before"]
COVERS = re.compile(r"^covers\b:?\s*(.*)$", re.IGNORECASE)


def read_log(
    path: str | os.PathLike[str],
    *,
    covers: Mapping[str, Covers] | None = None,
    name: str | None = None,
    check: bool = True,
) -> SensorLog:
    """Read a log: NPZ where the file's name ends in `.npz`, else CSV, long or wide by its header.

    Parameters
    ----------
    covers : for streams that drive a process, which side of its stamp a sample holds for; overrides the
        file's own `# covers imu=before`
    name : name of the log; the file's name without its ending by default
    check : refuse stamps that go backwards or repeat; without, mend the log with `sorted()` or `unique()`

    Raises
    ------
    DataError
        if there is no such file.
    FileFormatError, NotFiniteError, TimeOrderError, MissingStreamError
        each naming the file and, in a CSV, the line and the column.
    """
    file = require_file(path)
    lines: dict[str, list[int]] = {}
    if file.suffix.lower() == ".npz":
        streams = read_npz(file)
    else:
        table = read_csv_table(path)
        long = "stream" in table.header
        streams = _streams(table, _long(table) if long else _wide(table), lines)
    streams = _with_covers(os.fspath(path), streams, covers or {})
    if check:
        for stream_name, stream in streams.items():
            _require_sound(os.fspath(path), stream_name, stream, lines.get(stream_name))
    return SensorLog(streams, name or file.stem, checked=check)


Columns = tuple[list[str], list[str]]  # names of the value columns, names of the context columns
Found = dict[str, tuple[Columns, list[Reading]]]


def _long(table: CsvTable) -> Found:
    """One reading a row, `t,stream,v0,v1,…,c0,…`, stream by stream."""
    t, at = table.header.index(table.time), table.header.index("stream")
    kinds = {kind: [c for c in table.header if re.fullmatch(rf"{kind}\d+", c)] for kind in "vc"}
    known = {table.time, "stream", *kinds["v"], *kinds["c"]}
    if unknown := [column for column in table.header if column not in known]:
        raise FileFormatError(
            f"{table.path}: the column {unknown[0]!r} is not one of a long log, which are "
            "t or t_ns, stream, values v0 v1 …, context c0 c1 …"
        )
    places = {kind: [table.header.index(c) for c in columns] for kind, columns in kinds.items()}
    readings: dict[str, list[Reading]] = {}
    for row, line in zip(table.rows, table.lines, strict=True):
        cells = row + [""] * (len(table.header) - len(row))
        if not cells[at]:
            raise FileFormatError(
                f"{table.where(line)}: the cell of column 'stream' is empty; name the stream"
            )
        values, context = ([cells[i] for i in places[kind]] for kind in "vc")
        readings.setdefault(cells[at], []).append(Reading(line, cells[t], _filled(values), _filled(context)))
    found = {}
    for stream, rows in readings.items():
        first = rows[0]
        for reading in rows:
            _require_width(table, stream, reading, first)
        columns = kinds["v"][: len(first.values)], kinds["c"][: len(first.context)]
        found[stream] = columns, rows
    return found


def _filled(cells: list[str]) -> list[str]:
    """Cells up to the last one that is not empty."""
    while cells and not cells[-1]:
        cells.pop()
    return cells


def _require_width(table: CsvTable, stream: str, reading: Reading, first: Reading) -> None:
    for what, here, there in (
        ("values", reading.values, first.values),
        ("context columns", reading.context, first.context),
    ):
        if len(here) != len(there) or (what == "values" and not here):
            raise FileFormatError(
                f"{table.where(reading.line)}: {stream!r} has {len(here)} {what} here, {len(there)} in its "
                f"first row (line {first.line}); every reading of a stream has the same number, at least one"
            )


def _wide(table: CsvTable) -> Found:
    """One column a number, `t,gps.x,gps.y,seen.range,seen@landmark`; empty cells are no reading."""
    t = table.header.index(table.time)
    places: dict[str, tuple[list[int], list[int]]] = {}
    for index, column in enumerate(table.header):
        if index != t:
            stream, mark, _ = column.rpartition("@") if "@" in column else column.rpartition(".")
            places.setdefault(stream or column, ([], []))[mark == "@"].append(index)
    found: Found = {}
    for stream, (values, context) in places.items():
        columns = [table.header[i] for i in values], [table.header[i] for i in context]
        if not values:
            raise FileFormatError(
                f"{table.path}: {columns[1][0]!r} is the context of a stream without a value column"
            )
        found[stream] = columns, _wide_readings(table, t, values, context)
    return found


def _wide_readings(table: CsvTable, t: int, values: list[int], context: list[int]) -> list[Reading]:
    readings = []
    for row, line in zip(table.rows, table.lines, strict=True):
        if len(row) != len(table.header):
            raise FileFormatError(
                f"{table.where(line)}: {len(row)} cells where the header names {len(table.header)} columns"
            )
        cells = [row[i] for i in values], [row[i] for i in context]
        given = [bool(cell) for cell in (*cells[0], *cells[1])]
        if all(given):
            readings.append(Reading(line, row[t], *cells))
        elif any(given):
            empty = table.header[(values + context)[given.index(False)]]
            raise FileFormatError(
                f"{table.where(line)}: the cell of column {empty!r} is empty, others of its stream are not; "
                "a reading has all of its numbers, or none"
            )
    return readings


def _streams(table: CsvTable, found: Found, lines: dict[str, list[int]]) -> dict[str, Stream]:
    """Numbers instead of cells; fills in the lines from which the readings of each stream came."""
    covers = _covers_of(table)
    streams = {}
    for name, ((values, context), readings) in found.items():
        if not readings:
            raise MissingStreamError(
                f"{table.path}: the stream {name!r} has columns but not one reading; delete "
                f"{', '.join(values)} or mend the log"
            )
        at = lines[name] = [reading.line for reading in readings]
        known = numbers(table, context, at, [r.context for r in readings]) if context else None
        measured = numbers(table, values, at, [r.values for r in readings], missing=True)
        streams[name] = Stream(stamps(table, name, readings), measured, known)
    if not streams:
        raise MissingStreamError(
            f"{table.path} has a header and no reading; a log has one reading a line at least"
        )
    return _with_covers(table.path, streams, covers)


def _covers_of(table: CsvTable) -> dict[str, Covers]:
    """What comments such as `# covers imu=before odometry=after` declare."""
    declared: dict[str, Covers] = {}
    for comment in table.comments:
        if (match := COVERS.match(comment)) and "=" in match[1]:
            for word in match[1].replace(",", " ").split():
                stream, _, side = word.partition("=")
                declared[stream] = cast("Covers", side)
    return declared


def _with_covers(path: str, streams: dict[str, Stream], covers: Mapping[str, Covers]) -> dict[str, Stream]:
    for name, side in covers.items():
        if name not in streams or side not in {"after", "before"}:
            raise FileFormatError(
                f"{path}: 'covers {name}={side}' must name a stream of the log ({', '.join(streams)}) "
                "and say 'after' or 'before'"
            )
    return {name: replace(s, covers=covers.get(name, s.covers)) for name, s in streams.items()}


def _require_sound(path: str, name: str, stream: Stream, lines: list[int] | None) -> None:
    try:
        check_stream(name, stream)
    except NotFiniteError as fault:
        raise NotFiniteError(f"{path}: {fault}") from None
    except TimeOrderError as fault:
        where = path
        if lines is not None:
            wrong = np.append(False, np.diff(stream.t) < 0)
            where = f"{path}, line {lines[int(np.argmax(wrong if wrong.any() else stream.repeated()))]}"
        raise TimeOrderError(f"{where}: {fault}; read_log(…, check=False) gives the log as it is") from None


def write_log(path: str | os.PathLike[str], log: SensorLog) -> None:
    """Write a log as NPZ where the name ends in `.npz`, else as long CSV; reading it gives the same numbers.

    The file appears whole or not at all.  Missing components are written as nan.

    Raises
    ------
    FileFormatError
        where a CSV would lose the covariances that a stream brings.
    """
    if Path(path).suffix.lower() == ".npz":
        write_npz(path, log)
        return
    if heavy := [name for name, stream in log.items() if stream.noise_cov is not None]:
        raise FileFormatError(
            f"{path}: a CSV has no place for the noise_cov of {heavy[0]!r}; write the log as .npz"
        )
    widths = [(s.values.shape[1], 0 if s.context is None else s.context.shape[1]) for s in log.values()]
    most = max((v for v, _ in widths), default=0), max((c for _, c in widths), default=0)
    header = ["t", "stream", *(f"v{i}" for i in range(most[0])), *(f"c{i}" for i in range(most[1]))]
    covers = [f"{name}={stream.covers}" for name, stream in log.items() if stream.covers != "after"]
    with replacing(path) as file:
        if covers:
            file.write(f"# covers {' '.join(covers)}\n")
        file.write(",".join(header) + "\n")
        for _, line in sorted(_lines(log, most), key=lambda pair: pair[0]):
            file.write(line)


def _lines(log: SensorLog, most: tuple[int, int]) -> list[tuple[int, str]]:
    lines = []
    for name, stream in log.items():
        values = _cells(stream.values, most[0])
        context = _cells(stream.values[:, :0] if stream.context is None else stream.context, most[1])
        for t, v, c in zip(stream.t.tolist(), values, context, strict=True):
            lines.append((t, ",".join([decimal_seconds(t), name, *v, *c]) + "\n"))
    return lines


def _cells(values: NDArray[Any], width: int) -> list[list[str]]:
    empty = [""] * (width - values.shape[1])
    return [[*map(repr, row), *empty] for row in values.tolist()]
