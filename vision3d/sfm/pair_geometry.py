"""The view graph of a database: what COLMAP verified, and relative rotations from the pairs alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vision3d.sfm.colmap import pose_from_pycolmap
from vision3d.sfm.extraction import PictureFeatures
from vision3d.sfm.library import colmap
from vision3d.sfm.turning import FARTHEST_FROM_TURNING, distance_from_turning
from vision3d.sfm.view_graph import ViewGraph

if TYPE_CHECKING:
    import pycolmap

__all__ = ["view_graph_of"]

KINDS = {
    "CALIBRATED": "general", "CALIBRATED_RIG": "general", "UNCALIBRATED": "general", "MULTIPLE": "general",
    "PLANAR": "planar", "PANORAMIC": "pure rotation", "PLANAR_OR_PANORAMIC": "flat or turned",
    "WATERMARK": "watermark", "DEGENERATE": "none", "UNDEFINED": "none",
}  # fmt: skip
"""COLMAP's words for the geometry of two views, in ours."""
NEAR_PX, FINE_PX = 1.0, 1600.0  # of a match from its epipolar line, in pictures up to that size
UNSURE = ("planar", "pure rotation", "flat or turned")  # by one homography


def view_graph_of(
    database: Path, pictures: Sequence[PictureFeatures], model: pycolmap.Reconstruction | None, seed: int
) -> ViewGraph:
    """Pairs of a matched database; pictures are numbered from 1 in their order.

    Parameters
    ----------
    model : with its cameras, which self-calibration made better than those of the database, pairs are
        estimated once more
    """
    theirs = colmap()
    with theirs.Database.open(database) as opened:
        numbers, kept = opened.read_two_view_geometries()
        geometries = dict(zip(numbers, kept, strict=True))
        pairs, counts = opened.read_num_matches()
        cameras = {one.camera_id: one for one in opened.read_all_cameras()}
        of_image = {one.image_id: one.camera_id for one in opened.read_all_images()}
    if model is not None:
        cameras |= dict(model.cameras)
    options = theirs.TwoViewGeometryOptions()
    options.compute_relative_pose, options.ransac.random_seed = True, seed
    if model is not None:  # cameras are known well enough for less than COLMAP's 4 px
        longer = max(max(one.size) for one in pictures)
        options.ransac.max_error = NEAR_PX * max(1.0, longer / FINE_PX)
    rows: list[tuple[Any, ...]] = []
    for pair, matches in sorted(zip(pairs, counts, strict=True)):
        a, b = sorted(theirs.pair_id_to_image_pair(pair))
        geometry = geometries.get(pair)
        inliers = 0 if geometry is None else len(geometry.inlier_matches)
        kind, turn, flat = "none", np.full(4, np.nan), None
        if geometry is not None and inliers:
            first, second = cameras[of_image[a]], cameras[of_image[b]]
            kind, turn, flat = _again(geometry, pictures[a - 1], pictures[b - 1], first, second, options)
        rows.append(((a - 1, b - 1), matches, inliers, kind, turn, flat))
    columns: list[Any] = [list(column) for column in zip(*rows, strict=True)] if rows else [[]] * 6
    if model is None:
        columns[3] = _turned_after_all(columns[0], columns[3], columns[5], pictures)
    return ViewGraph(
        tuple(one.name for one in pictures), np.array([len(one) for one in pictures]), columns[0],
        columns[1], columns[2], tuple(columns[3]), np.array(columns[4]),
    )  # fmt: skip


def _turned_after_all(
    pairs: Sequence[tuple[int, int]],
    kinds: Sequence[str],
    homographies: Sequence[NDArray[np.float64] | None],
    pictures: Sequence[PictureFeatures],
) -> list[str]:
    """Kinds, in which a focal length that is not known does not make a turn look like a plane."""
    size = pictures[0].size
    asked = {
        k: flat
        for k, (kind, flat) in enumerate(zip(kinds, homographies, strict=True))
        if kind in UNSURE and flat is not None and all(pictures[i].size == size for i in pairs[k])
    }
    distance, _ = distance_from_turning(list(asked.values()), size)
    told = list(kinds)
    if distance < FARTHEST_FROM_TURNING:
        for k in asked:
            told[k] = "pure rotation"
    return told


def _again(
    geometry: pycolmap.TwoViewGeometry,
    a: PictureFeatures,
    b: PictureFeatures,
    camera_a: pycolmap.Camera,
    camera_b: pycolmap.Camera,
    options: pycolmap.TwoViewGeometryOptions,
) -> tuple[str, NDArray[np.float64], NDArray[np.float64] | None]:
    """Kind, rotation and homography of a pair from its inliers and the cameras as they are known now."""
    theirs = colmap()
    inliers = np.array(geometry.inlier_matches)
    pixels_a = a.keypoints[inliers[:, 0], :2].astype(np.float64)
    pixels_b = b.keypoints[inliers[:, 1], :2].astype(np.float64)
    same = np.repeat(np.arange(len(inliers), dtype=np.uint32)[:, None], 2, axis=1)
    told = theirs.estimate_calibrated_two_view_geometry(camera_a, pixels_a, camera_b, pixels_b, same, options)
    names = {int(value): name for name, value in theirs.TwoViewGeometryConfiguration.__members__.items()}
    kind = KINDS.get(names.get(int(told.config), ""), "none")
    if kind == "none":
        kind = KINDS.get(names.get(int(geometry.config), ""), "none")
    pose = told.cam2_from_cam1
    if pose is None or kind == "none":
        return kind, np.full(4, np.nan), told.H
    return kind, pose_from_pycolmap(pose)[:4], told.H
