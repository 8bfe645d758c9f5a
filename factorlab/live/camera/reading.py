"""What a task says about one frame: words, numbers, tables, and marks to draw on the image."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from factorlab.live.plain import plain

__all__ = ["Column", "Dots", "Label", "Line", "Mark", "Number", "Reading", "Role", "State", "Table"]

State = Literal["good", "warn", "bad", "idle"]
Role = Literal["good", "warn", "bad", "accent", "soft", "x", "y", "z"]


@dataclass(frozen=True)
class Line:
    """A line through points (N, 2) px; closed ones end where they began."""

    points: NDArray[np.float64]
    role: Role = "accent"
    closed: bool = False
    width: int = 2


@dataclass(frozen=True)
class Dots:
    """Points (N, 2) px."""

    points: NDArray[np.float64]
    role: Role = "accent"
    radius: int = 3


@dataclass(frozen=True)
class Label:
    """Words whose lower left corner is at `point` (2,) px."""

    point: NDArray[np.float64]
    text: str
    role: Role = "accent"


Mark = Line | Dots | Label


@dataclass(frozen=True)
class Number:
    """One quantity; `sigma` is its standard deviation, where it is known."""

    name: str
    value: float | None
    unit: str = ""
    digits: int = 2
    sigma: float | None = None


@dataclass(frozen=True)
class Column:
    """A column of a table, with the digits after the point of its numbers."""

    name: str
    unit: str = ""
    digits: int = 2


@dataclass(frozen=True)
class Table:
    """Rows of cells: words, numbers, or None where there is none."""

    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Any, ...], ...]


@dataclass(frozen=True)
class Reading:
    """What a task says about one frame.

    Parameters
    ----------
    headline : in a few words
    state : `good` where the task sees what it looks for
    numbers, tables : for the page
    traces : values that the page draws over time; None breaks the line
    marks : drawn on the image, in order
    notes : sentences about what to do
    rows : lines of the task's CSV, cells by the names of its columns
    panel : what a page's panel of this task needs besides
    """

    headline: str
    state: State = "idle"
    numbers: tuple[Number, ...] = ()
    tables: tuple[Table, ...] = ()
    traces: Mapping[str, float | None] = field(default_factory=dict)
    marks: tuple[Mark, ...] = ()
    notes: tuple[str, ...] = ()
    rows: tuple[Mapping[str, Any], ...] = ()
    panel: Mapping[str, Any] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Everything but the marks and the rows, as strict JSON takes it."""
        return {
            "headline": self.headline,
            "state": self.state,
            "numbers": [plain(vars(one)) for one in self.numbers],
            "tables": [
                {
                    "title": one.title,
                    "columns": [vars(column) for column in one.columns],
                    "rows": plain(one.rows),
                }
                for one in self.tables
            ],
            "traces": plain(self.traces),
            "notes": list(self.notes),
            "panel": plain(self.panel),
        }
