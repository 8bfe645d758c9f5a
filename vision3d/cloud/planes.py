"""Planes of a cloud, the largest first, each by RANSAC on what the ones before have left."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import UnderConstrainedError
from vision3d.cloud.arrays import Array, Backend, checked_backend, checked_points, positive
from vision3d.cloud.with_open3d import open3d

__all__ = ["CloudPlane", "fit_cloud_plane", "segment_planes"]

SEED = 0
ITERATIONS = 2000


@dataclass(frozen=True, slots=True)
class CloudPlane:
    """A plane n · p + d = 0 through some points of a cloud.

    Parameters
    ----------
    normal : (3,) unit vector that looks to the origin, where a camera is
    offset_m : d, the distance of the origin
    inliers : (K,) numbers of its points
    rms_m : how far these lie from it
    tilt_std_rad : standard deviation of the direction of the normal, along its worse axis
    offset_std_m : of the distance from the centre of its points
    """

    normal: Array
    offset_m: float
    inliers: NDArray[np.int64]
    rms_m: float
    tilt_std_rad: float
    offset_std_m: float

    def distance(self, points: ArrayLike) -> Array:
        """(N,) signed distance of points (N, 3): positive on the side of the origin."""
        return np.asarray(points, dtype=np.float64) @ self.normal + self.offset_m


def segment_planes(
    points: ArrayLike,
    distance_m: float,
    *,
    most: int = 5,
    fewest_points: int | None = None,
    backend: Backend = "own",
    rng: np.random.Generator | None = None,
) -> tuple[CloudPlane, ...]:
    """Find planes one after the other.

    Parameters
    ----------
    points : (N, 3)
    distance_m : how far from a plane its points may lie
    most : how many planes to look for
    fewest_points : that a plane must have; 2 % of the cloud when missing
    backend : whose RANSAC, "own" or "open3d"
    rng : of the samples; a fixed seed when missing
    """
    place, limit = checked_points(points), positive(distance_m, "distance_m")
    least = max(3, fewest_points if fewest_points is not None else round(0.02 * len(place)))
    generator = rng or np.random.default_rng(SEED)
    left, planes = np.arange(len(place)), list[CloudPlane]()
    while len(planes) < most and len(left) >= least:
        inliers = _largest(place[left], limit, generator, by_open3d=checked_backend(backend))
        if inliers.sum() < least:
            break
        planes.append(fit_cloud_plane(place, left[inliers]))
        left = left[~inliers]
    return tuple(planes)


def fit_cloud_plane(points: Array, inliers: NDArray[np.int64]) -> CloudPlane:
    """The plane nearest to some of the points (total least squares), and how sure it is."""
    own = points[inliers]
    centre = own.mean(axis=0)
    values, vectors = np.linalg.eigh((own - centre).T @ (own - centre))
    normal = vectors[:, 0] if vectors[:, 0] @ centre <= 0.0 else -vectors[:, 0]
    freedom = max(len(own) - 3, 1)
    variance = max(float(values[0]), 0.0) / freedom
    tilt = float(np.sqrt(variance / max(float(values[1]), 1e-300)))
    return CloudPlane(
        normal, float(-normal @ centre), inliers, float(np.sqrt(max(float(values[0]), 0.0) / len(own))),
        tilt, float(np.sqrt(variance / len(own))),
    )  # fmt: skip


def _largest(place: Array, limit: float, rng: np.random.Generator, *, by_open3d: bool) -> NDArray[np.bool_]:
    """Which points lie on the plane that has most of them."""
    if by_open3d:
        o3d = open3d()
        o3d.utility.random.seed(int(rng.integers(2**31)))
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(place))
        kept = np.zeros(len(place), dtype=bool)
        kept[np.asarray(cloud.segment_plane(limit, 3, ITERATIONS)[1], dtype=np.int64)] = True
        return kept
    from vision3d.robust import RansacSettings, fit_plane

    try:
        return fit_plane(place, RansacSettings(threshold=limit, max_iterations=ITERATIONS), rng=rng).inliers
    except UnderConstrainedError:  # what is left is a point, or lies on a line
        return np.zeros(len(place), dtype=bool)
