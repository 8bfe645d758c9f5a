"""The pose of one square marker, as a posterior with two modes.

Four corners of a small or distant square fit two poses, mirror images about the line of sight, and noise
decides which fits better: below 30 px it decides wrongly in a third of all pictures.  So both are told,
each with its covariance and its probability, and `certain` says whether the other can be forgotten.

>>> pose = marker_pose(camera, corners, size_m=0.05, sigma_px=0.2)  # doctest: +SKIP
>>> pose.camera_T_marker, pose.cov, pose.odds, pose.certain  # doctest: +SKIP

The frame of a marker is a board's: origin in its centre, x to the right and y down as printed, z into it.
Sources: Schweighofer and Pinz 2006 (two minima); Collins and Bartoli 2014, "Infinitesimal plane-based pose
estimation" (why there are two); the probabilities are integrals over tilt:
`vision3d.kernels.plane_posterior`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ModelError, NotPositiveDefiniteError, ShapeError
from sequential.manifold import SE3
from sequential.manifold.quaternion import rotate
from vision3d.markers.detection import Marker
from vision3d.markers.flat_object import FlatModes, flat_modes, flat_modes_of_many

if TYPE_CHECKING:
    from vision3d.camera import Camera

__all__ = ["CERTAIN", "MarkerPose", "Mode", "marker_corners", "marker_pose", "marker_poses", "pose_of_modes"]

Array = NDArray[np.float64]
CERTAIN = 20.0
"""Odds above which the other reading is left out of account."""
SHADE = 0.9
"""The sigma of corners is known to 5 % at best: odds are those of a sigma so much larger."""
LEAST = 1e-6
"""No reading is less probable beside the other: a bent or half hidden marker says less."""


@dataclass(frozen=True, eq=False)
class Mode:
    """One of the readings of a marker's corners.

    Parameters
    ----------
    camera_T_marker : (7,) mean of the posterior around this minimum: qw qx qy qz, px py pz in m
    cov : (6, 6) its covariance, in the tangent of `SE3`: rotation (rad), then translation (m), marker's axes
    probability : that the truth is of this reading
    rms_px : root mean square of what the corners are away from this reading, at its best
    minimum : (7,) the pose of least reprojection error; the mean is nearly the same but close to facing
    """

    camera_T_marker: Array
    cov: Array
    probability: float
    rms_px: float
    minimum: Array

    @property
    def tilt_rad(self) -> float:
        """Angle between the marker's normal and the line of sight to its centre; 0 is facing the camera."""
        sight = self.camera_T_marker[4:] / np.linalg.norm(self.camera_T_marker[4:])
        normal = rotate(self.camera_T_marker[:4], np.array([0.0, 0.0, 1.0]))
        return float(np.arccos(np.clip(sight @ normal, -1.0, 1.0)))

    @property
    def distance_m(self) -> float:
        """From the camera to the marker's centre."""
        return float(np.linalg.norm(self.camera_T_marker[4:]))


@dataclass(frozen=True, eq=False)
class MarkerPose:
    """What four corners say about where a marker is.

    Parameters
    ----------
    modes : one or two, the likelier first
    scale : 1, or how many times the corners' variance had to be raised to make them fit a square at all
    """

    modes: tuple[Mode, ...]
    scale: float = 1.0

    @property
    def odds(self) -> float:
        """How many times likelier the first mode is, at most a million; infinite where there is no second."""
        if len(self.modes) < 2 or self.modes[1].probability <= 0.0:
            return float("inf")
        return self.modes[0].probability / self.modes[1].probability

    @property
    def certain(self) -> bool:
        """Whether the odds exceed 20."""
        return self.odds > CERTAIN

    @property
    def camera_T_marker(self) -> Array:  # noqa: N802 - frames are written so
        """The likelier pose, (7,)."""
        return self.modes[0].camera_T_marker

    @property
    def cov(self) -> Array:
        """Covariance of the likelier pose, (6, 6), given that it is the right reading."""
        return self.modes[0].cov

    @cached_property
    def merged(self) -> tuple[Array, Array]:
        """Mean (7,) and covariance (6, 6) over all modes, for a user who can take one Gaussian only."""
        manifold = SE3()
        mean = self.modes[0].camera_T_marker
        weights = np.array([mode.probability for mode in self.modes])
        for _ in range(3):
            steps = np.array([manifold.local(mean, mode.camera_T_marker) for mode in self.modes])
            mean = manifold.retract(mean, weights @ steps)
        cov = np.zeros((6, 6))
        for mode in self.modes:
            step = manifold.local(mean, mode.camera_T_marker)
            carry = manifold.transport(mode.camera_T_marker, mean)[0]
            cov += mode.probability * (carry @ mode.cov @ carry.T + np.outer(step, step))
        return mean, cov


