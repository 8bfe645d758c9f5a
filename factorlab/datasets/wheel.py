"""The recordings that the gtsam wheel carries, found without importing gtsam."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from sequential.errors import DataError

__all__ = ["gtsam_data"]


def gtsam_data() -> Path:
    """Folder `gtsam/Data` of the installed wheel; `DataError` where there is none."""
    spec = find_spec("gtsam")
    for place in (spec.submodule_search_locations or []) if spec else []:
        folder = Path(place) / "Data"
        if folder.is_dir():
            return folder
    what = "gtsam is not installed" if spec is None else "the installed gtsam has no folder Data"
    msg = f"{what}, and its wheel carries this recording; pip install gtsam, or name a folder with data=…"
    raise DataError(msg)
