"""Where compiled code is kept between runs."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

__all__ = ["cache_place"]


def cache_place(name: Callable[[], str]) -> Path:
    """NUMBA_CACHE_DIR, else a folder of that name in the user's cache, else in the temporary folder.

    `name` is asked for only where it is needed, because it usually takes reading sources.
    """
    if given := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(given)
    own = name()
    base = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    for folder in (base, Path(tempfile.gettempdir())):
        place = folder / "factorlab" / own
        try:
            place.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(place, os.W_OK):
            return place
    return Path(tempfile.mkdtemp(prefix=f"factorlab-{own}-"))
