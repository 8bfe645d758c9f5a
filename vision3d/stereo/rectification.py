"""Rectification: both images as two parallel cameras would have taken them, so that a point keeps its row.

Bouguet's construction, OpenCV's too: each camera turns by half of the rotation between them, then both turn
so that their common x axis lies along the baseline (Bouguet, "Camera calibration toolbox for Matlab").
Fusiello's keeps the left camera's view instead (Fusiello, Trucco, Verri 2000, "A compact algorithm for
rectification of stereo pairs").
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError, ShapeError
from sequential.manifold.quaternion import quaternion_exp, quaternion_log, rotation_matrix
from vision3d.camera import Camera
from vision3d.stereo.rig import StereoRig

__all__ = ["METHODS", "Rectification", "rectify"]

Array = NDArray[np.float64]
Map = NDArray[np.float32]
METHODS = ("bouguet", "fusiello")


@dataclass(frozen=True, eq=False)
class Rectification:
    """How to rectify the images of a rig.

    Parameters
    ----------
    rig : whose images they are
    left, right : pinhole cameras that rectified images are images of: one focal length, and one cy (of a
        vertical rig: one cx)
    left_R_rectified, right_R_rectified : (3, 3) attitudes of the rectified cameras in the real ones
    baseline_m : along the rectified x axis (y of a vertical rig); negative where left and right are swapped
    valid_left, valid_right : (x0, y0, x1, y1) px, first and last column and row that are all image
    """

    rig: StereoRig
    left: Camera
    right: Camera
    left_R_rectified: Array
    right_R_rectified: Array
    baseline_m: float
    valid_left: tuple[int, int, int, int]
    valid_right: tuple[int, int, int, int]

    def __post_init__(self) -> None:
        for array in (self.left_R_rectified, self.right_R_rectified):
            array.flags.writeable = False

    @property
    def axis(self) -> int:
        """Along which disparities run: 0 for x, 1 for y (a vertical rig; transpose its images to match)."""
        return int(self.rig.is_vertical)

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) of rectified images, px."""
        return self.left.size

    @property
    def focal_px(self) -> float:
        """Focal length of both."""
        return float(self.left.intrinsics[0])

    @property
    def doffs_px(self) -> float:
        """The right principal point's coordinate minus the left one's: depth = f B / (disparity + doffs)."""
        return float(self.right.intrinsics[2 + self.axis] - self.left.intrinsics[2 + self.axis])

    @cached_property
    def valid(self) -> tuple[int, int, int, int]:
        """(x0, y0, x1, y1) px: where both images are all image; x1 < x0 where nowhere."""
        a, b = self.valid_left, self.valid_right
        return max(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), min(a[3], b[3])

    @cached_property
    def Q(self) -> Array:  # noqa: N802 - OpenCV's name
        """(4, 4) from (x, y, disparity, 1) to a point of the rectified left camera: OpenCV's; read-only."""
        cx, cy = self.left.intrinsics[2:]
        matrix = np.array(
            [
                [1.0, 0.0, 0.0, -cx],
                [0.0, 1.0, 0.0, -cy],
                [0.0, 0.0, 0.0, self.focal_px],
                [0.0, 0.0, 1.0 / self.baseline_m, self.doffs_px / self.baseline_m],
            ]
        )
        matrix.flags.writeable = False
        return matrix

    @cached_property
    def projections(self) -> tuple[Array, Array]:
        """OpenCV's P1 and P2, (3, 4)."""
        first, second = (np.column_stack([one.matrix, np.zeros(3)]) for one in (self.left, self.right))
        second[self.axis, 3] = -self.baseline_m * self.focal_px
        return first, second

    @cached_property
    def rig_rectified(self) -> StereoRig:
        """The rig of the rectified images, its uncertainty left out."""
        shift = np.zeros(3)
        shift[self.axis] = -self.baseline_m
        return StereoRig(self.left, self.right, np.array([1.0, 0.0, 0.0, 0.0, *shift]))

    @cached_property
    def maps(self) -> tuple[tuple[Map, Map], tuple[Map, Map]]:
        """Columns and rows (h, w) of the left image, and of the right one, as `cv2.remap` takes them."""
        from vision3d.undistort import undistort_maps

        return (
            undistort_maps(self.rig.left, self.left, self.left_R_rectified),
            undistort_maps(self.rig.right, self.right, self.right_R_rectified),
        )

    def images(self, left: NDArray[Any], right: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        """Rectify a pair (h, w) or (h, w, channels); 0 where a camera saw nothing.

        Raises
        ------
        ShapeError
            where an image has another size than its camera.
        """
        import cv2

        found = []
        for name, image, camera, (columns, rows) in zip(
            ("left", "right"), (left, right), (self.rig.left, self.rig.right), self.maps, strict=True
        ):
            if image.shape[1::-1] != camera.size:
                width, height = camera.size
                raise ShapeError(
                    f"the {name} image is {image.shape[1]}x{image.shape[0]} px and its camera was calibrated "
                    f"at {width}x{height}; use images of that size, or scale the rig (`resized`)"
                )
            found.append(cv2.remap(image, columns, rows, cv2.INTER_LINEAR))
        return found[0], found[1]

    def points(self, left: Array, right: Array) -> tuple[Array, Array]:
        """Where pixels (N, 2) of the left image, and of the right one, lie in the rectified images."""
        return (
            self.left.project(self.rig.left.unproject(left) @ self.left_R_rectified),
            self.right.project(self.rig.right.unproject(right) @ self.right_R_rectified),
        )

    def row_errors(self, left: Array, right: Array) -> Array:
        """How far apart, px, the rows (of a vertical rig: columns) of pixels (N, 2) are: right less left."""
        a, b = self.points(left, right)
        errors: Array = b[:, 1 - self.axis] - a[:, 1 - self.axis]
        return errors


def rectify(
    rig: StereoRig,
    *,
    alpha: float | None = 0.0,
    size: Sequence[int] | None = None,
    method: str = "bouguet",
    zero_disparity: bool = True,
) -> Rectification:
    """Find rectified cameras for a rig.

    Parameters
    ----------
    rig : of two cameras
    alpha : 0 shows only what is image everywhere, 1 shows every pixel with black around; between them a
        mixture; None keeps the focal length that the cameras have on average
    size : (width, height) of rectified images; None: the left camera's
    method : `"bouguet"` or `"fusiello"`
    zero_disparity : one principal point for both, so that what is infinitely far has disparity 0; otherwise
        each has its own, which shows more of what both see of near things

    Raises
    ------
    ModelError
        for an unknown method, an alpha outside of 0 to 1, or cameras that look so far apart or past each
        other that no common image plane exists.
    ShapeError
        where the cameras' images differ in size and no size is asked for.
    """
    from vision3d.stereo.framing import framed

    if method not in METHODS:
        raise ModelError(f"no method {method!r} of rectification; known are {', '.join(METHODS)}")
    if alpha is not None and not 0.0 <= alpha <= 1.0:
        raise ModelError(f"alpha is between 0 (no black) and 1 (every pixel), got {alpha:g}")
    if size is None and rig.left.size != rig.right.size:
        raise ShapeError(
            f"the left images are {rig.left.size[0]}x{rig.left.size[1]} px and the right ones "
            f"{rig.right.size[0]}x{rig.right.size[1]}; say the size of the rectified ones"
        )
    wanted = rig.left.size if size is None else (int(size[0]), int(size[1]))
    R_left, R_right = _attitudes(rig, method)
    shift = R_right.T @ rig.T
    (left, right), valid = framed(rig, (R_left, R_right), wanted, alpha, zero_disparity=zero_disparity)
    return Rectification(rig, left, right, R_left, R_right, -float(shift[int(rig.is_vertical)]), *valid)


def _attitudes(rig: StereoRig, method: str) -> tuple[Array, Array]:
    """Attitudes (3, 3) of the rectified cameras in the left one and in the right one."""
    axis = int(rig.is_vertical)
    if method == "fusiello":
        along = -rig.centre_of_right if rig.is_swapped else rig.centre_of_right
        left = _with_baseline(along / np.linalg.norm(along), np.array([0.0, 0.0, 1.0]), axis)
        return left, rig.R @ left
    # half the way from each: right_R_left = half @ half
    half = rotation_matrix(quaternion_exp(0.5 * quaternion_log(rig.right_T_left[:4])))
    shift = half.T @ rig.T
    along = np.zeros(3)
    along[axis] = np.copysign(1.0, shift[axis])
    cross = np.cross(shift, along)
    sine, cosine = float(np.linalg.norm(cross)), float(shift @ along)
    turn = cross / sine * np.arctan2(sine, cosine) if sine > 0.0 else np.zeros(3)
    middle_R_rectified = rotation_matrix(quaternion_exp(turn)).T
    return half.T @ middle_R_rectified, half @ middle_R_rectified


def _with_baseline(along: Array, view: Array, axis: int) -> Array:
    """Axes (3, 3) as columns: x (vertical rig: y) along the baseline, z as near to the view as it can be."""
    if axis == 0:
        down = np.cross(view, along)
        down /= np.linalg.norm(down)
        return np.column_stack([along, down, np.cross(along, down)])
    across = np.cross(along, view)
    across /= np.linalg.norm(across)
    return np.column_stack([across, along, np.cross(across, along)])
