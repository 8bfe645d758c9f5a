"""What a check found, and the sheet on which the checks of one exercise are written."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from factorlab.l19.exercises.calling import Caller
from factorlab.l19.exercises.fault import Fault

__all__ = ["FAIL", "PASS", "WARN", "Cause", "Finding", "Sheet", "shown"]

PASS, WARN, FAIL = "PASS", "WARN", "FAIL"


@dataclass(frozen=True)
class Cause:
    """A mistake that has a name: what it is, and what to write instead."""

    name: str
    mend: str


@dataclass(frozen=True)
class Finding:
    """One check of one exercise.

    Parameters
    ----------
    exercise, check : str
        "E1"; a short name such as "predire.P".
    status : str
        PASS, WARN for a remark, FAIL.
    title : str
        What was looked at, in French.
    said : str
        One sentence; for FAIL, what is wrong.
    expected, got : str
        Of the small example, as text.
    cause, mend : str
        The mistake by its name and what to write instead; empty where it is not known.
    example : str
        Lines of Python to type again.
    line, code : int, str
        The student's line, where one is known.
    """

    exercise: str
    check: str
    status: str
    title: str
    said: str = ""
    expected: str = ""
    got: str = ""
    cause: str = ""
    mend: str = ""
    example: str = ""
    line: int | None = None
    code: str = ""

    def to_json(self) -> dict[str, Any]:
        """The fields, as a dictionary for JSON."""
        return asdict(self)


class Sheet:
    """Where the checks of one exercise write what they find; each finding leaves at once.

    Parameters
    ----------
    exercise : str
        "E1" …
    names : mapping
        The names of the student's file.
    call : Caller
        Calls the student's functions.
    emit : callable
        Takes a finding's dictionary.
    """

    def __init__(
        self, exercise: str, names: Mapping[str, Any], call: Caller, emit: Callable[[dict[str, Any]], None]
    ) -> None:
        self.exercise = exercise
        self.names = names
        self.call = call
        self.emit = emit
        self.failed: list[str] = []
        self.module = call.path.stem

    def passed(self, check: str, title: str, said: str = "") -> None:
        """A check that holds."""
        self._write(Finding(self.exercise, check, PASS, title, said))

    def remark(self, check: str, title: str, said: str, **more: Any) -> None:
        """Accepted, with something to know."""
        self._write(Finding(self.exercise, check, WARN, title, said, **more))

    def wrong(self, check: str, title: str, said: str, cause: Cause | None = None, **more: Any) -> None:
        """A check that does not hold."""
        known = {} if cause is None else {"cause": cause.name, "mend": cause.mend}
        self._write(Finding(self.exercise, check, FAIL, title, said, **{**known, **more}))

    def stumbled(self, check: str, title: str, fault: Fault, **more: Any) -> None:
        """A check that their code stopped."""
        line = {"line": fault.line, "code": fault.code}
        self.wrong(check, title, f"Votre code s'arrête : {fault.said}", **{**line, **more})

    def _write(self, finding: Finding) -> None:
        if finding.status == FAIL:
            self.failed.append(finding.check)
        self.emit(finding.to_json())


def shown(value: Any) -> str:
    """A value as a student would write it: `[3, 3.2]`, `[[2.5, 0.5], [0.5, 2.9]]`, `None`."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, tuple | list):
        row = ", ".join(shown(one) for one in value)
        return f"[{row}]" if isinstance(value, list) else f"({row})"
    if isinstance(value, float):
        return f"{value:.4g}"
    return f"la fonction {value.__name__}" if inspect.isroutine(value) else repr(value)[:80]
