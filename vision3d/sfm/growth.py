"""A reconstruction while it grows: which images have a pose, which tracks a point, and what fits."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vision3d.camera import Camera
from vision3d.rigid import inverse, transform
from vision3d.sfm.geometry import triangulation_angles
from vision3d.sfm.reconstruction import Reconstruction
from vision3d.sfm.tracks import Tracks

if TYPE_CHECKING:
    from vision3d.sfm.seeding import PairGeometry

__all__ = ["Growth", "GrowthSettings", "Scene"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Scene:
    """What the images show.

    Parameters
    ----------
    names : of the images
    cameras : each set of intrinsics once, as far as it is known
    camera_of : (V,) which of them took each image
    pixels : of every image its features (N, 2)
    colors : of every image the colours (N, 3) of its features; empty where nobody asks
    calibrate : whether the intrinsics are to be refined
    """

    names: tuple[str, ...]
    cameras: tuple[Camera, ...]
    camera_of: Integers
    pixels: tuple[Array, ...]
    colors: tuple[NDArray[np.uint8], ...] = ()
    calibrate: bool = True

    def camera(self, image: int) -> Camera:
        """The camera of an image, as it was given."""
        return self.cameras[int(self.camera_of[image])]


@dataclass(frozen=True)
class GrowthSettings:
    """Thresholds of the growth.

    Parameters
    ----------
    error_px : residual up to which an observation fits
    angle_rad : widest angle between two rays from which a point is believed
    seed_angle_rad : median angle between the rays of a pair from which it is a good beginning
    least_points : a model of fewer points is none
    least_inliers : an image gets its place from so many points or more
    calibrate_from : intrinsics are refined from so many images on
    rounds : of adjustment and review at the end
    seed : of random draws
    """

    error_px: float = 4.0
    angle_rad: float = np.radians(1.5)
    seed_angle_rad: float = np.radians(8.0)
    least_points: int = 20
    least_inliers: int = 15
    calibrate_from: int = 3
    rounds: int = 3
    seed: int = 0


@dataclass(eq=False)
class Growth:
    """The state; poses and points are NaN until they are known.

    Parameters
    ----------
    scene, tracks, settings : what it grows from
    cameras : as they are known now
    poses : (V, 7) camera_T_world
    points : (T, 3)
    fits : (K,) observations of placed images that agree with their point
    rng : of random draws
    """

    scene: Scene
    tracks: Tracks
    settings: GrowthSettings
    cameras: list[Camera]
    poses: Array
    points: Array
    fits: NDArray[np.bool_]
    rng: np.random.Generator = field(repr=False)

    @classmethod
    def begun(cls, scene: Scene, tracks: Tracks, settings: GrowthSettings, pair: PairGeometry) -> Growth:
        """Two images with their poses, and nothing else."""
        poses = np.full((len(scene.names), 7), np.nan)
        poses[pair.a], poses[pair.b] = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], pair.view.b_T_a
        return cls(
            scene, tracks, settings, list(scene.cameras), poses, np.full((tracks.count, 3), np.nan),
            np.zeros(len(tracks.images), dtype=bool), np.random.default_rng(settings.seed),
        )  # fmt: skip

    @property
    def placed(self) -> list[int]:
        """Images that have a pose."""
        return np.flatnonzero(np.isfinite(self.poses[:, 0])).tolist()

    @property
    def size(self) -> tuple[int, int]:
        """Images and points: the larger of two models is the better."""
        return len(self.placed), int(np.isfinite(self.points[:, 0]).sum())

    def camera(self, image: int) -> Camera:
        """The camera of an image, as it is known now."""
        return self.cameras[int(self.scene.camera_of[image])]

    def errors(self) -> Array:
        """(K,) distance of every observation from its prediction, px; inf where there is none."""
        tracks, errors = self.tracks, np.full(len(self.tracks.images), np.inf)
        for image in self.placed:
            mine = np.flatnonzero((tracks.images == image) & np.isfinite(self.points[tracks.tracks, 0]))
            seen = self.camera(image).project(transform(self.poses[image], self.points[tracks.tracks[mine]]))
            off = np.hypot(*(tracks.pixels[mine] - seen).T)
            errors[mine] = np.where(np.isfinite(off), off, np.inf)
        return errors

    def review(self) -> None:
        """Look again at what fits; points held by fewer than two observations, or by narrow rays, go."""
        self.fits = self.errors() <= self.settings.error_px
        often = np.bincount(self.tracks.tracks[self.fits], minlength=self.tracks.count)
        self._drop(often < 2)
        chosen = self._chosen()
        angles = np.zeros(self.tracks.count)
        angles[chosen] = triangulation_angles(self.reconstruction())
        self._drop(angles < self.settings.angle_rad)

    def _drop(self, gone: NDArray[np.bool_]) -> None:
        self.points[gone] = np.nan
        self.fits &= ~gone[self.tracks.tracks]

    def _chosen(self) -> Integers:
        """Tracks that have a point, in the order of the reconstruction's points."""
        return np.flatnonzero(np.isfinite(self.points[:, 0]))

    def reconstruction(self) -> Reconstruction:
        """Placed images, points, and the observations that fit."""
        scene, tracks, placed, chosen = self.scene, self.tracks, self.placed, self._chosen()
        row = np.full(len(scene.names), -1)
        row[placed] = np.arange(len(placed))
        number = np.full(tracks.count, -1)
        number[chosen] = np.arange(len(chosen))
        kept = np.flatnonzero(self.fits & (row[tracks.images] >= 0) & (number[tracks.tracks] >= 0))
        cameras, camera_of = np.unique(scene.camera_of[placed], return_inverse=True)
        return Reconstruction(
            cameras=tuple(self.cameras[c] for c in cameras),
            names=tuple(scene.names[i] for i in placed),
            camera_of=camera_of,
            cameras_T_world=self.poses[placed],
            points=self.points[chosen],
            colors=self._colors(chosen, kept, number),
            image_index=row[tracks.images[kept]],
            point_index=number[tracks.tracks[kept]],
            pixels=tracks.pixels[kept],
        )

    def _colors(self, chosen: Integers, kept: Integers, number: Integers) -> NDArray[np.uint8]:
        """The mean colour of every point's observations; grey where there is none."""
        if not self.scene.colors:
            return np.full((len(chosen), 3), 128, dtype=np.uint8)
        tracks, sums = self.tracks, np.zeros((len(chosen), 3))
        for image in self.placed:
            mine = kept[tracks.images[kept] == image]
            np.add.at(sums, number[tracks.tracks[mine]], self.scene.colors[image][tracks.features[mine]])
        often = np.bincount(number[tracks.tracks[kept]], minlength=len(chosen))
        return np.rint(sums / np.maximum(often, 1)[:, None]).astype(np.uint8)

    def take(self, found: Reconstruction) -> None:
        """Take over what an adjustment moved: `found` has the images and points of `reconstruction`."""
        placed, chosen = self.placed, self._chosen()
        self.poses[placed] = found.cameras_T_world
        self.points[chosen] = found.points
        for camera, c in zip(found.cameras, np.unique(self.scene.camera_of[placed]), strict=True):
            self.cameras[int(c)] = camera

    def centres(self) -> Array:
        """(V, 3) of the cameras; NaN where an image has no pose."""
        return inverse(self.poses)[:, 4:]
