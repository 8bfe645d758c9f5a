"""Bundler's bundle.out: written for programs that read nothing newer.

Its camera looks along −z with y up, its pixels count from the image's middle with y up, and it has two
radial coefficients: x' = f (1 + k1 r² + k2 r⁴) x, about that middle (Snavely, Bundler v0.3).
"""

from __future__ import annotations

import numpy as np

from sequential.manifold.quaternion import rotation_matrix
from vision3d.sfm.reconstruction import Reconstruction

__all__ = ["bundler_list", "bundler_text"]

FLIP = np.array([1.0, -1.0, -1.0])
SAYS = {"pinhole": 0, "brown1": 1, "brown2": 2}


def bundler_text(found: Reconstruction) -> str:
    """The file; empty where a lens has more than two radial coefficients.

    Observations are written about the principal point, where Bundler's own is; two focal lengths become
    their mean.
    """
    if any(camera.lens not in SAYS for camera in found.cameras):
        return ""
    lines = ["# Bundle file v0.3", f"{len(found)} {len(found.points)}"]
    for view, pose in enumerate(found.cameras_T_world):
        camera = found.camera(view)
        k1, k2 = [*camera.distortion.tolist(), 0.0, 0.0][:2]
        lines.append(_row([camera.intrinsics[:2].mean(), k1, k2]))
        lines += [_row(row) for row in FLIP[:, None] * rotation_matrix(pose[:4])]
        lines.append(_row(FLIP * pose[4:]))
    principal = np.array([camera.intrinsics[2:] for camera in found.cameras])
    centred = found.pixels - principal[found.camera_of[found.image_index]]
    order = np.argsort(found.point_index, kind="stable")
    starts = np.searchsorted(found.point_index[order], np.arange(len(found.points) + 1))
    key = np.zeros(len(found.pixels), dtype=np.int64)
    for view in range(len(found)):
        mine = found.image_index == view
        key[mine] = np.arange(int(mine.sum()))
    for k, point in enumerate(found.points):
        rows = order[starts[k] : starts[k + 1]]
        seen = [
            f"{found.image_index[row]} {key[row]} {centred[row, 0]:.4f} {-centred[row, 1]:.4f}"
            for row in rows
        ]
        lines += [_row(point), " ".join(map(str, found.colors[k])), " ".join([str(len(rows)), *seen])]
    return "\n".join(lines) + "\n"


def bundler_list(found: Reconstruction) -> str:
    """Names of the pictures in the file's order; empty where the file is."""
    return "\n".join(found.names) + "\n" if all(one.lens in SAYS for one in found.cameras) else ""


def _row(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]] | list[float]) -> str:
    return " ".join(f"{value:.10g}" for value in values)
