"""Running a student's file in a process of its own, with a time limit that holds whatever the file does."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import factorlab
from factorlab.l19.exercises.fault import Fault

__all__ = ["StudentRun", "run_student"]

CHILD = "factorlab.l19.exercises.child"


@dataclass(frozen=True)
class StudentRun:
    """What came out of a student's file.

    Parameters
    ----------
    events : tuple
        What the job emitted, in its order; what came before a process died is kept.
    stopped : Fault, optional
        Why the file itself stopped half-way while it was loaded; the names until there were handed on.
    fault : Fault, optional
        Why the job did not come to its end: too long, died, or an exception that it let pass.
    printed : str
        The beginning of what the file printed.
    """

    events: tuple[Any, ...]
    stopped: Fault | None
    fault: Fault | None
    printed: str


def run_student(
    path: Path,
    job: str,
    arguments: Mapping[str, Any] | None = None,
    *,
    limit_s: float = 20.0,
    loading_s: float = 5.0,
) -> StudentRun:
    """Load a file in a process of its own and hand its names to a function of ours there.

    Parameters
    ----------
    path : Path
        The student's file; it runs from its own folder, without what is under `if __name__`.
    job : str
        "package.module:function", called there as function(names, arguments, emit): `names` is the file's
        namespace, `emit(event)` hands something that JSON can hold to the parent at once.
    arguments : mapping, optional
        For the job; what JSON can hold.
    limit_s, loading_s : float
        What everything, and what loading the file, may take, s.
    """
    request = {
        "path": str(path.resolve()),
        "job": job,
        "arguments": dict(arguments or {}),
        "loading_s": loading_s,
    }
    with subprocess.Popen(  # noqa: S603 - this interpreter, with our own module
        [sys.executable, "-P", "-m", CHILD, json.dumps(request)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=_environment(),
        encoding="utf-8",
        errors="replace",
        start_new_session=True,
    ) as process:
        try:
            answers, complaint = process.communicate(timeout=limit_s)
            late = False
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            answers, complaint = process.communicate()
            late = True
        except BaseException:
            os.killpg(process.pid, signal.SIGKILL)
            raise
    return _gathered(answers, _end(process.returncode, limit_s, complaint, late=late))


def _environment() -> dict[str, str]:
    """Ours found first, figures drawn without a window, one thread."""
    root = str(Path(factorlab.__file__).resolve().parents[1])
    paths = [root, *filter(None, [os.environ.get("PYTHONPATH")])]
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    own = {"PYTHONPATH": os.pathsep.join(paths), "MPLBACKEND": "Agg", "PYTHONDONTWRITEBYTECODE": "1"}
    return {**os.environ, **own, **threads}


def _end(code: int, limit_s: float, complaint: str, *, late: bool) -> Fault:
    """The fault of a process that never said it was done."""
    if late:
        return Fault("durée", f"toujours pas fini après {limit_s:g} s : une boucle sans fin ?")
    last = complaint.strip().splitlines()[-1:] or ["sans un mot"]
    how = f"signal {-code}" if code < 0 else f"code {code}"
    if code == -signal.SIGSEGV:
        how += ", la pile a débordé : sans doute une récursion ; remplacez-la par une file ou une boucle"
    return Fault("mort", f"le programme s'est arrêté net ({how}, {last[0]})")


def _gathered(answers: str, end: Fault) -> StudentRun:
    events, stopped, fault, printed, done = [], None, None, "", False
    for line in answers.splitlines():
        try:
            kind, value = json.loads(line)
        except ValueError:
            continue  # a line cut short by the end of the process
        if kind == "event":
            events.append(value)
        elif kind == "loaded" and value is not None:
            stopped = Fault(**value)
        elif kind == "fault":
            fault = Fault(**value)
        elif kind == "printed":
            printed = value
        done = done or kind == "done"
    return StudentRun(tuple(events), stopped, fault or (None if done else end), printed)
