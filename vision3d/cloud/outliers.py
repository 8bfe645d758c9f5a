"""Outliers of a cloud: points with too few others around them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vision3d.cloud.arrays import Array, Backend, checked_backend, checked_points, positive
from vision3d.cloud.with_open3d import open3d

__all__ = ["outliers_by_radius", "remove_outliers"]


def remove_outliers(
    points: ArrayLike, *, neighbours: int = 20, deviations: float = 2.0, backend: Backend = "own"
) -> NDArray[np.bool_]:
    """Which points to keep: those as near to their neighbours as is usual in this cloud.

    Parameters
    ----------
    points : (N, 3)
    neighbours : over how many the distance of a point is averaged, the point itself among them
    deviations : how many standard deviations above the mean of all averages is still usual

    Returns
    -------
    Array
        (N,) bool.

    Notes
    -----
    Rusu et al. 2008, "Towards 3D point cloud based object maps for household environments".
    """
    place = checked_points(points)
    if len(place) <= 2:
        return np.ones(len(place), dtype=bool)
    count = min(max(neighbours, 2), len(place))
    if checked_backend(backend):
        o3d = open3d()
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(place))
        kept = np.zeros(len(place), dtype=bool)
        kept[np.asarray(cloud.remove_statistical_outlier(count, deviations)[1])] = True
        return kept
    far = _distances(place, count).mean(axis=1)
    return np.asarray(far <= far.mean() + deviations * far.std(ddof=1))


def outliers_by_radius(
    points: ArrayLike, radius_m: float, *, at_least: int = 4, backend: Backend = "own"
) -> NDArray[np.bool_]:
    """Which points to keep, (N,) bool: those with more than `at_least` others nearer than a radius."""
    place, radius = checked_points(points), positive(radius_m, "radius_m")
    if checked_backend(backend):
        o3d = open3d()
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(place))
        kept = np.zeros(len(place), dtype=bool)
        kept[np.asarray(cloud.remove_radius_outlier(at_least, radius)[1], dtype=np.int64)] = True
        return kept
    if len(place) <= at_least + 1:
        return np.zeros(len(place), dtype=bool)
    return np.asarray(_distances(place, at_least + 2)[:, -1] < radius)


def _distances(place: Array, count: int) -> Array:
    """(N, count) distances to the nearest points, the point itself first."""
    from scipy.spatial import cKDTree

    distances: Array = cKDTree(place).query(place, count, workers=-1)[0]
    return distances
