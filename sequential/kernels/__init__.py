"""Compiled loops over whole logs.  Importing a module here loads Numba; only `run` does so.

Every kernel has an explicit signature and a disk cache, so it is compiled once per machine.  The cache
folder carries a digest of the sources that are inlined into others, because Numba itself looks only at
the file in which a function stands.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from pathlib import Path

import numba

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
    if given := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(given)
    package = Path(__file__).parent.parent
    digest = hashlib.sha256(numba.__version__.encode())
    rooms = [path for pattern in ROOMS for path in sorted(package.glob(pattern))]
    for source in [*(package / name for name in INLINED), *rooms]:
        digest.update(source.read_bytes() if source.exists() else b"")
    base = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    for folder in (base, Path(tempfile.gettempdir())):
        cache = folder / "factorlab" / f"kernels-{digest.hexdigest()[:16]}"
        try:
            cache.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(cache, os.W_OK):
            return cache
    return Path(tempfile.mkdtemp(prefix="factorlab-kernels-"))


numba.config.CACHE_DIR = str(cache_folder())
