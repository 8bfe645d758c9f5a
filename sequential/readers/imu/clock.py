"""Stamps as loggers write them: seconds to nanoseconds since anything, dates, counters, or nothing at all."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError
from sequential.readers.imu.units import FACTORS, Scale
from sequential.sensors.finding import Finding

__all__ = ["NO_STAMP", "evenly", "ordered", "stamps_of"]

Stamps = NDArray[np.int64]
Array = NDArray[np.float64]
EXACT_BELOW = 4e15  # ns: a float holds whole nanoseconds up to here
UNIX = {"ns": 3e17, "us": 3e14, "ms": 3e11, "s": 3e8}  # stamps of the years 1979 to 2065 lie above
INTERVALS = {"s": 0.5, "ms": 100.0, "us": 1e5}  # the longest that an IMU has, in each unit
NO_STAMP = np.iinfo(np.int64).min


def evenly(count: int, rate: float) -> Stamps:
    """(N,) stamps at a constant rate, Hz."""
    return np.round(np.arange(count) * (1e9 / rate)).astype(np.int64)


def stamps_of(cells: Sequence[str], unit: Scale | None, where: str) -> tuple[Stamps, list[Finding]]:
    """Nanoseconds from the cells of a time column; the unit is guessed where none is stated.

    Rows whose stamp is empty get `NO_STAMP`.

    Raises
    ------
    FileFormatError
        for a stamp that is neither a number nor a date.
    """
    try:
        values = np.array([cell or "nan" for cell in cells], dtype=np.float64)
    except ValueError:
        return _dates(cells, where), []
    said: list[Finding] = []
    if unit is None:
        unit, finding = _guess(values)
        said.append(finding)
    return _scaled(cells, values, unit, where), said


def _scaled(cells: Sequence[str], values: Array, unit: Scale, where: str) -> Stamps:
    known = np.isfinite(values)
    stamps = np.full(len(values), NO_STAMP)
    per_unit = unit.factor or 1.0
    if np.abs(values[known]).max(initial=0.0) < EXACT_BELOW / per_unit:
        stamps[known] = np.round(values[known] * per_unit).astype(np.int64)
    else:  # a float would lose the last digits of a Unix time
        whole = Decimal(int(per_unit))
        try:
            stamps[known] = [round(Decimal(cells[k]) * whole) for k in np.flatnonzero(known).tolist()]
        except OverflowError:
            worst = int(np.argmax(np.where(known, np.abs(values), 0.0)))
            raise FileFormatError(
                f"{where}: the stamp {cells[worst]!r} of sample {worst} in {unit.name} is over 292 years "
                "away; mend it, or state the unit of time with units t=…"
            ) from None
    return _unwrapped(stamps, known, unit)


def _unwrapped(stamps: Stamps, known: NDArray[np.bool_], unit: Scale) -> Stamps:
    """Undo the overflow of a 32-bit counter: steps back by nearly 2**32 ticks."""
    if unit.name not in {"us", "ms"}:
        return stamps
    whole = 2**32 * int(unit.factor or 1.0)
    steps = np.diff(stamps[known])
    over = steps < -whole // 2
    if over.any() and (np.abs(steps[over] + whole) < whole // 100).all():
        stamps[known] += np.concatenate([[0], np.cumsum(over)]).astype(np.int64) * whole
    return stamps


def _guess(values: Array) -> tuple[Scale, Finding]:
    """The unit of bare numbers: by the size of a Unix time, else by an interval that an IMU may have."""
    finite = values[np.isfinite(values)]
    steps = np.abs(np.diff(finite))
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.01
    first = abs(float(finite[0])) if len(finite) else 0.0
    name = next((n for n, low in UNIX.items() if low <= first < 10.0 * low), None)
    if name is None:
        name = next((n for n, longest in INTERVALS.items() if step <= longest), "ns")
    per_unit = FACTORS["t"][name]
    scale = Scale(name, per_unit)
    rate = 1e9 / (step * per_unit)
    what = f"the time column has no unit and is taken as {name}, which makes {rate:.4g} Hz"
    return scale, Finding("note", what, do="give units t=s, ms, us or ns if that is wrong")


def _dates(cells: Sequence[str], where: str) -> Stamps:
    texts = [cell.strip().removesuffix("Z").replace("/", "-") for cell in cells]
    try:
        dates = np.array([text or "NaT" for text in texts], dtype="datetime64[ns]")
    except ValueError:
        row = next((k for k, text in enumerate(texts) if not _is_date(text)), 0)
        raise FileFormatError(
            f"{where}: the stamp {cells[row]!r} of sample {row} is neither a number nor a date such as "
            "2026-01-31T12:00:00.005; name the time column with columns t=NAME"
        ) from None
    return dates.astype(np.int64)


def _is_date(text: str) -> bool:
    try:
        np.datetime64(text)
    except ValueError:
        return False
    return True


def ordered(t: Stamps, where: str) -> tuple[NDArray[np.int64], list[Finding]]:
    """Indices that put samples in the order of time.

    Raises
    ------
    FileFormatError
        where the file holds several recordings one after another: sorting would weave them into one.
    """
    back = np.flatnonzero(np.diff(t) < 0)
    if not len(back):
        return np.arange(len(t)), []
    starts = np.concatenate([[0], back + 1, [len(t)]])
    runs = list(pairwise(starts))
    if len(runs) <= 20 and all(b - a > 10 for a, b in runs):
        ends = sorted((int(t[a]), int(t[b - 1])) for a, b in runs)
        slack = 10 * int(np.median(np.abs(np.diff(t))))  # lines that changed places overlap a little
        if any(after[0] < before[1] - slack for before, after in pairwise(ends)):
            raise FileFormatError(
                f"{where} holds {len(runs)} recordings one after another: the stamps start again at sample "
                f"{int(back[0]) + 1}; cut the file there"
            )
    what = f"{len(back)} stamps go backwards; the samples are sorted by time"
    return np.argsort(t, kind="stable"), [Finding("warn", what, f"first at sample {int(back[0]) + 1}")]
