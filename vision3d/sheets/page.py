"""A sheet of paper as shapes in millimetres, from its top left corner: x right, y down."""

from __future__ import annotations

import re
from dataclasses import dataclass

from sequential.errors import ModelError

__all__ = ["PAPERS", "Disc", "Line", "Page", "Rect", "Text", "paper_size"]

PAPERS = {
    "a4": (210.0, 297.0),
    "a3": (297.0, 420.0),
    "a2": (420.0, 594.0),
    "a1": (594.0, 841.0),
    "a0": (841.0, 1189.0),
    "letter": (215.9, 279.4),
    "legal": (215.9, 355.6),
    "tabloid": (279.4, 431.8),
}
"""Width and height upright, in millimetres."""


@dataclass(frozen=True, slots=True)
class Rect:
    """A black rectangle: its top left corner, width and height; mm."""

    x: float
    y: float
    width: float
    height: float


@dataclass(frozen=True, slots=True)
class Disc:
    """A black disc: its centre and radius; mm."""

    x: float
    y: float
    radius: float


@dataclass(frozen=True, slots=True)
class Line:
    """A thin line between two points; mm.  `grey` is 0 (black) to 1 (white)."""

    x1: float
    y1: float
    x2: float
    y2: float
    width: float = 0.2
    grey: float = 0.0


@dataclass(frozen=True, slots=True)
class Text:
    """Words: where they begin on the base line, or their middle, and the size of the letters; mm."""

    x: float
    y: float
    words: str
    size: float = 3.0
    middle: bool = False


@dataclass(frozen=True, slots=True)
class Page:
    """One sheet.  What is printed in black is one area, so that no light shows between its parts.

    Parameters
    ----------
    width, height : of the paper, mm
    title : for the file
    black : rectangles and discs of the pattern
    lines, texts : what helps to cut and to check
    """

    width: float
    height: float
    title: str
    black: tuple[Rect | Disc, ...]
    lines: tuple[Line, ...] = ()
    texts: tuple[Text, ...] = ()


def paper_size(text: str) -> tuple[float, float]:
    """Width and height of a paper in mm, upright as named: a4, letter … or 300x200 (mm), as written.

    Raises
    ------
    ModelError
        if there is no such paper.
    """
    name = text.strip().lower()
    if name in PAPERS:
        return PAPERS[name]
    if (match := re.fullmatch(r"(\d+(?:\.\d+)?)\s*[x×]\s*(\d+(?:\.\d+)?)\s*(?:mm)?", name)) is not None:
        width, height = float(match[1]), float(match[2])
        if min(width, height) >= 20.0 and max(width, height) <= 5000.0:
            return width, height
    raise ModelError(
        f"no paper {text!r}: there are {', '.join(PAPERS)}, or width x height in mm from 20 to 5000, such as "
        "600x400"
    )
