"""Depth and its standard deviation from disparity: z = f B / (d + doffs).

    depth = depth_of(disparity, focal_px, baseline_m, doffs_px)
    depth.z_m, depth.std_m

`doffs_px` is the right camera's principal point less the left one's (Middlebury's name): what the disparity
of infinitely far points is short of zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError, ShapeError
from vision3d.stereo.disparity import Disparity

__all__ = ["Depth", "depth_of", "with_systematic"]

Map = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Depth:
    """Depth along the optical axis of the left rectified camera; arrays (h, w) are read-only.

    Attributes
    ----------
    z_m : float32; NaN where there is none
    std_m : its standard deviation, of the match alone: independent from patch to patch
    systematic_m : what the calibration's uncertainty adds, common to neighbours; None where it is unknown
    measured : matched and confirmed, not filled in
    """

    z_m: Map
    std_m: Map
    systematic_m: Map | None
    measured: NDArray[np.bool_]

    def __post_init__(self) -> None:
        for array in (self.z_m, self.std_m, self.systematic_m, self.measured):
            if array is not None:
                array.setflags(write=False)

    @property
    def total_std_m(self) -> Map:
        """Both parts of the standard deviation together."""
        if self.systematic_m is None:
            return self.std_m
        return np.hypot(self.std_m, self.systematic_m).astype(np.float32)


def depth_of(
    disparity: Disparity | Any,
    focal_px: float,
    baseline_m: float,
    doffs_px: float = 0.0,
    *,
    std_px: Any = None,
) -> Depth:
    """Depth of every pixel.

    Parameters
    ----------
    disparity : of `compute_disparity`, or an array (h, w), px, NaN where there is none
    focal_px, baseline_m : of the rectified pair
    doffs_px : principal point of the right image less that of the left one
    std_px : standard deviation of an array's disparity, (h, w) or one number; unknown by default

    Raises
    ------
    ModelError
        where focal length or baseline is not positive.
    ShapeError
        where the arrays do not belong together.
    """
    if not (focal_px > 0.0 and baseline_m > 0.0 and np.isfinite([focal_px, baseline_m, doffs_px]).all()):
        raise ModelError(
            "depth takes a positive focal length and baseline, and a finite doffs; "
            f"got {focal_px:g} px, {baseline_m:g} m, {doffs_px:g} px"
        )
    if isinstance(disparity, Disparity):
        shift, spread, measured = disparity.map_px, disparity.std_px, disparity.valid
    else:
        shift = np.asarray(disparity, dtype=np.float32)
        spread = np.asarray(np.nan if std_px is None else std_px, dtype=np.float32)
        if shift.ndim != 2 or spread.shape not in ((), shift.shape):
            raise ShapeError(
                f"disparity is an array (h, w) and its std one number or as large; got {shift.shape} and "
                f"{spread.shape}"
            )
        measured = np.isfinite(shift)
    beyond = shift.astype(np.float64) + doffs_px
    with np.errstate(divide="ignore", invalid="ignore"):
        z = np.where(beyond > 0.0, focal_px * baseline_m / beyond, np.nan)
        # dz/dd = -z² / (f B)
        std = z * z / (focal_px * baseline_m) * spread
    return Depth(z.astype(np.float32), std.astype(np.float32), None, measured & np.isfinite(z))


def with_systematic(depth: Depth, systematic_m: Any) -> Depth:
    """The same depth with the part of its uncertainty that comes from the calibration, m (h, w)."""
    return Depth(depth.z_m, depth.std_m, np.asarray(systematic_m, dtype=np.float32), depth.measured)
