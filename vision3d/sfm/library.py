"""pycolmap, imported where it is used, and quiet."""

from __future__ import annotations

import signal
import threading
from typing import Any

__all__ = ["colmap"]

FATAL_ONLY = 3


def colmap() -> Any:
    """The module `pycolmap`, which says nothing on the screen short of its end.

    Its wheel brings a zlib of its own whose functions others would bind to: Python's is loaded first, or
    the first compression after this import would end the process.  It also takes SIGTERM for a crash and
    prints its stack; what was there before is put back.
    """
    import zlib  # noqa: F401 - bound before pycolmap's

    before = signal.getsignal(signal.SIGTERM)
    import pycolmap

    if before is not None and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, before)
    pycolmap.logging.minloglevel = FATAL_ONLY
    pycolmap.logging.alsologtostderr = False
    return pycolmap
