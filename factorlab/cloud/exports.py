"""The files that go with a report on a cloud."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from factorlab.cloud.job import CloudJob, aligned
from vision3d.cloud import write_ply

__all__ = ["cloud_files"]


def cloud_files(job: CloudJob) -> dict[str, str | bytes]:
    """By name: cloud.ply as it is after the work, mesh.ply where there is a surface."""
    scalars = {}
    if job.planes:
        number = np.zeros(len(job.points))
        for k, plane in enumerate(job.planes, 1):
            number[plane.inliers] = k
        scalars["plane"] = number
    files: dict[str, str | bytes] = {
        "cloud.ply": _bytes(points=aligned(job), colors=job.colors, scalars=scalars)
    }
    if job.mesh is not None:
        files["mesh.ply"] = _bytes(
            points=job.mesh.points, faces=job.mesh.faces, scalars={"density": job.mesh.density}
        )
    return files


def _bytes(**what: Any) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        return write_ply(Path(folder) / "cloud.ply", **what).read_bytes()
