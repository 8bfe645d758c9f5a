"""pycolmap, imported where it is used, and quiet."""

from __future__ import annotations

from typing import Any

__all__ = ["colmap"]

FATAL_ONLY = 3


def colmap() -> Any:
    """The module `pycolmap`, which says nothing on the screen short of its end.

    Its wheel brings a zlib of its own whose functions others would bind to: Python's is loaded first, or
    the first compression after this import would end the process.
    """
    import zlib  # noqa: F401 - bound before pycolmap's

    import pycolmap

    pycolmap.logging.minloglevel = FATAL_ONLY
    pycolmap.logging.alsologtostderr = False
    return pycolmap
