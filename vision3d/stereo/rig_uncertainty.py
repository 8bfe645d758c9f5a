"""How sure rows and depths are, as far as the rig is concerned: its covariance carried to rectified images.

A calibration that is a little off moves what a pixel shows after rectification: across the rows, which a
matcher sees as an error of rows, and along them, which it takes for disparity.  Noise of matching comes on
top, see `vision3d.stereo.depth`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.manifold.so3 import skew
from vision3d.camera import Camera
from vision3d.rigid import transform
from vision3d.stereo.rectification import Rectification

__all__ = ["RigUncertainty", "rig_jacobian", "rig_uncertainty"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RigUncertainty:
    """Standard deviations from the rig's covariance, at N points.

    Attributes
    ----------
    pixels : Array
        (N, 2), in the rectified left image.
    depth_m : Array
        (N,), along the rectified axis.
    row_std_px : Array
        (N,), of the difference of rows.
    disparity_std_px : Array
        (N,), of the disparity.
    depth_std_m : Array
        (N,), of the depth.
    """

    pixels: Array
    depth_m: Array
    row_std_px: Array
    disparity_std_px: Array
    depth_std_m: Array


def rig_uncertainty(pair: Rectification, pixels: Array, depth_m: Array | float) -> RigUncertainty:
    """What the rig's covariance makes of rows, disparities and depths; NaN where a camera does not see.

    Parameters
    ----------
    pair : the rectification of a rig whose covariance is known
    pixels : (N, 2) in the rectified left image
    depth_m : (N,) along the rectified axis, or one for all

    Raises
    ------
    ModelError
        where the rig has no covariance.
    """
    rig = pair.rig
    if rig.joint_cov is None:
        raise ModelError("this rig has no covariance; calibrate it with factorlab, and keep it as rig.json")
    at = np.atleast_2d(np.asarray(pixels, dtype=np.float64))
    depth = np.broadcast_to(np.asarray(depth_m, dtype=np.float64), (len(at),))
    flat = (at - pair.left.intrinsics[2:]) / pair.left.intrinsics[:2]
    ahead = np.column_stack([flat, np.ones(len(at))]) * depth[:, None]
    points = ahead @ pair.left_R_rectified.T
    J = rig_jacobian(pair, points)
    cov = J @ rig.joint_cov @ J.transpose(0, 2, 1)
    row, disparity = np.sqrt(cov[:, 0, 0]), np.sqrt(cov[:, 1, 1])
    return RigUncertainty(
        at, depth, row, disparity, depth**2 / abs(pair.focal_px * pair.baseline_m) * disparity
    )


def rig_jacobian(pair: Rectification, points: Array) -> Array:
    """How far rows are apart, and disparities, of points (N, 3) of the left frame: (N, 2, 6 + p + q)."""
    rig, p = pair.rig, pair.rig.left.count
    beyond = transform(rig.right_T_left, points)
    left = _rectified_by_pixels(rig.left, pair.left, pair.left_R_rectified, points)
    right = _rectified_by_pixels(rig.right, pair.right, pair.right_R_rectified, beyond)
    _, _, by_left = rig.left.project_jacobians(points)
    _, by_point, by_right = rig.right.project_jacobians(beyond)
    # right_T_left Exp(η) carries X to R (X + ρ + φ × X) + T
    carried = np.concatenate([-rig.R @ skew(points), np.broadcast_to(rig.R, (len(points), 3, 3))], axis=-1)
    J = np.zeros((len(points), 2, 6 + p + rig.right.count))
    moved_left = left @ by_left
    moved_right = np.concatenate([right @ by_point @ carried, right @ by_right], axis=-1)
    across, along = 1 - pair.axis, pair.axis
    own = np.r_[0:6, 6 + p : J.shape[2]]
    J[:, 0, own] = moved_right[:, across]
    J[:, 1, own] = -moved_right[:, along]
    J[:, 0, 6 : 6 + p] -= moved_left[:, across]
    J[:, 1, 6 : 6 + p] += moved_left[:, along]
    return J


def _rectified_by_pixels(camera: Camera, target: Camera, camera_R_target: Array, points: Array) -> Array:
    """(N, 2, 2) how the rectified image of points (N, 3) of a camera moves with their pixels."""
    _, by_point, _ = camera.project_jacobians(points)
    turned = points @ camera_R_target
    _, by_turned, _ = target.project_jacobians(turned)
    unit = points / np.linalg.norm(points, axis=1, keepdims=True)
    # the change of direction, across the ray, that a change of the pixel stands for
    square = np.concatenate([by_point, unit[:, None]], axis=1)
    bad = ~np.isfinite(square).all(axis=(1, 2))
    square[bad] = np.eye(3)
    inverse = np.linalg.inv(square)[:, :, :2]
    inverse[bad] = np.nan
    slopes: Array = by_turned @ camera_R_target.T @ inverse
    return slopes
