"""Versions of everything that a figure depends on."""

from __future__ import annotations

import platform
from importlib import metadata

__all__ = ["LIBRARIES", "versions"]

LIBRARIES = (
    "numpy", "scipy", "numba", "gtsam", "opencv-python-headless", "pycolmap", "matplotlib", "click", "jinja2",
)  # fmt: skip


def versions() -> dict[str, str]:
    """Names and versions, factorlab and Python first; "source tree" where factorlab is not installed."""
    found = {"factorlab": version_of("factorlab", "source tree"), "python": platform.python_version()}
    return found | {name: version_of(name) for name in LIBRARIES}


def version_of(name: str, otherwise: str = "missing") -> str:
    """Version of an installed distribution, read without importing it."""
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return otherwise
