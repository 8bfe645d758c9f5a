"""Compiled loops over whole logs.  Importing a module here loads Numba; only `run` does so.

Every kernel has an explicit signature and a disk cache, so it is compiled once per machine.  The cache
folder carries a digest of the sources that are inlined into others, because Numba itself looks only at
the file in which a function stands.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

import numba

from sequential.cache_place import cache_place

__all__ = ["cache_folder"]

INLINED = (
    "kernels/arrays.py",
    "kernels/belief.py",
    "kernels/correcting.py",
    "kernels/rows.py",
    "kernels/linear_steps.py",
    "kernels/frozen.py",
    "kernels/sizes.py",
    "kernels/flat.py",
    "kernels/bierman.py",
    "kernels/call.py",
    "kernels/moving.py",
    "kernels/records.py",
    "kernels/informing.py",
    "kernels/matrices.py",
    "kernels/orthogonal.py",
    "kernels/mixing.py",
    "kernels/modes.py",
    "kernels/extended.py",
    "kernels/factored.py",
    "kernels/information.py",
    "kernels/charts.py",
    "kernels/handles.py",
    "kernels/slots.py",
    "kernels/poses.py",
    "kernels/regressed.py",
    "kernels/resampling.py",
    "kernels/sensing.py",
    "kernels/unscented.py",
    "kernels/sigma_points.py",
)
# all of these: models, whose functions call one another, and the compiled loops outside this room with the
# constants that are compiled into them
ROOMS = ("models/*.py", "attitude/*_kernel.py", "attitude/*_layout.py", "sensors/*_kernel.py")


def cache_folder() -> Path:
    """Where compiled code is kept: NUMBA_CACHE_DIR, else the user's cache, else the temporary folder."""
    return cache_place(lambda: f"kernels-{digest()}")


def digest() -> str:
    """A name for the text of what is inlined into others, and for Numba."""
    package = Path(__file__).parent.parent
    told = hashlib.sha256(numba.__version__.encode())
    rooms = [path for pattern in ROOMS for path in sorted(package.glob(pattern))]
    for source in [*(package / name for name in INLINED), *rooms]:
        told.update(source.read_bytes() if source.exists() else b"")
    return told.hexdigest()[:16]


numba.config.CACHE_DIR = str(cache_folder())
