"""pycolmap, imported where it is used, and quiet."""

from __future__ import annotations

from typing import Any

__all__ = ["colmap"]

ERRORS_ONLY = 2


def colmap() -> Any:
    """The module `pycolmap`, which says nothing below an error on the screen.

    Its wheel brings a zlib of its own whose functions others would bind to: Python's is loaded first, or
    the first compression after this import would end the process.
    """
    import zlib  # noqa: F401 - bound before pycolmap's

    import pycolmap

    pycolmap.logging.minloglevel = ERRORS_ONLY
    pycolmap.logging.alsologtostderr = False
    return pycolmap
