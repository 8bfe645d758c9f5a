"""Files beside the report: maps as numbers and pictures, the cloud."""

from __future__ import annotations

import io
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.stereo.depth_job import DepthRun
from vision3d.images import png_bytes

__all__ = ["depth_files"]

DISPARITY_STEPS = 256.0  # of the 16-bit picture a pixel: KITTI's
DEEPEST_M = 65.535


def depth_files(run: DepthRun) -> dict[str, str | bytes]:
    """`disparity.npz`, `disparity.png`, `mask.png`; with a calibration `depth.npz`, `depth.png`, `cloud.ply`.

    The PNGs hold 16 bits: disparity times 256 as KITTI's files do, depth in millimetres as RGB-D cameras give
    it; 0 is none.  `rectified_left.png` and its neighbour are there where the pictures were rectified here.
    """
    found = run.disparity
    files: dict[str, str | bytes] = {
        "disparity.npz": _npz(
            map_px=found.map_px, std_px=found.std_px, valid=found.valid, occluded=found.occluded,
            confidence=found.confidence, range_px=np.array(found.range_px),
        ),
        "disparity.png": png_bytes(_fixed(found.map_px * DISPARITY_STEPS)),
        "mask.png": png_bytes(mask_picture(run)),
    }  # fmt: skip
    if run.geometry is not None and run.geometry.rectification is not None:
        files |= {"rectified_left.png": png_bytes(run.left), "rectified_right.png": png_bytes(run.right)}
    if run.depth is not None and run.geometry is not None:
        more: dict[str, Any] = {}
        if run.depth.systematic_m is not None:
            more["systematic_m"] = run.depth.systematic_m
        files["depth.npz"] = _npz(
            z_m=run.depth.z_m, std_m=run.depth.std_m, measured=run.depth.measured,
            intrinsics=run.geometry.camera.intrinsics, baseline_m=np.array(run.geometry.baseline_m),
            doffs_px=np.array(run.geometry.doffs_px), **more,
        )  # fmt: skip
        files["depth.png"] = png_bytes(
            _fixed(np.where(run.depth.z_m <= DEEPEST_M, 1e3 * run.depth.z_m, np.nan))
        )
    if run.cloud is not None and len(run.cloud):
        files["cloud.ply"] = _ply(run)
    return files


def mask_picture(run: DepthRun) -> NDArray[np.uint8]:
    """(h, w): 255 matched, 128 seen by the left camera only, 0 neither."""
    picture = np.zeros(run.disparity.valid.shape, np.uint8)
    picture[run.disparity.occluded] = 128
    picture[run.disparity.valid] = 255
    return picture


def _fixed(values: Any) -> NDArray[np.uint16]:
    """16 bits, 0 where there is nothing."""
    with np.errstate(invalid="ignore"):
        held = np.where(np.isfinite(values) & (values > 0.0), np.rint(values), 0.0)
    return np.clip(held, 0, 65535).astype(np.uint16)


def _npz(**arrays: Any) -> bytes:
    held = io.BytesIO()
    np.savez_compressed(held, **arrays)
    return held.getvalue()


def _ply(run: DepthRun) -> bytes:
    """Points with colour, standard deviation along the ray's depth, and height above the ground."""
    from vision3d.cloud import write_ply

    cloud = run.cloud
    assert cloud is not None  # noqa: S101 - the caller has looked
    scalars: dict[str, Any] = {} if cloud.std_m is None else {"std_m": cloud.std_m}
    if run.ground is not None:
        scalars["height_m"] = run.ground.height_of(cloud.points)
    with tempfile.TemporaryDirectory(prefix="factorlab-depth-") as folder:
        path = write_ply(Path(folder) / "cloud.ply", cloud.points, colors=cloud.colors, scalars=scalars)
        return path.read_bytes()
