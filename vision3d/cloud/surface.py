"""A closed surface through a cloud with normals: Poisson reconstruction, by open3d."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError
from vision3d.cloud.arrays import Array, beside, checked_points
from vision3d.cloud.with_open3d import open3d

__all__ = ["Mesh", "poisson_mesh"]

MOST_DEPTH = 14


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles in space.

    Parameters
    ----------
    points : (V, 3) corners
    faces : (F, 3) numbers of corners
    density : (V,) how many points of the cloud support a corner (log2): low where the surface is made up
    """

    points: Array
    faces: NDArray[np.int64]
    density: Array

    def trimmed(self, share: float) -> Mesh:
        """Without the share of corners that have the least support, and the faces that touch them."""
        kept = self.density >= np.quantile(self.density, share)
        number = np.cumsum(kept) - 1
        faces = self.faces[kept[self.faces].all(axis=1)]
        return Mesh(self.points[kept], number[faces], self.density[kept])


def poisson_mesh(points: ArrayLike, normals: ArrayLike, *, depth: int = 8) -> Mesh:
    """Screened Poisson surface (Kazhdan, Hoppe 2013).

    Parameters
    ----------
    points : (N, 3)
    normals : (N, 3) that look outwards: give `estimate_normals` the camera's place
    depth : of the octree; a cube has 2^-depth of the cloud's width

    Raises
    ------
    ToolMissingError
        where open3d is not installed or cannot be loaded.
    """
    place = checked_points(points, at_least=10)
    if not 1 <= depth <= MOST_DEPTH:
        raise ModelError(f"depth: expected 1 to {MOST_DEPTH}, got {depth}")
    outward = beside(normals, place.shape, "normals").astype(np.float64)
    o3d = open3d()
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(place))
    cloud.normals = o3d.utility.Vector3dVector(outward)
    # one thread: with several, vertices come out in another order each time
    mesh, density = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(cloud, depth=depth, n_threads=1)
    return Mesh(np.array(mesh.vertices), np.array(mesh.triangles, dtype=np.int64), np.array(density))
