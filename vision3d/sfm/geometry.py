"""What a reconstruction looks like: angles between rays, flatness, and which way is up."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.manifold.quaternion import quaternion_inverse, rotate
from vision3d.sfm.reconstruction import Reconstruction

__all__ = ["flatness", "triangulation_angles", "upright"]

Array = NDArray[np.float64]
TRIM = 0.9  # share of the points nearest to the middle that decide about a shape


def triangulation_angles(found: Reconstruction) -> Array:
    """(P,) the largest angle at each point between two rays to it, rad."""
    rays = found.points[found.point_index] - found.centres[found.image_index]
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    order = np.argsort(found.point_index, kind="stable")
    lengths = found.track_lengths
    starts = np.concatenate([[0], np.cumsum(lengths)[:-1]]) if len(lengths) else np.zeros(0, dtype=int)
    angles = np.zeros(len(found.points))
    for length in np.unique(lengths[lengths >= 2]):
        mine = np.flatnonzero(lengths == length)
        at = rays[order[starts[mine][:, None] + np.arange(length)]]
        smallest = np.einsum("nik,njk->nij", at, at).min(axis=(1, 2))
        angles[mine] = np.arccos(np.clip(smallest, -1.0, 1.0))
    return angles


def flatness(points: Array) -> float:
    """Thickness of a cloud over its width: 0 for a plane, about 1 for a ball; 1 of fewer than ten points.

    The nine tenths nearest to the middle decide, so that a few stray points do not.
    """
    if len(points) < 10:
        return 1.0
    kept = points
    for _ in range(3):
        apart = kept - np.median(kept, axis=0)
        _, values, axes = np.linalg.svd(apart, full_matrices=False)
        along = np.abs(apart @ axes[2])
        thick = along <= np.quantile(along, TRIM)
        width = np.linalg.norm(apart, axis=1)
        kept = kept[thick & (width <= np.quantile(width, TRIM))]
        if len(kept) < 10:
            break
    values = np.linalg.svd(kept - kept.mean(axis=0), compute_uv=False)
    return float(values[2] / values[1]) if values[1] > 0.0 else 0.0


def upright(found: Reconstruction) -> Array:
    """Rows right, forward, up (3, 3) of a frame to draw in: up is away from the mean of the images' down.

    Photographers hold cameras level more often than not; forward is where the cameras look on the whole.
    """
    world_R_camera = quaternion_inverse(found.cameras_T_world[:, :4])
    down = rotate(world_R_camera, np.tile([0.0, 1.0, 0.0], (len(found), 1))).mean(axis=0)
    look = np.median(found.points, axis=0) - found.centres.mean(axis=0)
    if np.linalg.norm(down) < 1e-3:
        down = np.array([0.0, 1.0, 0.0])
    up = -down / np.linalg.norm(down)
    forward = look - up * (up @ look)
    if np.linalg.norm(forward) < 1e-6 * max(1e-12, float(np.linalg.norm(look))):
        forward = np.linalg.svd(up[None])[2][1]
    forward /= np.linalg.norm(forward)
    return np.array([np.cross(forward, up), forward, up])
