"""Which left picture belongs to which right one: by their names, by their numbers, or in order."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sequential.errors import DataError

__all__ = ["Pairing", "pair_names", "split_sides"]

SIDE = re.compile(
    r"(?<![a-z])(left|right|links|rechts|gauche|droite|l|r|cam(?:era)?[_-]?[01](?=[_-]|$))(?![a-z])",
    re.IGNORECASE,
)
"""What in a name tells the side."""
LEFT = frozenset({"left", "links", "gauche", "l", "cam0", "camera0"})
ENOUGH = 0.5  # of the shorter side that a way of pairing has to find


@dataclass(frozen=True, slots=True)
class Pairing:
    """Pairs of pictures.

    Parameters
    ----------
    pairs : numbers of the left and of the right picture of each pair, in order
    left_alone, right_alone : numbers of pictures without a partner
    how : in words
    """

    pairs: tuple[tuple[int, int], ...]
    left_alone: tuple[int, ...]
    right_alone: tuple[int, ...]
    how: str


def pair_names(left: Sequence[str], right: Sequence[str]) -> Pairing:
    """Pair pictures by their names.

    Names that are equal once `left` and `right` are taken out of them belong together; then those that end in
    the same number; and where there are as many of both, they are paired in order.

    Raises
    ------
    DataError
        where none of that tells what belongs together.
    """
    for key, how in ((_without_side, "by name"), (_number, "by number")):
        found = _by_key([key(name) for name in left], [key(name) for name in right])
        if found is not None and len(found) >= max(1.0, ENOUGH * min(len(left), len(right))):
            return _pairing(found, len(left), len(right), how)
    if len(left) == len(right):
        return _pairing([(k, k) for k in range(len(left))], len(left), len(right), "in order")
    raise DataError(
        f"{len(left)} left and {len(right)} right pictures, and their names do not tell which belong "
        f"together ({left[0]} …, {right[0]} …); give both the same number, as in left07 and right07, or as "
        "many of each"
    )


def split_sides(sources: Sequence[str]) -> tuple[list[str], list[str]]:
    """Left and right sources of a command line: two, or more where the shell has spelled patterns out.

    Raises
    ------
    DataError
        where many are given and their names do not tell the sides.
    """
    if len(sources) == 2:
        return [sources[0]], [sources[1]]
    left = [one for one in sources if _is_left(one) is True]
    right = [one for one in sources if _is_left(one) is False]
    if left and right and len(left) + len(right) == len(sources):
        return left, right
    raise DataError(
        f"left and right pictures are two patterns, folders or videos, got {len(sources)}; put patterns in "
        "quotes: 'left*.jpg' 'right*.jpg'"
    )


def _pairing(pairs: list[tuple[int, int]], left: int, right: int, how: str) -> Pairing:
    mine, theirs = {i for i, _ in pairs}, {j for _, j in pairs}
    alone = tuple(i for i in range(left) if i not in mine), tuple(j for j in range(right) if j not in theirs)
    return Pairing(tuple(pairs), *alone, how)


def _by_key(left: list[str], right: list[str]) -> list[tuple[int, int]] | None:
    """Pairs of equal keys; None where a key is empty or stands twice on one side."""
    for keys in (left, right):
        if "" in keys or len(set(keys)) < len(keys):
            return None
    at = {key: j for j, key in enumerate(right)}
    return [(i, at[key]) for i, key in enumerate(left) if key in at]


def _without_side(name: str) -> str:
    stem = Path(name).stem
    bare = SIDE.sub("", stem)
    return re.sub(r"[\s._-]+", "_", bare).strip("_").lower()


def _number(name: str) -> str:
    numbers = re.findall(r"\d+", Path(name).stem)
    return numbers[-1].lstrip("0") or "0" if numbers else ""


def _is_left(source: str) -> bool | None:
    path = Path(source)
    for text in (path.stem, path.parent.name):
        if words := SIDE.findall(text):
            return words[-1].lower().replace("_", "").replace("-", "") in LEFT
    return None
