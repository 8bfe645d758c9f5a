"""What structure from motion gives: cameras, their poses, points, and which pixel saw which point.

    model = reconstruct("photos/")
    model.cameras_T_world            # (V, 7), one pose a picture that has its place
    model.points, model.colors       # (P, 3), (P, 3)
    model.residuals()                # (K, 2) px, measured minus predicted
    model.missing                    # ((name, reason), ...) of pictures without a place

The scale of the world is free unless something fixed it: lengths are in the unit of the points, and the
poses' frame is whatever the mapper chose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import NotFiniteError, ShapeError
from vision3d.camera import Camera
from vision3d.rigid import inverse, transform

if TYPE_CHECKING:
    from vision3d.sfm.view_graph import ViewGraph

__all__ = ["Reconstruction"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """Cameras and points of a set of pictures; arrays are read-only.

    Parameters
    ----------
    cameras : each set of intrinsics once
    names : (V,) of the pictures that have a pose
    camera_of : (V,) which of the cameras took each
    cameras_T_world : (V, 7) `qw qx qy qz px py pz`; pixels of picture v see `camera_T_world * point`
    points : (P, 3) in the world
    colors : (P, 3) uint8, red green blue
    image_index : (K,) which picture an observation is of
    point_index : (K,) which point it saw
    pixels : (K, 2) where; the centre of the top-left pixel is (0, 0)
    sigma_px : standard deviation of a coordinate, as the residuals tell it
    missing : (name, reason) of every picture without a pose
    models : COLMAP's names of the cameras' models, which say whether fx and fy are one number
    graph : which pictures were matched with which, where that is known

    Raises
    ------
    ShapeError
        where arrays disagree in length, or an index names nothing.
    NotFiniteError
        for NaN or infinity in poses, points or pixels.
    """

    cameras: tuple[Camera, ...]
    names: tuple[str, ...]
    camera_of: Index
    cameras_T_world: Array
    points: Array
    colors: NDArray[np.uint8]
    image_index: Index
    point_index: Index
    pixels: Array
    sigma_px: float = 1.0
    missing: tuple[tuple[str, str], ...] = ()
    models: tuple[str, ...] = ()
    graph: ViewGraph | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        views, count = len(self.names), len(self.points)
        shapes: dict[str, tuple[type, tuple[int, ...]]] = {
            "camera_of": (np.int64, (views,)),
            "cameras_T_world": (np.float64, (views, 7)),
            "points": (np.float64, (count, 3)),
            "colors": (np.uint8, (count, 3)),
            "image_index": (np.int64, (len(self.pixels),)),
            "point_index": (np.int64, (len(self.pixels),)),
            "pixels": (np.float64, (len(self.pixels), 2)),
        }
        for name, (kind, shape) in shapes.items():
            array: NDArray[Any] = np.array(getattr(self, name), dtype=kind)
            if array.size == 0:
                array = array.reshape(shape)
            if array.shape != shape:
                raise ShapeError(f"{name} of a reconstruction is an array {shape}, got {array.shape}")
            if not np.isfinite(array).all():
                raise NotFiniteError(f"{name} of a reconstruction holds NaN or infinity")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        limits = (
            ("camera_of", len(self.cameras), "cameras"),
            ("image_index", views, "pictures"),
            ("point_index", count, "points"),
        )
        for name, limit, what in limits:
            index = getattr(self, name)
            if len(index) and (index.min() < 0 or index.max() >= limit):
                raise ShapeError(f"{name} names one of {limit} {what}, got {index.min()} to {index.max()}")

    def __len__(self) -> int:
        """Number of pictures that have a pose."""
        return len(self.names)

    @property
    def centres(self) -> Array:
        """(V, 3) where the cameras were, in the world."""
        return inverse(self.cameras_T_world)[:, 4:]

    def camera(self, view: int) -> Camera:
        """The camera that took a picture."""
        return self.cameras[int(self.camera_of[view])]

    def points_in_cameras(self) -> Array:
        """(K, 3) the point of every observation, in the frame of the camera that made it."""
        return transform(self.cameras_T_world[self.image_index], self.points[self.point_index])

    def projected(self) -> Array:
        """(K, 2) where every observation is predicted; NaN behind the camera."""
        inside, of = self.points_in_cameras(), self.camera_of[self.image_index]
        predicted = np.full((len(of), 2), np.nan)
        for k, camera in enumerate(self.cameras):
            mine = of == k
            if mine.any():
                predicted[mine] = camera.project(inside[mine])
        return predicted

    def residuals(self) -> Array:
        """(K, 2) measured minus predicted, px."""
        return self.pixels - self.projected()

    def errors_px(self) -> Array:
        """(K,) length of every residual."""
        lengths: Array = np.hypot(*self.residuals().T)
        return lengths

    @property
    def rms_px(self) -> float:
        """Root of the mean squared length of the residuals, px."""
        errors = self.errors_px()
        return float(np.sqrt(np.nanmean(errors**2))) if len(errors) else float("nan")

    @property
    def mean_error_px(self) -> float:
        """COLMAP's mean reprojection error: of every point the mean over its track, then over points, px."""
        lengths = self.track_lengths
        if not len(self.pixels):
            return float("nan")
        sums = np.bincount(self.point_index, weights=self.errors_px(), minlength=len(self.points))
        return float(np.mean(sums[lengths > 0] / lengths[lengths > 0]))

    @property
    def track_lengths(self) -> Index:
        """(P,) how many pictures see each point."""
        return np.bincount(self.point_index, minlength=len(self.points)).astype(np.int64)

    @property
    def observations_of(self) -> Index:
        """(V,) how many points each picture sees."""
        return np.bincount(self.image_index, minlength=len(self.names)).astype(np.int64)

    def replaced(self, **changes: Any) -> Reconstruction:
        """The same with some fields changed."""
        return Reconstruction(**{one.name: getattr(self, one.name) for one in fields(self)} | changes)

    def selected(self, observations: Sequence[int] | NDArray[Any]) -> Reconstruction:
        """Only these observations (indices or mask), and the points that two pictures still see."""
        chosen = np.zeros(len(self.pixels), dtype=bool)
        chosen[np.asarray(observations)] = True
        lengths = np.bincount(self.point_index[chosen], minlength=len(self.points))
        kept = lengths >= 2
        chosen &= kept[self.point_index]
        number = np.cumsum(kept) - 1
        return self.replaced(
            points=self.points[kept],
            colors=self.colors[kept],
            image_index=self.image_index[chosen],
            point_index=number[self.point_index[chosen]],
            pixels=self.pixels[chosen],
        )
