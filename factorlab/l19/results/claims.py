"""A claim as an example leaves it: one line of SCRIPT.jsonl, as `examples/l19/claims.py` writes it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from factorlab.report.document import Table
from sequential.errors import FileFormatError

__all__ = ["Claim", "read_claims"]

TIME_UNITS = {"s", "ms", "µs", "ns", "1/s", "Hz", "images/s", "×"}


@dataclass(frozen=True, slots=True)
class Claim:
    """One figure, the band it must stay in (ends included, None where open), and what it was measured on."""

    item: str
    quantity: str
    value: float
    unit: str = ""
    low: float | None = None
    high: float | None = None
    source: str = "simulé"

    @property
    def judged(self) -> bool:
        """Whether a band is stated at all."""
        return self.low is not None or self.high is not None

    @property
    def holds(self) -> bool:
        """Whether the value is in its band; NaN is in none, and what is not judged holds."""
        return inside(self.value, self.low, self.high)

    @property
    def is_time(self) -> bool:
        """Whether it is a time or a speed of the machine, which is told and not judged."""
        return not self.judged and self.unit in TIME_UNITS


def inside(value: float, low: float | None, high: float | None) -> bool:
    """Whether a value is in a band, ends included; NaN is in none."""
    if low is None and high is None:
        return True
    return (low is None or value >= low) and (high is None or value <= high)


def read_claims(path: Path) -> tuple[tuple[Claim, ...], tuple[Table, ...]]:
    """The claims and the tables that a script has left, in its order; none where there is no file.

    Raises
    ------
    FileFormatError
        naming the line that is neither.
    """
    if not path.is_file():
        return (), ()
    claims, tables = [], []
    for k, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        try:
            row = json.loads(line)
            if "headings" in row:
                tables.append(_table(row))
            else:
                claims.append(Claim(**row))
        except (ValueError, TypeError, KeyError) as error:
            raise FileFormatError(
                f"{path.name}, line {k}: expected a claim as claims.py writes it, got {line[:80]!r}"
            ) from error
    return tuple(claims), tuple(tables)


def _table(row: dict[str, Any]) -> Table:
    headings = tuple(h if isinstance(h, str) else (str(h[0]), str(h[1])) for h in row["headings"])
    return Table(headings, tuple(map(tuple, row["rows"])), caption=row["title"])
