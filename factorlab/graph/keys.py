"""The only place where variables get their names."""

from __future__ import annotations

from gtsam.symbol_shorthand import B, L, V, X

__all__ = ["STATIC", "B", "L", "S", "V", "X", "name_of"]

import gtsam


def S(index: int) -> int:  # noqa: N802 - a symbol, like its neighbours
    """Key of the static part number `index`."""
    return int(gtsam.symbol("s", index))


STATIC = S(0)


def name_of(key: int) -> str:
    """`x12` and the like."""
    symbol = gtsam.Symbol(key)
    return f"{chr(symbol.chr())}{symbol.index()}"
