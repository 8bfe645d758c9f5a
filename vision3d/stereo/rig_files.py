"""Rigs from files and to files: which format it is, the file itself says."""

from __future__ import annotations

import json
import os
from pathlib import Path

from sequential.errors import DataError, FileFormatError
from vision3d.stereo.rig import StereoRig
from vision3d.stereo.rig_json import is_rig_record, json_rig, rig_text

__all__ = ["read_rig", "write_rig"]


def read_rig(path: str | os.PathLike[str]) -> StereoRig:
    """Read a rig."""
    where = Path(path)
    if not where.is_file():
        raise DataError(f"there is no file {where}" + (": it is a folder" if where.is_dir() else ""))
    document = json.loads(where.read_text(encoding="utf-8"))
    if is_rig_record(document):
        return json_rig(document, str(where))
    raise FileFormatError(f"{where} holds no stereo rig")


def write_rig(path: str | os.PathLike[str], rig: StereoRig) -> Path:
    """Write a rig as our JSON; returns the path."""
    where = Path(path)
    where.write_text(rig_text(rig), encoding="utf-8")
    return where
