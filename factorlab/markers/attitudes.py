"""From poses of a marker to readings of an attitude: both modes of a sighting, odds, covariances."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from sequential.errors import DataError, ShapeError
from sequential.log import Stream, nanoseconds
from sequential.models import two_mode_readings

if TYPE_CHECKING:
    from vision3d.markers import MarkerPose

__all__ = ["attitude_readings"]


def attitude_readings(t: ArrayLike, poses: Sequence[MarkerPose | None]) -> Stream:
    """Readings camera_q_marker of a `sequential.TwoModeOrientation`, one for each time with a pose.

    Parameters
    ----------
    t : (N,) seconds or int ns, of the frames
    poses : N of `vision3d.markers.marker_pose`; None where the marker was not seen

    Raises
    ------
    ShapeError, DataError
        where there is not one pose a time, or no pose at all.
    """
    stamps = np.atleast_1d(nanoseconds(t))
    if len(stamps) != len(poses):
        raise ShapeError(f"{len(poses)} poses need as many times, got {len(stamps)}")
    seen = [(stamp, pose) for stamp, pose in zip(stamps, poses, strict=True) if pose is not None]
    if not seen:
        raise DataError("the marker is in none of the frames; is it of this dictionary, and is it this one?")
    absent = np.full(4, np.nan)
    modes = [(pose.modes[0], pose.modes[-1]) for _, pose in seen]
    second = [b.camera_T_marker[:4] if b is not a else absent for a, b in modes]
    return two_mode_readings(
        np.array([stamp for stamp, _ in seen]),
        [a.camera_T_marker[:4] for a, _ in modes],
        second,
        [pose.odds for _, pose in seen],
        [a.cov[:3, :3] for a, _ in modes],
        [b.cov[:3, :3] for _, b in modes],
    )