def marker_corners(size_m: float) -> Array:
    """The corners (4, 3) of a marker in its own frame, clockwise from the top left as printed."""
    if not (np.isfinite(size_m) and size_m > 0.0):
        raise ModelError(f"the size of a marker is the side of its black square in metres, got {size_m}")
    h = 0.5 * size_m
    return np.array([[-h, -h, 0.0], [h, -h, 0.0], [h, h, 0.0], [-h, h, 0.0]])


def marker_pose(camera: Camera, corners: Array, size_m: float, sigma_px: float | Array = 0.3) -> MarkerPose:
    """Pose of a marker from its four corners.

    Parameters
    ----------
    corners : (4, 2) px, clockwise from the top left of the marker as printed
    size_m : side of the black square
    sigma_px : standard deviation of a coordinate, one or (4,), or the covariance (8, 8) of all

    Raises
    ------
    DataError
        where corners lie outside what the lens sees, or make no square (crossed, or all on a line).
    """
    own = np.asarray(corners, dtype=np.float64)
    if own.shape != (4, 2):
        raise ShapeError(f"the corners of a marker are (4, 2) px, got shape {own.shape}")
    points = marker_corners(size_m)
    return pose_of_modes(flat_modes(camera, points, own, _whitening(sigma_px)))


def marker_poses(
    camera: Camera, markers: Sequence[Marker], size_m: float | Sequence[float]
) -> tuple[MarkerPose | None, ...]:
    """Poses of detected markers, each from its corners and their covariance; None where there is none.

    `size_m` is one size, or one for each.
    """
    if not markers:
        return ()
    sizes = np.broadcast_to(np.asarray(size_m, dtype=np.float64), (len(markers),))
    corners = np.array([one.corners for one in markers])
    factors = np.linalg.cholesky(np.array([one.cov for one in markers]))
    # all at the size of one metre: places and their covariances scale
    found = flat_modes_of_many(camera, marker_corners(1.0), corners, np.linalg.inv(factors)[:, None])
    return tuple(
        None if one is None else pose_of_modes(one, float(size))
        for one, size in zip(found, sizes, strict=True)
    )


def pose_of_modes(found: FlatModes, size: float = 1.0) -> MarkerPose:
    """Order what the kernel found by probability, in units of `size` metres."""
    weights = np.maximum(np.exp(SHADE * (found.log_z - found.log_z.max())), LEAST)
    weights /= weights.sum()
    scale = np.array([1.0, 1.0, 1.0, size, size, size])
    covs, stretch = found.covs * np.outer(scale, scale), np.concatenate([np.ones(4), scale[3:]])
    poses, minima = found.poses * stretch, found.minima * stretch
    for array in (covs, poses, minima):
        array.flags.writeable = False
    modes = tuple(
        Mode(poses[k], covs[k], float(weights[k]), float(found.rms_px[k]), minima[k])
        for k in np.argsort(-weights, kind="stable")
    )
    return MarkerPose(modes, found.scale)


def _whitening(sigma_px: float | Array) -> Array:
    """One block (1, 8, 8) that makes the covariance of the eight coordinates the identity."""
    given = np.asarray(sigma_px, dtype=np.float64)
    if given.shape == (8, 8):
        try:
            factor = np.linalg.cholesky(given)
        except np.linalg.LinAlgError:
            raise NotPositiveDefiniteError("the covariance of four corners is positive definite") from None
        return np.ascontiguousarray(np.linalg.inv(factor))[None]
    if given.ndim > 1 or given.size not in {1, 4}:
        raise ShapeError(f"sigma_px is one number, (4,) or a covariance (8, 8), got shape {given.shape}")
    if not (np.isfinite(given).all() and (given > 0.0).all()):
        raise DataError(f"sigma_px is a positive number of pixels, got {sigma_px}")
    each = np.repeat(np.broadcast_to(given.reshape(-1), (4,)), 2)
    return np.ascontiguousarray(np.diag(1.0 / each))[None]
