"""The folder of a SLAM comparison: page, JSON, trajectories and the map."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from factorlab.report.document import write_document
from factorlab.slam.engine import SlamComparison
from factorlab.slam.page import slam_document
from factorlab.slam.scores import positions
from sequential.evaluate import Trajectory
from sequential.history import Run
from sequential.manifold import SE2, SE3
from sequential.readers import write_tum

__all__ = ["write_slam_report"]


def write_slam_report(
    comparisons: tuple[SlamComparison, ...], document: dict[str, Any], target: Path, *, force: bool = False
) -> Path:
    """Write everything, all or nothing; returns the path of the page.

    Raises
    ------
    OutputExistsError
        where `target` holds files and `force` is False.
    """
    from dataclasses import replace

    page = slam_document(comparisons, str(document.get("command", "")))
    own = {
        key: value for key, value in document.items() if key not in {"schema", "versions", "command", "title"}
    }
    files: dict[str, str | bytes] = {}
    for comparison in comparisons:
        folder = f"{comparison.name}/" if len(comparisons) > 1 else ""
        for row in comparison.rows:
            if row.trajectory is not None:
                files[f"{folder}trajectories/{row.name}.tum"] = _tum(row.trajectory)
            if row.run is not None and "l" in row.run.values.index:
                files[f"{folder}maps/{row.name}.csv"] = _map(
                    row.run.values.index["l"], row.run.values.rows["l"]
                )
    return write_document(replace(page, numbers=own), target, force=force, files=files)


def _tum(run: Run) -> str:
    """Seconds, position, quaternion with the scalar last."""
    import tempfile

    place = positions(run, 2 if isinstance(run.manifold, SE2) else 3)
    if isinstance(run.manifold, SE2):
        path = Trajectory.planar(run.t, place, run.mean[:, 2])
    else:
        path = Trajectory(run.t, place, run.mean[:, :4] if isinstance(run.manifold, SE3) else None)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "path.tum"
        write_tum(file, path)
        return file.read_text(encoding="utf-8")


def _map(index: np.ndarray, place: np.ndarray) -> str:
    """`id,x,y[,z]` in metres."""
    text = io.StringIO()
    text.write(",".join(["id", *"xyz"[: place.shape[1]]]) + "\n")
    for k, row in zip(index, place, strict=True):
        text.write(",".join([str(k), *(f"{value:.6f}" for value in row)]) + "\n")
    return text.getvalue()
