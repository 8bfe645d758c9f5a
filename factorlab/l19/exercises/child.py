"""The process in which a student's file runs: `python -m factorlab.l19.exercises.child REQUEST`.

What the job emits goes to the stdout that the parent reads, one JSON document a line; what the file itself
prints is kept apart, and its windows are never opened.  Nothing here imports Numba or the library: the
interpreter and NumPy start in a few tenths of a second.
"""

from __future__ import annotations

import importlib
import json
import os
import resource
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from factorlab.l19.exercises.fault import fault_of
from factorlab.l19.exercises.loading import Listener, load

__all__ = ["main"]

MEMORY_BYTES = 4 << 30


def main(request: Mapping[str, Any]) -> None:
    """Load request["path"], hand its names to request["job"], and say "done" at the end."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    sys.stdout = sys.stderr = heard = Listener()
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES, MEMORY_BYTES))

    def emit(kind: str, value: Any) -> None:
        answers.write(json.dumps([kind, value], ensure_ascii=False, default=_plain) + "\n")
        answers.flush()

    module, _, name = request["job"].partition(":")
    job = getattr(importlib.import_module(module), name)
    path = Path(request["path"])
    names, fault = load(path, request["loading_s"])
    emit("loaded", None if fault is None else fault.to_json())
    try:
        job(names, request["arguments"], lambda event: emit("event", event))
    except Exception as error:  # noqa: BLE001 - the parent says what it was
        emit("fault", fault_of(error, path).to_json())
    emit("printed", heard.text)
    emit("done", None)
    answers.close()
    os._exit(0)  # a thread or an atexit function of theirs does not hold us up


def _plain(value: Any) -> Any:
    """NumPy's numbers and arrays, for JSON."""
    return value.tolist() if hasattr(value, "tolist") else str(value)


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
