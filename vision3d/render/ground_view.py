"""What a small camera on a robot sees of a line on the ground, a thousand times a second and more.

`render_ground` photographs any textured plane through any lens; here the camera never moves on its robot, so
each pixel keeps its point of the ground (the inverse homography) and only the robot's pose changes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, ShapeError
from vision3d.lines.ground import GroundHomography
from vision3d.lines.mount import CameraMount
from vision3d.render.ground import GroundLine
from vision3d.render.scene import EXPOSURE

if TYPE_CHECKING:
    from vision3d.camera import Camera

__all__ = ["GroundView"]

Array = NDArray[np.float64]
Image = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class GroundView:
    """A camera that sits still on a robot and looks at the ground.

    Attributes
    ----------
    camera, mount : the lens, and where it hangs
    centres : (h, w, 2) point of the ground under the middle of each pixel, in the robot's frame, m; NaN where
        the pixel looks above the horizon
    sides : (h, w, 2, 2) the two sides of what each pixel covers there: from left to right, from top to bottom
    reach : (h, 2) least and largest x of the ground that each row shows
    """

    camera: Camera
    mount: CameraMount
    centres: Array = field(init=False)
    sides: Array = field(init=False)
    reach: Array = field(init=False)

    def __post_init__(self) -> None:
        width, height = self.camera.size
        ground = GroundHomography.from_camera(self.camera, self.mount)

        def under(right: float, down: float) -> Array:
            u, v = np.meshgrid(np.arange(width) + right, np.arange(height) + down)
            return ground.to_ground(np.column_stack([u.ravel(), v.ravel()])).xy.reshape(height, width, 2)

        across = under(0.5, 0.0) - under(-0.5, 0.0)
        down = under(0.0, 0.5) - under(0.0, -0.5)
        self._keep("centres", under(0.0, 0.0))
        self._keep("sides", np.stack([across, down], axis=2))
        x, spread = self.centres[..., 0], 0.5 * np.abs(self.sides[..., 0]).sum(axis=2)
        low = np.min(np.where(np.isnan(x), np.inf, x - spread), axis=1)
        high = np.max(np.where(np.isnan(x), -np.inf, x + spread), axis=1)
        self._keep("reach", np.column_stack([low, high]))

    def _keep(self, name: str, array: Array) -> None:
        array = np.ascontiguousarray(array)
        array.setflags(write=False)
        object.__setattr__(self, name, array)

    def radiance(self, line: GroundLine, poses: ArrayLike) -> Array:
        """What falls on each pixel (h, w), reflectance 0-1.

        Parameters
        ----------
        line : the stripe and its ground
        poses : (3,) x, y, heading of the robot; or (k, 3) of k moments while the shutter is open, whose mean
            is the motion blur

        Raises
        ------
        ShapeError
            where the poses have another shape, or are not finite.
        """
        from vision3d.kernels.ground_view import stripe_view

        places = np.atleast_2d(np.ascontiguousarray(poses, dtype=np.float64))
        if places.ndim != 2 or places.shape[1] != 3 or not len(places) or not np.isfinite(places).all():
            raise ShapeError(
                f"poses of a robot are (3,) or (k, 3), x y heading, finite; got {np.shape(poses)}"
            )
        image = np.empty(self.centres.shape[:2])
        n = len(line.points)
        stripe_view(
            self.centres, self.sides, self.reach, line.points, places, 0.5 * line.width_m,
            np.array([line.ink, line.floor]), np.empty((n, 4)), np.empty(n, np.int64), image,
        )  # fmt: skip
        return image

    def image(
        self,
        line: GroundLine,
        poses: ArrayLike,
        *,
        rng: np.random.Generator | None = None,
        noise: float = 0.0,
        exposure: float = EXPOSURE,
    ) -> Image:
        """The image (h, w) of 8 bits that the camera takes.

        Parameters
        ----------
        rng : for the noise; None for none
        noise : grey levels, standard deviation of what the sensor adds to every pixel
        exposure : grey level of reflectance 1

        Raises
        ------
        ModelError
            for a noise below zero.
        ShapeError
        """
        if not noise >= 0:
            raise ModelError(f"the noise of a camera is zero or more grey levels; got {noise}")
        grey = (exposure * self.radiance(line, poses)).astype(np.float32)
        if rng is not None and noise > 0:
            grey += np.float32(noise) * rng.standard_normal(grey.shape, dtype=np.float32)
        image: Image = np.clip(grey + np.float32(0.5), 0.0, 255.0).astype(np.uint8)
        return image
