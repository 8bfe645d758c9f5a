"""What the uncertainty of a rig's calibration does to depth: an error that neighbours share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vision3d.stereo.depth import Depth, with_systematic
from vision3d.stereo.rig import StereoRig

if TYPE_CHECKING:
    from vision3d.stereo.rectification import Rectification

__all__ = ["with_calibration_error"]

Array = NDArray[np.float64]
NODES = (7, 7, 5)  # rows, columns and inverse depths at which it is worked out


def with_calibration_error(depth: Depth, pair: Rectification) -> Depth:
    """Depth of a rectified pair, with the part of its standard deviation that the calibration brings.

    The pixels of the original pictures are held fixed while the rig varies as its covariance says; the same
    depth where the rig has none.  Exact at some nodes, interpolated between them.
    """
    from scipy.interpolate import RegularGridInterpolator

    rig = pair.rig
    known = np.isfinite(depth.z_m)
    if rig.joint_cov is None or not known.any():
        return depth
    height, width = depth.z_m.shape
    inverse = 1.0 / depth.z_m[known].astype(np.float64)
    low, high = float(inverse.min()), float(inverse.max())
    axes = [
        np.linspace(0.0, height - 1.0, NODES[0]),
        np.linspace(0.0, width - 1.0, NODES[1]),
        np.linspace(low, max(high, low * (1.0 + 1e-6)), NODES[2]),
    ]
    rows, columns, nodes = (one.ravel() for one in np.meshgrid(*axes, indexing="ij"))
    spread = _inverse_depth_std(pair, np.column_stack([columns, rows]), nodes).reshape(NODES)
    told = RegularGridInterpolator(axes, np.nan_to_num(spread, nan=float(np.nanmax(spread))))
    y, x = np.nonzero(known)
    held = np.clip(inverse, axes[2][0], axes[2][-1])
    systematic = np.full(depth.z_m.shape, np.nan, np.float32)
    systematic[known] = told(np.column_stack([y, x, held])) / inverse**2
    return with_systematic(depth, systematic)


def _inverse_depth_std(pair: Rectification, pixels: Array, inverse: Array) -> Array:
    """Standard deviation (N,) of 1/z at pixels (N, 2) of the rectified left image, 1/m."""
    rig = pair.rig
    points = pair.left.unproject(pixels)
    points = points / points[:, 2:] / inverse[:, None] @ pair.left_R_rectified.T
    seen = rig.project(points)
    slopes = []
    for k, step in enumerate(_steps(rig)):
        sides = [_triangulated(_moved(rig, k, sign * step), *seen) for sign in (1.0, -1.0)]
        z = [(side @ pair.left_R_rectified)[:, 2] for side in sides]
        slopes.append((1.0 / z[0] - 1.0 / z[1]) / (2.0 * step))
    slope = np.array(slopes).T
    variance: Array = np.einsum("ni,ij,nj->n", slope, np.asarray(rig.joint_cov), slope)
    return np.sqrt(np.maximum(variance, 0.0))


def _steps(rig: StereoRig) -> list[float]:
    """A small step of every parameter of a rig: radians, metres, pixels, coefficients."""
    of_camera = [[1e-2] * 4 + [1e-5] * len(camera.distortion) for camera in (rig.left, rig.right)]
    return [*[1e-5] * 3, *[1e-5 * rig.baseline_m] * 3, *of_camera[0], *of_camera[1]]


def _moved(rig: StereoRig, k: int, step: float) -> StereoRig:
    """The rig with its parameter k changed."""
    from sequential.manifold import SE3

    if k < 6:
        tangent = np.zeros(6)
        tangent[k] = step
        return StereoRig(rig.left, rig.right, SE3().retract(rig.right_T_left, tangent))
    k -= 6
    cameras = [rig.left, rig.right]
    side = 0 if k < rig.left.count else 1
    k -= side * rig.left.count
    parameters = cameras[side].parameters.copy()
    parameters[k] += step
    cameras[side] = cameras[side].with_parameters(parameters)
    return StereoRig(cameras[0], cameras[1], rig.right_T_left)


def _triangulated(rig: StereoRig, left: Any, right: Any) -> Array:
    """Points (N, 3) of the left frame nearest to both rays."""
    a, b = rig.left.unproject(left), rig.right.unproject(right) @ rig.R
    base = rig.centre_of_right
    # least squares of s a - (base + t b), its two normal equations solved by hand
    ab = np.einsum("ni,ni->n", a, b)
    pa, pb = a @ base, b @ base
    bottom = np.maximum(1.0 - ab**2, 1e-15)
    s, t = (pa - ab * pb) / bottom, (ab * pa - pb) / bottom
    middle: Array = 0.5 * (s[:, None] * a + base + t[:, None] * b)
    return middle
