"""What a rectified pair's geometry is: the pinhole camera of its left image, baseline and doffs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sequential.errors import DataError, ModelError
from vision3d.camera import Camera
from vision3d.stereo.rig import StereoRig

if TYPE_CHECKING:
    from vision3d.stereo.rectification import Rectification

__all__ = ["PairGeometry", "geometry_of", "is_rectified"]

SAME_PX, SAME_RAD = 1e-3, 1e-6
SAME_SHAPE = 0.01  # of the sides' ratio


@dataclass(frozen=True, slots=True, eq=False)
class PairGeometry:
    """Of a rectified pair.

    Attributes
    ----------
    camera : pinhole, of the left rectified image
    baseline_m : positive, along x (of a vertical rig: along y)
    doffs_px : principal point of the right image less that of the left one, along the baseline
    vertical : the cameras stand above each other
    rectification : how images are brought there; None where they are rectified as they come
    """

    camera: Camera
    baseline_m: float
    doffs_px: float
    vertical: bool = False
    rectification: Rectification | None = None

    @property
    def focal_px(self) -> float:
        """Focal length along the baseline."""
        return float(self.camera.intrinsics[int(self.vertical)])


def is_rectified(rig: StereoRig) -> bool:
    """Whether a rig's images need no rectification: parallel pinhole cameras side by side."""
    (fx, fy, _, cy), (gx, gy, _, dy) = rig.left.intrinsics, rig.right.intrinsics
    along = np.abs(rig.centre_of_right) / rig.baseline_m
    return bool(
        rig.angle_rad < SAME_RAD
        and along[0] > 1.0 - 1e-9
        and not rig.left.distortion.any()
        and not rig.right.distortion.any()
        and max(abs(fx - gx), abs(fy - gy), abs(cy - dy)) < SAME_PX
    )


def geometry_of(rig: StereoRig, size: Sequence[int], *, rectified: bool = False) -> PairGeometry:
    """Geometry of the pair that a rig's images of a size (width, height) become.

    Parameters
    ----------
    rectified : the images have been rectified already, as `rectify(rig)` does

    Raises
    ------
    DataError
        where the images have another shape than those the rig was calibrated with.
    ModelError
        where the rig's left camera stands on the right.
    """
    from vision3d.stereo.rectification import rectify

    width, height = rig.left.size
    if abs((size[0] / size[1]) / (width / height) - 1.0) > SAME_SHAPE:
        raise DataError(
            f"the pictures are {size[0]}x{size[1]} px and the rig was calibrated at {width}x{height}: "
            "another shape, so they were cut; take pictures as they come from the cameras"
        )
    if rig.is_swapped:
        raise ModelError(
            "the rig's left camera stands to the right of its right one; exchange the two (StereoRig.swapped)"
        )
    scaled = rig if tuple(size) == rig.left.size == rig.right.size else rig.resized(size)
    if is_rectified(scaled):
        doffs = float(scaled.right.intrinsics[2] - scaled.left.intrinsics[2])
        return PairGeometry(scaled.left, scaled.baseline_m, doffs)
    pair = rectify(scaled)
    return PairGeometry(
        pair.left, abs(pair.baseline_m), pair.doffs_px, bool(pair.axis), None if rectified else pair
    )
