"""Names and arguments that the statement prescribes, against those that a file has."""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any

__all__ = ["imported", "misspelt", "signature_fault"]

ENGLISH = {
    "predire": ("predict",),
    "corriger": ("update", "correct", "correction"),
    "Kalman": ("KalmanFilter",),
}


def misspelt(name: str, known: Iterable[str]) -> str:
    """` ; avez-vous voulu dire … ?` where a name nearly fits, or nothing."""
    by_lower = {one.lower(): one for one in known}
    for alias in ENGLISH.get(name, ()):
        if alias.lower() in by_lower:
            return f" ; renommez `{by_lower[alias.lower()]}` en `{name}`"
    near = get_close_matches(name.lower(), list(by_lower), n=1, cutoff=0.7)
    return f" ; vous avez `{by_lower[near[0]]}` : est-ce `{name}` ?" if near else ""


def signature_fault(function: Any, wanted: tuple[str, ...]) -> str:
    """What keeps a function from being called with these arguments by position; empty where nothing does."""
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):
        return ""
    try:
        signature.bind(*wanted)
    except TypeError:
        own = ", ".join(signature.parameters)
        asked = ", ".join(wanted)
        return f"prend ({own}) au lieu de ({asked})"
    return ""


def imported(module: str, name: str) -> str:
    """The line that imports a name from a student's file, whatever the file is called."""
    if module.isidentifier():
        return f"from {module} import {name}"
    return f'{name} = __import__("{module}").{name}'
