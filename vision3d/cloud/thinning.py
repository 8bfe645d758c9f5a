"""Voxels: a cloud thinned to one point for each cube of space that holds some."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError
from vision3d.cloud.arrays import Array, Backend, beside, checked_backend, checked_points, positive
from vision3d.cloud.with_open3d import open3d

__all__ = ["Voxels", "voxel_downsample"]

MOST_VOXELS_A_SIDE = 2**20


@dataclass(frozen=True, slots=True)
class Voxels:
    """A thinned cloud.

    Parameters
    ----------
    points : (M, 3) mean of the points in each cube
    counts : (M,) how many those are
    voxel_of : (N,) in which cube each point of the whole cloud lies
    """

    points: Array
    counts: NDArray[np.int64]
    voxel_of: NDArray[np.int64]

    def mean(self, values: ArrayLike) -> Array:
        """The mean of a value (N,) or (N, k) over the points of each cube: (M,) or (M, k)."""
        array = np.asarray(values, dtype=np.float64)
        beside(array[..., 0] if array.ndim == 2 else array, self.voxel_of.shape, "values")
        columns = array.reshape(len(array), -1).T
        sums = np.stack([np.bincount(self.voxel_of, column, len(self.counts)) for column in columns], axis=-1)
        means: Array = sums / self.counts[:, None]
        return means.reshape(len(self.counts), *array.shape[1:])


def voxel_downsample(points: ArrayLike, size_m: float, *, backend: Backend = "own") -> Voxels:
    """Thin a cloud.

    Parameters
    ----------
    points : (N, 3)
    size_m : side of a cube
    backend : "own", or "open3d", which orders the cubes in its own way

    Raises
    ------
    DataError
        where the cubes are so small that they could not be counted.
    """
    place, side = checked_points(points), positive(size_m, "size_m")
    if not len(place):
        return Voxels(place, np.empty(0, np.int64), np.empty(0, np.int64))
    low = place.min(axis=0)
    if (np.ptp(place, axis=0) / side).max() >= MOST_VOXELS_A_SIDE:
        raise DataError(
            f"size_m: {side:g} m cuts a cloud {np.ptp(place, axis=0).max():.3g} m wide into over "
            f"{MOST_VOXELS_A_SIDE} cubes a side; take larger cubes or leave far points out"
        )
    if checked_backend(backend):
        return _by_open3d(place, side)
    cube = ((place - low) / side).astype(np.int64)
    key = (cube[:, 0] * MOST_VOXELS_A_SIDE + cube[:, 1]) * MOST_VOXELS_A_SIDE + cube[:, 2]
    _, voxel_of, counts = np.unique(key, return_inverse=True, return_counts=True)
    voxels = Voxels(np.empty((0, 3)), counts, voxel_of.reshape(-1))
    return Voxels(voxels.mean(place), counts, voxels.voxel_of)


def _by_open3d(place: Array, side: float) -> Voxels:
    o3d = open3d()
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(place))
    # open3d shifts its grid by half a cube; from here the grids are the same
    low = place.min(axis=0)
    thin, _, members = cloud.voxel_down_sample_and_trace(side, low, place.max(axis=0) + side)
    voxel_of = np.empty(len(place), np.int64)
    for number, inside in enumerate(members):
        voxel_of[np.asarray(inside)] = number
    return Voxels(np.asarray(thin.points), np.array([len(inside) for inside in members]), voxel_of)
