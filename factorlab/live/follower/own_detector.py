"""A student's own detector: the function `detecter` of a file, read again whenever the robot starts anew."""

from __future__ import annotations

import linecache
import runpy
import sys
from collections.abc import Callable
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.l19.follower.eye import BOTTOM, MIDDLE
from sequential.errors import DataError

__all__ = ["OwnDetector"]

NAME = "detecter"


class OwnDetector:
    """`detecter(image)` of a file: the line's columns in the rows `BOTTOM` and `MIDDLE`, px, or None.

    Parameters
    ----------
    path : of the file, which runs in this process, from its own folder; `if __name__ == "__main__"` does not

    Raises
    ------
    DataError
        where there is no such file, it cannot be run, or it defines no such function.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._detect: Callable[[Any], Any]
        self.read()

    @property
    def name(self) -> str:
        """As the page calls it."""
        return self.path.name

    def read(self) -> None:
        """Read the file again: it may have been edited."""
        if not self.path.is_file():
            raise DataError(f"il n'y a pas de fichier {self.path} ; donnez celui qui définit {NAME}(image)")
        linecache.checkcache(str(self.path))
        sys.path.insert(0, str(self.path.parent.resolve()))  # it may import its neighbours
        try:
            names = runpy.run_path(str(self.path), run_name="detecteur")
        except (Exception, SystemExit) as fault:
            raise DataError(self._told("le fichier", fault)) from fault
        finally:
            sys.path.pop(0)
        if not callable(found := names.get(NAME)):
            near = get_close_matches(NAME, [name for name in names if not name.startswith("_")], n=1)
            hint = f" ; {near[0]} en est-il un autre nom ?" if near else ""
            raise DataError(f"{self.path.name} ne définit pas {NAME}(image){hint}")
        self._detect = found

    def __call__(self, image: NDArray[np.uint8]) -> tuple[float, float] | None:
        """Two columns, px, or None where there is no line.

        Raises
        ------
        DataError
            where the function stops, or gives something else.
        """
        try:
            found = self._detect(image.copy())
        except Exception as fault:
            raise DataError(self._told(NAME, fault)) from fault
        if found is None:
            return None
        try:
            bottom, middle = (float(one) for one in np.ravel(found))
        except (TypeError, ValueError) as fault:
            msg = (
                f"{NAME} doit renvoyer deux colonnes, celles des rangées {BOTTOM} et {MIDDLE}, ou None ; "
                f"reçu {_short(found)}"
            )
            raise DataError(msg) from fault
        return bottom, middle

    def _told(self, what: str, fault: BaseException) -> str:
        """What stopped, where in the student's own file, and why."""
        line = getattr(fault, "lineno", None) if isinstance(fault, SyntaxError) else None
        trace = fault.__traceback__
        while trace is not None:
            if trace.tb_frame.f_code.co_filename == str(self.path):
                line = trace.tb_lineno
            trace = trace.tb_next
        text = linecache.getline(str(self.path), line).strip() if line else ""
        where = f", ligne {line} « {text} »" if line else ""
        return f"{what} s'est arrêté ({self.path.name}{where}) : {type(fault).__name__} : {fault}"


def _short(value: Any) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) < 60 else f"{text[:57]}…"
