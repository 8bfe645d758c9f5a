"""The one door to open3d: imported when it is asked for, with the library that its wheel forgets.

open3d's shared object needs libusb-1.0.so.0 of the system, for depth cameras that nobody may have attached.
Where the system has none, the copy in the package `libusb-package` is loaded first, for everybody to see.
"""

from __future__ import annotations

import ctypes
import importlib.util
from functools import cache
from typing import Any

from sequential.errors import ToolMissingError

__all__ = ["has_open3d", "open3d"]

ADVICE = "pip install 'factorlab[cloud]' brings it; everything but Poisson surfaces works without"


def has_open3d() -> bool:
    """Whether the package is installed.  It may still fail to load: `open3d` tells."""
    return importlib.util.find_spec("open3d") is not None


@cache
def open3d() -> Any:
    """The module.

    Raises
    ------
    ToolMissingError
        where it is not installed, or where a library of the system that it needs is missing.
    """
    if not has_open3d():
        raise ToolMissingError(f"open3d is not installed; {ADVICE}")
    _libusb()
    try:
        import open3d as module
    except (ImportError, OSError) as error:
        raise ToolMissingError(
            f"open3d is installed but cannot be loaded ({error}); it needs libEGL, libGL and libX11 of the "
            "system (Debian: apt install libegl1 libgl1 libx11-6 libgomp1), and glibc 2.35 or newer"
        ) from error
    module.utility.set_verbosity_level(module.utility.VerbosityLevel.Error)
    return module


def _libusb() -> None:
    """Load libusb from PyPI's copy, where the system has none."""
    try:
        ctypes.CDLL("libusb-1.0.so.0", mode=ctypes.RTLD_GLOBAL)
    except OSError:
        try:
            import libusb_package

            ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
        except (ImportError, OSError):
            return  # open3d says itself what it misses
