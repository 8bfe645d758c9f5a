"""How French is set: no line begins with « : ; ? ! », and guillemets hold what they embrace."""

from __future__ import annotations

import re

__all__ = ["bound"]


def bound(text: str) -> str:
    """Put no-break spaces where French has a space that must not end a line.

    >>> bound("« oui » : non ?").count(chr(0xA0))
    4
    """
    return re.sub(r" ([:;?!»%])", "\u00a0\\1", text.replace("« ", "«\u00a0"))
