"""A student's file as a module: run once, from its own folder, without its `if __name__` part."""

from __future__ import annotations

import builtins
import io
import os
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from factorlab.l19.exercises.calling import limited
from factorlab.l19.exercises.fault import Fault, TooLongError, fault_of

__all__ = ["KEPT", "Listener", "load"]

KEPT = 2000  # characters of what a file prints


class Listener(io.TextIOBase):
    """Takes the place of stdout: keeps the beginning of what is printed, and forgets the rest."""

    def __init__(self) -> None:
        self.parts: list[str] = []
        self.room = KEPT

    def writable(self) -> bool:
        """As a stream that takes text."""
        return True

    def write(self, text: str) -> int:
        """Keep what there is room for."""
        if self.room > 0:
            self.parts.append(text[: self.room])
            self.room -= len(text)
        return len(text)

    @property
    def text(self) -> str:
        """What was kept."""
        return "".join(self.parts)


def load(path: Path, limit_s: float) -> tuple[dict[str, Any], Fault | None]:
    """The names that the file defines, and what stopped it, if anything did.

    A file that stops half-way has its names defined until there: they can still be checked.
    """
    module = ModuleType(path.stem if path.stem not in sys.modules else f"fichier_{path.stem}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module
    sys.path.insert(0, str(path.parent))
    os.chdir(path.parent)
    sys.argv = [str(path)]
    builtins.input = _no_keyboard
    try:
        with limited(limit_s):
            code = compile(path.read_bytes(), str(path), "exec", dont_inherit=True)
            exec(code, module.__dict__)  # noqa: S102 - running the file is the purpose
    except (TooLongError, SystemExit, Exception) as error:  # noqa: BLE001 - the code is theirs
        return module.__dict__, fault_of(error, path, limit_s)
    return module.__dict__, None


def _no_keyboard(prompt: object = "") -> str:
    raise EOFError("input() n'a pas de clavier ici")
