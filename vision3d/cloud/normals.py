"""Normals: the plane through each point and its neighbours, and how flat it is there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vision3d.cloud.arrays import Array, Backend, checked_backend, checked_points
from vision3d.cloud.with_open3d import open3d

__all__ = ["Normals", "estimate_normals"]

AT_ONCE = 40_000  # points whose neighbours are in memory together


@dataclass(frozen=True, slots=True)
class Normals:
    """Normals of a cloud.

    Parameters
    ----------
    normals : (N, 3) unit vectors
    flatness : (N,) 1 where the neighbours lie in a plane, 0 where they scatter alike in every direction
    centres : (N, 3) mean of the neighbours, a place on that plane with less noise than the point itself
    """

    normals: Array
    flatness: Array
    centres: Array


def estimate_normals(
    points: ArrayLike,
    *,
    neighbours: int = 20,
    towards: ArrayLike | None = None,
    backend: Backend = "own",
) -> Normals:
    """The direction in which the neighbours of each point scatter least.

    Parameters
    ----------
    points : (N, 3), at least three
    neighbours : how many points the plane goes through, the point itself among them
    towards : (3,) a place that normals look to, such as the camera's; without one signs are arbitrary

    Notes
    -----
    Flatness is 1 - 3 λ₀ / (λ₀ + λ₁ + λ₂), of the eigenvalues of the neighbours' covariance.
    Hoppe et al. 1992, "Surface reconstruction from unorganized points", section 3.2.
    """
    place = checked_points(points, at_least=3)
    count = min(max(neighbours, 3), len(place))
    normals, flatness, centres = np.empty_like(place), np.empty(len(place)), np.empty_like(place)
    for rows, near in _neighbourhoods(place, count):
        centres[rows] = place[near].mean(axis=1)
        around = place[near] - centres[rows, None]
        values, vectors = np.linalg.eigh(np.swapaxes(around, 1, 2) @ around / count)
        normals[rows] = vectors[:, :, 0]
        total = values.sum(axis=1)
        flatness[rows] = 1.0 - 3.0 * np.maximum(values[:, 0], 0.0) / np.where(total > 0.0, total, 1.0)
    if checked_backend(backend):
        o3d = open3d()
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(place))
        cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(count), fast_normal_computation=False)
        normals = np.array(cloud.normals)
    if towards is not None:
        away = np.einsum("ij,ij->i", normals, np.asarray(towards, dtype=np.float64) - place) < 0.0
        normals[away] *= -1.0
    return Normals(normals, flatness, centres)


def _neighbourhoods(place: Array, count: int) -> Iterator[tuple[slice, NDArray[np.int64]]]:
    """Numbers of the nearest points, some rows at a time."""
    from scipy.spatial import cKDTree

    tree = cKDTree(place)
    for start in range(0, len(place), AT_ONCE):
        rows = slice(start, start + AT_ONCE)
        yield rows, tree.query(place[rows], count, workers=-1)[1]
