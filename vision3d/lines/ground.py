"""From pixels to metres on the ground, and how sure the metres are.

The ground is the plane z = 0 of the robot's frame, x forward and y to the left.  A homography takes what the
camera sees (pixels, or rays where the lens is known) to it; its covariance is carried along, so that every
point on the ground has one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, ShapeError
from vision3d.lines.homography import fit_homography
from vision3d.lines.mount import CameraMount, plane_homography
from vision3d.lines.settings import LineReading

if TYPE_CHECKING:
    from vision3d.camera import Camera

__all__ = ["GroundHomography", "GroundPoints", "GroundReading"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class GroundPoints:
    """Points on the ground.

    Attributes
    ----------
    xy : (N, 2) m, x forward and y to the left; NaN at the horizon and above
    cov : (N, 2, 2) m²
    """

    xy: Array
    cov: Array

    @property
    def sigma_m(self) -> Array:
        """Standard deviation (N,) in the direction in which it is largest, m; inf where there is no place."""
        largest = np.full(len(self.cov), np.inf)
        known = np.isfinite(self.cov).all(axis=(1, 2))
        largest[known] = np.sqrt(np.linalg.eigvalsh(self.cov[known])[:, 1])
        return largest


@dataclass(frozen=True, slots=True, eq=False)
class GroundReading:
    """The line in front of a robot, in metres.

    Attributes
    ----------
    near, far : (2,) where the middle of the line lies, at the lowest row and at the row that looks ahead
    offset_m : how far to the left of the robot's axis the near point is
    heading_rad : of the line from near to far, positive to the left
    cov : (2, 2) covariance of offset and heading: m, rad
    """

    near: Array
    far: Array
    offset_m: float
    heading_rad: float
    cov: Array


@dataclass(frozen=True, slots=True, eq=False)
class GroundHomography:
    """The map from an image to the ground.

    Attributes
    ----------
    ground_H_image : (3, 3) takes (x, y, 1) to homogeneous ground coordinates: x, y are pixels, or normalised
        coordinates (x/z, y/z) where `camera` is given; its third row is positive on the ground
    cov : (9, 9) covariance of its elements, row by row; the scale is free and does not count
    camera : whose lens is taken off first; None where pixels are taken as they are
    camera_cov : (p, p) covariance of the camera's parameters, from its calibration
    rms_px : of the points that it was fitted to; NaN where there were none to spare
    """

    ground_H_image: Array
    cov: Array
    camera: Camera | None = None
    camera_cov: Array | None = None
    rms_px: float = float("nan")

    @classmethod
    def from_points(
        cls,
        pixels: ArrayLike,
        ground: ArrayLike,
        *,
        camera: Camera | None = None,
        sigma_px: float = 0.5,
        sigma_m: float = 0.0,
    ) -> GroundHomography:
        """Fit it to four or more points of the ground whose places are known.

        Parameters
        ----------
        pixels : (N, 2) where they are seen
        ground : (N, 2) where they are, m
        camera : takes off the lens first; without it the image must be free of distortion
        sigma_px, sigma_m : how well pixels and places are known

        Raises
        ------
        ShapeError, DataError
            for fewer than four points, or where three of the only four lie on a line.
        """
        seen, places = np.asarray(pixels, dtype=np.float64), np.asarray(ground, dtype=np.float64)
        if seen.ndim != 2 or seen.shape[1:] != (2,) or seen.shape != places.shape:
            raise ShapeError(
                "expected pixels and ground points (N, 2), as many of each; "
                f"got {seen.shape} and {places.shape}"
            )
        fitted = fit_homography(seen, places, camera, sigma_px, sigma_m)
        return cls(fitted.ground_H_image, fitted.cov, camera, None, fitted.rms_px)

    @classmethod
    def from_camera(
        cls,
        camera: Camera,
        mount: CameraMount | ArrayLike,
        cov: ArrayLike | None = None,
        *,
        camera_cov: ArrayLike | None = None,
    ) -> GroundHomography:
        """Take it from where the camera hangs.

        Parameters
        ----------
        mount : height and angles, or the pose robot_T_camera (7,)
        cov : (6, 6) of that pose: right exponential, rotation then translation, rad and m
        camera_cov : (p, p) of the parameters of the camera

        Raises
        ------
        ShapeError
            where a covariance has another size.
        """
        pose = mount.pose if isinstance(mount, CameraMount) else np.asarray(mount, dtype=np.float64)
        sigma = np.zeros((6, 6)) if cov is None else np.asarray(cov, dtype=np.float64)
        lens = None if camera_cov is None else np.asarray(camera_cov, dtype=np.float64)
        if pose.shape != (7,) or sigma.shape != (6, 6):
            raise ShapeError(
                f"expected a pose (7,) and its covariance (6, 6); got {pose.shape}, {sigma.shape}"
            )
        if lens is not None and lens.shape != (camera.count, camera.count):
            raise ShapeError(
                f"camera_cov must be ({camera.count}, {camera.count}) for {camera.lens}, got {lens.shape}"
            )
        H, jacobian = plane_homography(pose)
        return cls(H, jacobian @ sigma @ jacobian.T, camera, lens)

    def to_ground(self, pixels: ArrayLike, cov_px: float | ArrayLike = 0.0) -> GroundPoints:
        """Places on the ground of pixels (N, 2).

        Parameters
        ----------
        cov_px : covariance of the pixels: a standard deviation in px for all, or (N, 2, 2) px²
        """
        seen = np.atleast_2d(np.asarray(pixels, dtype=np.float64))
        own = np.asarray(cov_px, dtype=np.float64)
        spread = np.broadcast_to(own**2 * np.eye(2) if own.ndim == 0 else own, (len(seen), 2, 2))
        xy, d_pixel, d_H, d_lens = self._derivatives(seen)
        cov = d_pixel @ spread @ d_pixel.transpose(0, 2, 1) + d_H @ self.cov @ d_H.transpose(0, 2, 1)
        if self.camera_cov is not None:
            cov = cov + d_lens @ self.camera_cov @ d_lens.transpose(0, 2, 1)
        return GroundPoints(xy, cov)

    def to_image(self, ground: ArrayLike) -> Array:
        """Pixels (N, 2) of places (N, 2) on the ground; NaN behind the camera."""
        places = np.atleast_2d(np.asarray(ground, dtype=np.float64))
        homogeneous = np.column_stack([places, np.ones(len(places))]) @ np.linalg.inv(self.ground_H_image).T
        homogeneous[homogeneous[:, 2] <= 0] = np.nan
        if self.camera is None:
            return np.asarray(homogeneous[:, :2] / homogeneous[:, 2:])
        return self.camera.project(homogeneous)

    def read(self, reading: LineReading) -> GroundReading:
        """A reading of the line in metres, with the covariance of offset and heading.

        Raises
        ------
        DataError
            where the reading has no line, or looks at the horizon.
        """
        if not reading.found:
            raise DataError(f"there is no line to put on the ground: {reading.reason}")
        seen = np.array([reading.bottom_px, reading.middle_px])
        xy, d_pixel, d_H, d_lens = self._derivatives(seen)
        if not np.isfinite(xy).all():
            raise DataError("the row that looks ahead shows the horizon; let `middle` be a lower row")
        # both ends at once: they share the homography and the lens
        across = np.zeros((4, 2))
        across[:2, 0], across[2:, 1] = d_pixel[0, :, 0], d_pixel[1, :, 0]
        both = across @ reading.cov_px @ across.T
        wide = np.vstack([d_H[0], d_H[1]])
        both += wide @ self.cov @ wide.T
        if self.camera_cov is not None:
            lens = np.vstack([d_lens[0], d_lens[1]])
            both += lens @ self.camera_cov @ lens.T
        step = xy[1] - xy[0]
        square = float(step @ step)
        bend = np.array([-step[1], step[0]]) / square
        jacobian = np.array([[0.0, 1.0, 0.0, 0.0], [-bend[0], -bend[1], bend[0], bend[1]]])
        heading = float(np.arctan2(step[1], step[0]))
        return GroundReading(xy[0], xy[1], float(xy[0, 1]), heading, jacobian @ both @ jacobian.T)

    def bird_eye(
        self,
        image: NDArray[Any],
        *,
        x_m: tuple[float, float] = (0.1, 1.0),
        y_m: tuple[float, float] = (-0.4, 0.4),
        px_per_m: float = 400.0,
    ) -> NDArray[Any]:
        """The ground as seen from above: forward is up, left is left; black where the image ends."""
        import cv2

        x = np.arange(x_m[1], x_m[0], -1.0 / px_per_m)
        y = np.arange(y_m[1], y_m[0], -1.0 / px_per_m)
        places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
        pixels = np.nan_to_num(self.to_image(places), nan=-1e4).reshape(len(x), len(y), 2).astype(np.float32)
        seen: NDArray[Any] = cv2.remap(
            image,
            np.ascontiguousarray(pixels[..., 0]),
            np.ascontiguousarray(pixels[..., 1]),
            cv2.INTER_LINEAR,
        )
        return seen

    def _derivatives(self, pixels: Array) -> tuple[Array, Array, Array, Array]:
        """Places (N, 2); how they change with pixels (N, 2, 2), homography (N, 2, 9) and lens (N, 2, p)."""
        n = len(pixels)
        if self.camera is None:
            plane, inner, by_lens = pixels, np.broadcast_to(np.eye(2), (n, 2, 2)), np.zeros((n, 2, 0))
        else:
            plane = self.camera.undistort_points(pixels)
            _, d_point, d_parameters = self.camera.project_jacobians(np.column_stack([plane, np.ones(n)]))
            good = np.isfinite(d_point).all(axis=(1, 2))
            inner = np.full((n, 2, 2), np.nan)
            inner[good] = np.linalg.inv(d_point[good, :, :2])
            by_lens = -inner @ d_parameters
        u = np.column_stack([plane, np.ones(n)])
        q = u @ self.ground_H_image.T
        q[~(q[:, 2] > 0)] = np.nan
        xy = q[:, :2] / q[:, 2:]
        d_q = np.zeros((n, 2, 3))
        d_q[:, 0, 0] = d_q[:, 1, 1] = 1.0 / q[:, 2]
        d_q[:, :, 2] = -xy / q[:, 2:]
        d_plane = d_q @ self.ground_H_image[:, :2]
        d_H = (d_q[:, :, :, None] * u[:, None, None, :]).reshape(n, 2, 9)
        return xy, d_plane @ inner, d_H, d_plane @ by_lens
