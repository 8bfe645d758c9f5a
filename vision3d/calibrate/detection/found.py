"""What a finder gives: refined points of a board with their numbers, or what was seen instead."""

from __future__ import annotations

from dataclasses import dataclass

from vision3d.calibrate.detection.lattice import Ids
from vision3d.calibrate.detection.refine import Refined

__all__ = ["Found", "NotFound"]


@dataclass(frozen=True, slots=True)
class Found:
    """Refined points of a board: ids (N,) in order, `refined` row by row, and what found them."""

    ids: Ids
    refined: Refined
    finder: str
    lost: tuple[int, ...] = ()
    dark_first: bool = True
    mirrored: bool = False
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class NotFound:
    """What was seen instead of the board: columns and rows of a grid, or None."""

    seen: tuple[int, int] | None = None
    reason: str = ""
