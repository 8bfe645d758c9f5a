"""Our own JSON of a rig: both cameras, their pose, and the covariance of all."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from sequential.errors import FactorlabError, FileFormatError
from vision3d.camera_files.numbers import row
from vision3d.camera_files.own_json import camera_record, is_record, json_cameras
from vision3d.stereo.rig import StereoRig

__all__ = ["is_rig_record", "json_rig", "rig_record", "rig_text"]

FORMAT = "factorlab stereo rig"


def rig_record(rig: StereoRig) -> dict[str, Any]:
    """What is written of a rig, as plain Python."""
    return {
        "format": FORMAT,
        "left": camera_record(rig.left, "left"),
        "right": camera_record(rig.right, "right"),
        "right_T_left": dict(
            zip(("qw", "qx", "qy", "qz", "px", "py", "pz"), rig.right_T_left.tolist(), strict=True)
        ),
        "baseline_m": rig.baseline_m,
        "covariance": None if rig.joint_cov is None else rig.joint_cov.tolist(),
    }


def rig_text(rig: StereoRig) -> str:
    """The file of a rig."""
    record = rig_record(rig)
    rows = record.pop("covariance")
    text = json.dumps(record, indent=1)
    # a row a line: a matrix of 24 x 24 is not worth 576 lines
    cov = "null" if rows is None else "[\n" + ",\n".join("  " + json.dumps(one) for one in rows) + "\n ]"
    return f'{text[:-2]},\n "covariance": {cov}\n}}\n'


def is_rig_record(document: Any) -> bool:
    """Whether a document is a rig of ours, or has one under "rig"."""
    return isinstance(document, dict) and (
        document.get("format") == FORMAT or is_rig_record(document.get("rig"))
    )


def json_rig(document: dict[str, Any], where: str) -> StereoRig:
    """The rig of a document.

    Raises
    ------
    FileFormatError
        where an entry is missing, or is no rig's.
    """
    if document.get("format") != FORMAT:
        return json_rig(document["rig"], where)
    cameras = []
    for side in ("left", "right"):
        record = document.get(side)
        if not is_record(record):
            raise FileFormatError(f"{where}: {side} of a rig is a camera; got {record!r}")
        cameras.append(next(iter(json_cameras(record, f"{where}, {side}").values())))  # type: ignore[arg-type]
    pose = document.get("right_T_left")
    names = ("qw", "qx", "qy", "qz", "px", "py", "pz")
    if not isinstance(pose, dict) or set(pose) != set(names):
        raise FileFormatError(f"{where}: right_T_left of a rig holds {', '.join(names)}; got {pose!r}")
    values = row([pose[name] for name in names], 7, "right_T_left", where)
    given = document.get("covariance")
    try:
        cov = None if given is None else np.array([row(one, None, "the covariance", where) for one in given])
        return StereoRig(cameras[0], cameras[1], np.array(values), cov)
    except (FactorlabError, ValueError, TypeError) as error:
        raise FileFormatError(f"{where}: {error}") from error
