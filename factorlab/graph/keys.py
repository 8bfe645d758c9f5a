"""The only place where variables get their names."""

from __future__ import annotations

from gtsam.symbol_shorthand import B, L, V, X

__all__ = ["STATIC", "WALKING", "B", "L", "S", "V", "X", "name_of", "walking"]

import gtsam


def S(index: int) -> int:  # noqa: N802 - a symbol, like its neighbours
    """Key of the static part number `index`."""
    return int(gtsam.symbol("s", index))


STATIC = S(0)
WALKING = "cdefghij"
"""Letters of parts that walk beside a navigation state."""


def walking(part: int, index: int) -> int:
    """Key of the walking part number `part` at node `index`."""
    return int(gtsam.symbol(WALKING[part], index))


def name_of(key: int) -> str:
    """`x12` and the like."""
    symbol = gtsam.Symbol(key)
    return f"{chr(symbol.chr())}{symbol.index()}"
