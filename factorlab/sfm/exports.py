"""The model in the files of others: COLMAP, Bundler, PLY, Kalibr, TUM."""

from __future__ import annotations

import csv
import io
import tempfile
from pathlib import Path

import numpy as np

from factorlab.sfm.job import SfmDone
from vision3d.sfm import Reconstruction

__all__ = ["mean_of", "model_files"]

COLUMNS = "picture camera qw qx qy qz px py pz centre_x centre_y centre_z points error_px"


def model_files(done: SfmDone) -> dict[str, str | bytes]:
    """Names and contents of the files of the folder; without a model there is none."""
    found = done.found
    if found is None:
        return {}
    from vision3d.sfm.bundler_file import bundler_list, bundler_text

    files: dict[str, str | bytes] = {
        "poses.csv": poses_csv(found),
        "poses_tum.txt": tum_text(found),
        "bundler/bundle.out": bundler_text(found),
        "bundler/list.txt": bundler_list(found),
        "cameras_kalibr.yaml": _kalibr(found),
    }
    for k, camera in enumerate(found.cameras):
        from vision3d.camera_files.own_json import json_text

        name = "camera" if len(found.cameras) == 1 else f"camera{k + 1}"
        files[f"{name}.json"] = json_text(camera, name)
    with tempfile.TemporaryDirectory(prefix="factorlab-sfm-") as folder:
        files |= _colmap(found, Path(folder))
        files["cloud.ply"] = _ply(found, Path(folder))
    return {name: content for name, content in files.items() if content}


def _colmap(found: Reconstruction, folder: Path) -> dict[str, str | bytes]:
    """Text in `colmap/`, binary in `colmap/sparse/0/`, where other programs look for it."""
    from vision3d.sfm import to_pycolmap

    model = to_pycolmap(found)
    files: dict[str, str | bytes] = {}
    for target, write in (("colmap/text", model.write_text), ("colmap/sparse/0", model.write_binary)):
        made = folder / target
        made.mkdir(parents=True)
        write(made)
        files |= {f"{target}/{path.name}": path.read_bytes() for path in sorted(made.iterdir())}
    return files


def _ply(found: Reconstruction, folder: Path) -> bytes:
    """Points in their colours and every camera as a red pyramid."""
    from vision3d.cloud import write_ply
    from vision3d.sfm.pyramids import camera_pyramids

    corners, faces = camera_pyramids(found)
    points = np.concatenate([found.points, corners])
    red = np.tile(np.array([[220, 40, 40]], dtype=np.uint8), (len(corners), 1))
    colors = np.concatenate([found.colors, red])
    lengths = np.concatenate([found.track_lengths, np.zeros(len(corners), dtype=np.int64)])
    path = write_ply(
        folder / "cloud.ply", points, colors=colors, scalars={"track_length": lengths},
        faces=faces + len(found.points),
    )  # fmt: skip
    return path.read_bytes()


def _kalibr(found: Reconstruction) -> str:
    """Cameras as Kalibr lists them, cam0, cam1 …; empty where it has no word for a lens."""
    from sequential.errors import ModelError
    from vision3d.camera_files.kalibr import kalibr_text

    try:
        texts = [kalibr_text(camera, f"cam{k}") for k, camera in enumerate(found.cameras)]
    except ModelError:
        return ""
    return "".join(text.replace("cam0:", f"cam{k}:") for k, text in enumerate(texts))


def poses_csv(found: Reconstruction) -> str:
    """One picture a row: camera_T_world, and where the camera was."""
    errors = found.errors_px()
    text = io.StringIO()
    out = csv.writer(text, lineterminator="\n")
    out.writerow(COLUMNS.split())
    for view, name in enumerate(found.names):
        mine = errors[found.image_index == view]
        numbers = [*found.cameras_T_world[view], *found.centres[view]]
        mean = float(mean_of(mine))
        out.writerow(
            [name, int(found.camera_of[view]) + 1, *(f"{v:.9g}" for v in numbers), len(mine), f"{mean:.4f}"]
        )
    return text.getvalue()


def mean_of(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    """Mean, 0 of nothing."""
    return float(values.mean()) if len(values) else 0.0


def tum_text(found: Reconstruction) -> str:
    """World_T_camera in the order of the names, one a second, as evo reads it."""
    from vision3d.rigid import inverse

    lines = []
    for view, pose in enumerate(inverse(found.cameras_T_world)):
        qw, qx, qy, qz, px, py, pz = (f"{value:.9g}" for value in pose)
        lines.append(f"{view} {px} {py} {pz} {qx} {qy} {qz} {qw}")
    return "\n".join(lines) + "\n"
