"""Families of dictionaries: which markers share their pattern, and how to tell a family from a picture.

Dictionaries of one size of cells begin with the same markers (`6x6_50` is the beginning of `6x6_250`), so a
picture tells the family, and only the largest number seen tells how long the dictionary must be.
"""

from __future__ import annotations

from vision3d.boards.dictionaries import DICTIONARIES, dictionary_name, opencv_dictionary

__all__ = [
    "DICTIONARIES",
    "FAMILIES",
    "dictionary_name",
    "family_of",
    "opencv_dictionary",
    "smallest_of",
    "surprise",
]


def family_of(name: str) -> str:
    """What dictionaries that begin alike have in common: `6x6` of `6x6_250`; tags stand alone."""
    return name.rsplit("_", 1)[0] if name[0].isdigit() else name


def _longest() -> dict[str, str]:
    longest: dict[str, str] = {}
    for name, one in DICTIONARIES.items():
        family = family_of(name)
        if family not in longest or one.count > DICTIONARIES[longest[family]].count:
            longest[family] = name
    return longest


FAMILIES: dict[str, str] = _longest()
"""The longest dictionary of each family."""


def smallest_of(family: str, largest_id: int) -> str:
    """The shortest dictionary of a family that has a marker of this number."""
    fitting = [n for n, one in DICTIONARIES.items() if family_of(n) == family and one.count > largest_id]
    return min(fitting, key=lambda name: DICTIONARIES[name].count, default=FAMILIES[family])


def surprise(name: str) -> float:
    """How many bits chance would have to guess to make a marker of this dictionary out of any square."""
    from math import log2

    one = DICTIONARIES[name]
    return one.bits * one.bits - log2(4 * one.count)
