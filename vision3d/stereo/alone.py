"""Each camera of a rig by itself: calibrated from its own views, or known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from vision3d.calibrate import Calibration, calibrate
from vision3d.camera import Camera
from vision3d.pose import estimate_poses
from vision3d.views import View

__all__ = ["Alone", "alone", "posed"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Alone:
    """A camera, and where it sees the board.

    Parameters
    ----------
    camera : calibrated from its own views, or known
    poses : (V, 7) camera_T_board, NaN where it did not see the board
    calibration : None where the camera was known
    """

    camera: Camera
    poses: Array
    calibration: Calibration | None


def alone(
    views: Sequence[View | None],
    lens: str,
    known: Camera | None = None,
    start: Calibration | None = None,
    *,
    robust: bool = True,
    board_warp: bool = False,
) -> Alone:
    """Calibrate one camera from its views, or pose the board for a known one.

    Parameters
    ----------
    views : of one camera, None where it did not see the board
    lens : a name of `vision3d.camera.LENSES`
    known : the camera, held
    start : a calibration from these views that exists already
    """
    poses = np.full((len(views), 7), np.nan)
    seen = [v for v, view in enumerate(views) if view is not None]
    own = [view for view in views if view is not None]
    if known is not None:
        for v, view in zip(seen, own, strict=True):
            if view.size != known.size:
                raise DataError(
                    f"{view.name} is {view.size[0]}x{view.size[1]} px and its camera was calibrated at "
                    f"{known.size[0]}x{known.size[1]}; use pictures of that size"
                )
            poses[v] = posed(known, view)
        return Alone(known, poses, None)
    if start is None or not _is_of(start, own, lens):
        start = calibrate(own, lens, robust=robust, board_warp=board_warp, start=start)
    poses[seen] = start.poses
    return Alone(start.camera, poses, start)


def _is_of(start: Calibration, views: Sequence[View], lens: str) -> bool:
    """Whether a calibration is of these views with this lens."""
    names = [view.name for view in views]
    return start.camera.lens == lens and [view.name for view in start.views] == names


def posed(camera: Camera, view: View) -> Array:
    """(7,) camera_T_board of a view.

    Raises
    ------
    DataError
        where the view's pixels have no rays in this camera.
    """
    seen = np.isfinite(camera.unproject(view.pixels)[:, 0])
    if np.count_nonzero(seen) < 4:
        raise DataError(f"{view.name}: its corners lie outside of what the lens of its camera can see")
    estimates = estimate_poses(camera, view.points[seen], view.pixels[seen], view.sigma_px[seen])
    return estimates[0].camera_T_object
