"""Files of a marker map: for programs (JSON), for people (YAML), for evo (TUM), and a table with sigmas."""

from __future__ import annotations

import csv
import io
import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.marker_map.job import MapJob
from factorlab.marker_map.mapping import MarkerMap
from sequential.readers.stamps import decimal_seconds
from vision3d.rigid import compose

__all__ = ["map_files", "marker_numbers"]

Array = NDArray[np.float64]
POSE = ("qw", "qx", "qy", "qz", "px_m", "py_m", "pz_m")
SIGMAS = ("sigma_rx_rad", "sigma_ry_rad", "sigma_rz_rad", "sigma_px_m", "sigma_py_m", "sigma_pz_m")
MOTION = (
    "vx_m_s",
    "vy_m_s",
    "vz_m_s",
    "bax_m_s2",
    "bay_m_s2",
    "baz_m_s2",
    "bgx_rad_s",
    "bgy_rad_s",
    "bgz_rad_s",
)


def marker_numbers(found: MarkerMap) -> list[dict[str, Any]]:
    """One entry for each marker that was seen."""
    sightings = found.sightings
    taken = np.bincount(sightings.marker[found.gated.taken], minlength=len(sightings.ids))
    entries = []
    for k, number in enumerate(sightings.ids):
        entry: dict[str, Any] = {
            "id": int(number), "size_m": float(sightings.size_m[k]), "placed": bool(found.placed[k]),
            "sightings": int(sightings.counts[k]), "taken": int(taken[k]),
            "contradicts": not bool(found.gated.sound[k]),
        }  # fmt: skip
        if found.placed[k]:
            cov = found.marker_covs[k]
            sigma = np.sqrt(np.maximum(np.diagonal(cov), 0.0))
            entry |= {
                "world_T_marker": found.poses[k].tolist(), "cov": cov.tolist(),
                "sigma_rotation_deg": np.degrees(sigma[:3]).tolist(), "sigma_position_m": sigma[3:].tolist(),
            }  # fmt: skip
        entries.append(entry)
    return entries


def map_files(job: MapJob) -> dict[str, str | bytes]:
    """Files of the output folder, by name."""
    found = job.found
    camera = compose(found.trajectory, found.body_T_camera)
    files: dict[str, str | bytes] = {
        "map.json": _json(job),
        "map.yaml": _yaml(job),
        "camera.tum": _tum(found, camera),
        "trajectory.csv": _table(found),
    }
    if found.inertial is not None:
        files["body.tum"] = _tum(found, found.trajectory)
    return files


def _json(job: MapJob) -> str:
    found = job.found
    document = {
        "dictionary": job.dictionary,
        "reference": int(found.sightings.ids[found.reference]),
        "world": "z up" if found.inertial is not None else "the reference marker",
        "pose": "qw qx qy qz px py pz, m; cov: rotation (rad) then translation (m), axes of the marker",
        "markers": marker_numbers(found),
    }
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def _yaml(job: MapJob) -> str:
    found = job.found
    up = (
        "z points up, the origin is the reference marker"
        if found.inertial is not None
        else "is the reference marker"
    )
    lines = [
        f"# markers of {job.source}; the world: {up}",
        "# world_T_marker: qw qx qy qz px py pz (m); a marker's x is right, y down as printed, z into it",
        f"dictionary: {job.dictionary}",
        f"reference: {found.sightings.ids[found.reference]}",
        "markers:",
    ]
    for entry in marker_numbers(found):
        if not entry["placed"]:
            continue
        lines += [
            f"  - id: {entry['id']}",
            f"    size_m: {entry['size_m']:g}",
            f"    world_T_marker: {_row(entry['world_T_marker'], 9)}",
            f"    sigma_rotation_deg: {_row(entry['sigma_rotation_deg'], 4)}",
            f"    sigma_position_m: {_row(entry['sigma_position_m'], 4)}",
        ]
    return "\n".join(lines) + "\n"


def _row(values: list[float], digits: int) -> str:
    return "[" + ", ".join(f"{value:.{digits}g}" for value in values) + "]"


def _tum(found: MarkerMap, poses: Array) -> str:
    lines = ["# t x y z qx qy qz qw"]
    for t, (qw, qx, qy, qz, x, y, z) in zip(found.t.tolist(), poses, strict=True):
        numbers = " ".join(f"{value:.9g}" for value in (x, y, z, qx, qy, qz, qw))
        lines.append(f"{decimal_seconds(t)} {numbers}")
    return "\n".join(lines) + "\n"


def _table(found: MarkerMap) -> str:
    """Poses of the body with sigmas; with an IMU also velocity and biases with theirs."""
    text = io.StringIO()
    out = csv.writer(text, lineterminator="\n")
    inertial = found.inertial is not None
    out.writerow(
        ["t_s", *POSE, *SIGMAS, *(MOTION if inertial else ()), *(f"sigma_{n}" for n in MOTION if inertial)]
    )
    sigma = np.sqrt(np.einsum("kii->ki", found.frame_covs))
    for k, t in enumerate(found.t.tolist()):
        row = [*found.trajectory[k], *sigma[k, :6]]
        if found.velocities is not None and found.biases is not None:
            row += [*found.velocities[k], *found.biases[k], *sigma[k, 6:]]
        out.writerow([decimal_seconds(t), *(f"{value:.9g}" for value in row)])
    return text.getvalue()
