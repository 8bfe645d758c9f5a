"""Points of space from depth images: of a stereo pair, or of an RGB-D camera.

points = back_project(depth_m, camera)              # (h, w, 3), NaN where there is no depth
cloud = cloud_of(depth_m, camera, image)            # points (N, 3), colours (N, 3), pixels (N, 2)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError, ShapeError
from vision3d.camera import Camera
from vision3d.stereo.depth import Depth

__all__ = ["DepthCloud", "back_project", "cloud_of"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class DepthCloud:
    """Points of the camera's frame, in the order of the pixels; arrays are read-only.

    Attributes
    ----------
    points : (N, 3) m
    colors : (N, 3) uint8 red green blue, or None
    std_m : (N,) standard deviation along the ray's depth, or None
    pixels : (N, 2) int64 columns and rows
    """

    points: Array
    colors: NDArray[np.uint8] | None
    std_m: NDArray[np.float32] | None
    pixels: NDArray[np.int64]

    def __post_init__(self) -> None:
        for array in (self.points, self.colors, self.std_m, self.pixels):
            if array is not None:
                array.setflags(write=False)

    def __len__(self) -> int:
        return len(self.points)


def back_project(
    depth: Depth | Any,
    camera: Camera,
    *,
    unit_m: float = 1.0,
    backend: Literal["own", "open3d"] = "own",
) -> Array:
    """Points (h, w, 3) of the camera's frame, NaN where there is no depth (0, NaN or infinity).

    Parameters
    ----------
    depth : (h, w) depth along the optical axis, of a stereo pair or an RGB-D camera, in units of `unit_m`
    camera : of any lens; its size is the image's
    unit_m : what 1 means: 0.001 for the 16-bit images of most RGB-D cameras, 0.0002 for TUM's
    backend : `open3d` has open3d do it (a pinhole camera only), where that is installed

    Raises
    ------
    ShapeError
        where the image has another size than the camera.
    ModelError
        where the unit is not positive, or open3d is asked about a distorted lens.
    ToolMissingError
        where open3d is asked for and missing.
    """
    z = _metres(depth, unit_m)
    height, width = z.shape
    if (width, height) != camera.size:
        raise ShapeError(
            f"the depth image is {width}x{height} px and the camera {camera.size[0]}x{camera.size[1]}; take "
            "the camera of the depth image, or camera.resized"
        )
    if backend == "open3d":
        return _with_open3d(z, camera)
    columns, rows = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
    plane = camera.undistort_points(np.stack([columns, rows], axis=-1))
    return np.concatenate([plane * z[..., None], z[..., None]], axis=-1)


def cloud_of(
    depth: Depth | Any,
    camera: Camera,
    image: Any = None,
    *,
    unit_m: float = 1.0,
    most_m: float = np.inf,
    measured_only: bool = True,
) -> DepthCloud:
    """Points with a depth, and the colour of their pixels.

    Parameters
    ----------
    image : (h, w) grey or (h, w, 3) BGR uint8, of the same pixels
    most_m : points farther than this are left out
    measured_only : leave out what a stereo depth has filled in
    """
    z = _metres(depth, unit_m)
    points = back_project(z, camera)
    keep = np.isfinite(points).all(axis=-1) & (z <= most_m)
    if isinstance(depth, Depth) and measured_only:
        keep &= depth.measured
    rows, columns = np.nonzero(keep)
    colors = None
    if image is not None:
        picture = np.asarray(image)
        if picture.shape[:2] != z.shape:
            raise ShapeError(
                f"the picture is {picture.shape[:2]} and the depth image {z.shape}, rows by columns"
            )
        picture = picture.reshape(*z.shape, -1)
        colors = np.broadcast_to(picture[rows, columns][:, ::-1], (len(rows), 3)).copy()
    std = depth.total_std_m[rows, columns] if isinstance(depth, Depth) else None
    return DepthCloud(points[rows, columns], colors, std, np.column_stack([columns, rows]).astype(np.int64))


def _metres(depth: Any, unit_m: float) -> Array:
    """Depth (h, w) in metres, NaN where there is none."""
    if not unit_m > 0.0:
        raise ModelError(f"the unit of a depth image is positive, got {unit_m:g} m")
    z = np.array(depth.z_m if isinstance(depth, Depth) else depth, dtype=np.float64)
    if z.ndim != 2:
        raise ShapeError(f"a depth image is (h, w), got shape {z.shape}")
    z *= unit_m
    with np.errstate(invalid="ignore"):
        z[~((z > 0.0) & np.isfinite(z))] = np.nan
    return z


def _with_open3d(z: Array, camera: Camera) -> Array:
    """The same by open3d, which gives its points without their pixels."""
    from vision3d.cloud.with_open3d import open3d

    if camera.distortion.any():
        raise ModelError(
            "open3d back-projects pinhole images only; undistort them first, or use backend='own'"
        )
    o3d = open3d()
    intrinsics = o3d.camera.PinholeCameraIntrinsic(*camera.size, *camera.intrinsics)
    held = np.nan_to_num(z).astype(np.float32)
    cloud = o3d.geometry.PointCloud.create_from_depth_image(
        o3d.geometry.Image(held), intrinsics, depth_scale=1.0, depth_trunc=1e9, project_valid_depth_only=False
    )
    return np.asarray(cloud.points, dtype=np.float64).reshape(*z.shape, 3)
