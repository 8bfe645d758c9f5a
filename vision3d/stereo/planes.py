"""Planes and the ground in a depth image.

    ground = find_ground(depth, camera)
    ground.height_of(points), ground.distance_m         # above it; of the camera above it

A plane is linear in inverse depth, 1/z = m · (x/z, y/z, 1), and a stereo pair's inverse depth is disparity
but for a factor, with errors that do not grow with distance.  So planes are fitted there, each pixel by its
own standard deviation; a fit to points of space would get that wrong by the square of their distance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from vision3d.camera import Camera
from vision3d.stereo.depth import Depth

__all__ = ["DepthPlane", "find_ground", "find_planes"]

Array = NDArray[np.float64]
UP = (0.0, -1.0, 0.0)  # of a camera that stands upright
TILT_RAD = np.radians(40.0)  # at most between the ground's normal and up


@dataclass(frozen=True, slots=True, eq=False)
class DepthPlane:
    """A plane ``normal · x + distance = 0`` of the camera's frame.

    Attributes
    ----------
    normal : (3,) unit, towards the camera
    distance_m : of the camera from it, positive
    cov : (4, 4) covariance of normal and distance
    inliers : (h, w) pixels that lie on it
    rms_m : of their distances from it
    share : of the pixels with a depth
    """

    normal: Array
    distance_m: float
    cov: Array
    inliers: NDArray[np.bool_]
    rms_m: float
    share: float

    def __post_init__(self) -> None:
        for array in (self.normal, self.cov, self.inliers):
            array.setflags(write=False)

    @property
    def normal_std_rad(self) -> float:
        """How well its direction is known, about the worse axis."""
        return float(np.sqrt(max(np.linalg.eigvalsh(self.cov[:3, :3])[-1], 0.0)))

    @property
    def distance_std_m(self) -> float:
        """How well the camera's distance from it is known."""
        return float(np.sqrt(self.cov[3, 3]))

    def height_of(self, points: Any) -> Array:
        """Distance (…) of points (…, 3) from the plane, m, positive on the camera's side."""
        heights: Array = np.asarray(points, dtype=np.float64) @ self.normal + self.distance_m
        return heights

    def tilt_rad(self, up: Sequence[float] = UP) -> float:
        """Angle between the normal and a direction."""
        direction = np.asarray(up, dtype=np.float64)
        return float(np.arccos(np.clip(self.normal @ direction / np.linalg.norm(direction), -1.0, 1.0)))


def find_planes(
    depth: Depth | Any,
    camera: Camera,
    *,
    most: int = 6,
    least_share: float = 0.04,
    relative_std: float = 0.01,
) -> tuple[DepthPlane, ...]:
    """Planes of a depth image, largest first.

    Parameters
    ----------
    depth : of a stereo pair, or (h, w) of an RGB-D camera, m
    camera : that took it; any lens
    most : planes to look for
    least_share : of the pixels with a depth that a plane must hold
    relative_std : of a depth without a standard deviation of its own, as a share of it

    Notes
    -----
    Small tiles are fitted each; every flat tile proposes its plane, which gathers the tiles that it predicts
    within its and their uncertainty and is fitted to them, until that settles.  The proposal with the most
    pixels is fitted to those (Tukey's weights).  No random numbers.
    """
    from vision3d.stereo.plane_fitting import InverseDepth, best_plane

    if most < 1 or not 0.0 < least_share < 1.0:
        raise ModelError(f"expected most >= 1 and a least_share within 0-1; got {most} and {least_share:g}")
    data = InverseDepth.of(depth, camera, relative_std)
    free = data.known.copy()
    total = int(free.sum())
    found: list[DepthPlane] = []
    while len(found) < most and free.sum() > least_share * max(total, 1):
        fitted = best_plane(data, free)
        if fitted is None or fitted.inliers.sum() < least_share * total:
            break
        found.append(_plane(data, fitted, total))
        free &= ~fitted.inliers
    return tuple(sorted(found, key=lambda one: -one.share))


def find_ground(
    depth: Depth | Any,
    camera: Camera,
    *,
    up: Sequence[float] = UP,
    tilt_rad: float = TILT_RAD,
    planes: Sequence[DepthPlane] | None = None,
    relative_std: float = 0.01,
) -> DepthPlane | None:
    """The plane that the scene stands on; None where none is level enough.

    Parameters
    ----------
    up : (3,) direction in the camera's frame
    tilt_rad : at most between the plane's normal and `up`
    planes : of `find_planes`, where they are known already

    Notes
    -----
    Of the planes that face up, the largest one that little lies below: a table has a floor beneath it.
    """
    from vision3d.stereo.back_projection import cloud_of

    found = find_planes(depth, camera, relative_std=relative_std) if planes is None else planes
    level = [one for one in found if one.tilt_rad(up) <= tilt_rad]
    if not level:
        return None
    points = cloud_of(depth, camera).points

    def below(one: DepthPlane) -> float:
        room = 4.0 * one.rms_m + 0.02 * np.linalg.norm(points, axis=1)
        return float(np.mean(one.height_of(points) < -room))

    bottom = [one for one in level if below(one) < 0.1]
    return max(bottom or level, key=lambda one: one.share)


def _plane(data: Any, fitted: Any, total: int) -> DepthPlane:
    """From m of 1/z = m · ray to normal and distance, and their covariance."""
    m = fitted.m
    size = float(np.linalg.norm(m))
    normal, distance = -m / size, 1.0 / size
    slope = np.vstack([-(np.eye(3) - np.outer(normal, normal)) / size, -m / size**3])
    points = data.rays[fitted.inliers] / data.inverse[fitted.inliers][:, None]
    heights = points @ normal + distance
    return DepthPlane(
        normal, distance, slope @ fitted.cov @ slope.T, fitted.inliers,
        float(np.sqrt(np.mean(heights**2))), float(fitted.inliers.sum() / total),
    )  # fmt: skip
