"""The work on one cloud: described, cleaned, thinned, laid on another, cut into planes, meshed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from vision3d.cloud import (
    CloudPlane,
    IcpResult,
    Mesh,
    Ply,
    estimate_normals,
    icp,
    poisson_mesh,
    read_ply,
    remove_outliers,
    segment_planes,
    voxel_downsample,
)
from vision3d.cloud.registration import Method
from vision3d.rigid import transform

__all__ = ["CloudJob", "CloudSettings", "work_on_cloud"]

Array = NDArray[np.float64]
SAMPLE = 5000  # points whose neighbours are looked at to describe a cloud
FEWEST = 10


@dataclass(frozen=True, slots=True)
class CloudSettings:
    """What is to be done, in this order.

    Parameters
    ----------
    clean : remove stragglers
    voxel_m : thin to one point a cube of this side
    onto : a cloud to lay this one on
    method : of ICP
    max_distance_m : farthest apart that a pair of ICP may be
    planes : how many to look for
    plane_m : how far from a plane its points may lie; three times the spacing when missing
    mesh_depth : of a Poisson surface, or None for none
    viewpoint : (3,) where the cloud was seen from, which normals look to
    """

    clean: bool = False
    voxel_m: float | None = None
    onto: Path | None = None
    method: Method = "point-to-plane"
    max_distance_m: float | None = None
    planes: int = 0
    plane_m: float | None = None
    mesh_depth: int | None = None
    viewpoint: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class CloudJob:
    """What was found and made.

    Parameters
    ----------
    name : of the file
    read : the cloud as it was read
    points, colors : what is left after cleaning and thinning, in the file's frame
    dropped_nonfinite : points of the file with NaN or infinity
    stragglers : share of the points that lie far from all others
    spacing_m : median distance of a point to its nearest neighbour
    flatness : median over the points, 1 where surfaces are smooth at the scale of 20 neighbours
    low, high : (3,) box that holds 99 % of the points along each axis
    target : the cloud that this one was laid on
    """

    name: str
    settings: CloudSettings
    read: Ply
    points: Array
    colors: NDArray[np.uint8] | None
    dropped_nonfinite: int
    stragglers: float
    spacing_m: float
    flatness: float
    low: Array
    high: Array
    target: Ply | None = None
    registration: IcpResult | None = None
    planes: tuple[CloudPlane, ...] = ()
    mesh: Mesh | None = None


def work_on_cloud(path: Path, settings: CloudSettings = CloudSettings()) -> CloudJob:
    """Read a cloud and do what is asked.

    Raises
    ------
    DataError
        where the file is missing, no cloud, or has too few points for what is asked.
    """
    cloud, dropped = _finite(read_ply(path))
    if len(cloud.points) < FEWEST:
        raise DataError(f"{path}: it holds {len(cloud.points)} points; expected {FEWEST} at least")
    usual = remove_outliers(cloud.points)
    points, colors = cloud.points, cloud.colors
    if settings.clean:
        points, colors = points[usual], None if colors is None else colors[usual]
    if settings.voxel_m is not None:
        thin = voxel_downsample(points, settings.voxel_m)
        colors = None if colors is None else np.rint(thin.mean(colors)).astype(np.uint8)
        points = thin.points
    spacing, flatness = _described(points)
    target, registration = None, None
    if settings.onto is not None:
        target, _ = _finite(read_ply(settings.onto))
        registration = icp(
            points, target.points, method=settings.method, max_distance_m=settings.max_distance_m
        )  # fmt: skip
    planes: tuple[CloudPlane, ...] = ()
    if settings.planes:
        planes = segment_planes(points, settings.plane_m or 3.0 * spacing, most=settings.planes)
    mesh = None
    if settings.mesh_depth is not None:
        normals = estimate_normals(points, towards=settings.viewpoint).normals
        mesh = poisson_mesh(points, normals, depth=settings.mesh_depth).trimmed(0.05)
    low, high = np.percentile(points, [0.5, 99.5], axis=0)
    return CloudJob(
        Path(path).name, settings, cloud, points, colors, dropped, float(1.0 - usual.mean()),
        spacing, flatness, low, high, target, registration, planes, mesh,
    )  # fmt: skip


def aligned(job: CloudJob) -> Array:
    """The points (N, 3) in the frame of the cloud that they were laid on, or where they were."""
    if job.registration is None:
        return job.points
    return transform(job.registration.target_T_source, job.points)


def _finite(cloud: Ply) -> tuple[Ply, int]:
    """The cloud without points that are no points, and how many those were; its faces go with them."""
    good = np.isfinite(cloud.points).all(axis=1)
    if good.all():
        return cloud, 0
    colors = None if cloud.colors is None else cloud.colors[good]
    scalars = {name: values[good] for name, values in cloud.scalars.items()}
    return Ply(cloud.points[good], colors, None, scalars, None), int((~good).sum())


def _described(points: Array) -> tuple[float, float]:
    """Median distance to the nearest neighbour, and median flatness, over a sample."""
    from scipy.spatial import cKDTree

    some = points[:: max(1, len(points) // SAMPLE)]
    distance, near = cKDTree(points).query(some, min(20, len(points)), workers=-1)
    around = points[near] - points[near].mean(axis=1, keepdims=True)
    values = np.linalg.eigvalsh(np.swapaxes(around, 1, 2) @ around)
    total = np.maximum(values.sum(axis=1), 1e-300)
    return float(np.median(distance[:, 1])), float(
        np.median(1.0 - 3.0 * np.maximum(values[:, 0], 0.0) / total)
    )
