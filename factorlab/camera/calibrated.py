"""What is asked of a camera's calibration, and everything that a page says about the answer."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from factorlab.camera.fitting import Fitted
    from vision3d.boards import Board
    from vision3d.calibrate import (
        Calibration,
        Coverage,
        DifferenceMap,
        LeaveOneOut,
        LensChoice,
        NextPose,
        ProjectionUncertainty,
    )
    from vision3d.images import ImageSet
    from vision3d.views import Detections

__all__ = ["CalibratedCamera", "CameraSettings"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
GRID = (33, 25)  # nodes of the maps


@dataclass(frozen=True, slots=True)
class CameraSettings:
    """What is asked of a calibration.

    Parameters
    ----------
    board : what the pictures show
    lens : a name of `vision3d.camera.LENSES`, or `"auto"`
    window : half-width of the corner refinement, px; None lets every corner have its own
    robust : leave out corners that noise does not explain
    shape : of the board: `"flat"`, `"bent"` (how far is estimated), or `"auto"`: bent where that predicts
        left-out pictures better
    frames : how many frames are taken from a video
    compare : a file with another calibration of the same camera
    next_pose : look for the most useful next pose of the board
    """

    board: Board
    lens: str = "auto"
    window: int | None = None
    robust: bool = True
    shape: Literal["auto", "flat", "bent"] = "auto"
    frames: int = 40
    compare: Path | None = None
    next_pose: bool = True


@dataclass(frozen=True, eq=False)
class CalibratedCamera:
    """A calibration and its checks; what was not asked for is None.

    Parameters
    ----------
    fitted : the calibration, the lenses that were tried, and whether the board is flat
    cross : every view predicted from the others
    following : where the board would tell most next
    difference : from the calibration to compare with
    seconds : what took how long
    """

    settings: CameraSettings
    pictures: ImageSet
    detections: Detections
    fitted: Fitted
    cross: LeaveOneOut | None
    following: NextPose | None
    difference: DifferenceMap | None
    seconds: dict[str, float]

    @property
    def calibration(self) -> Calibration:
        """The answer."""
        return self.fitted.calibration

    @property
    def choice(self) -> LensChoice | None:
        """The lenses that were tried; None where one was asked for, or views are too few."""
        return self.fitted.choice

    @property
    def given(self) -> int:
        """Pictures that were given, readable or not."""
        return len(self.pictures) + len(self.pictures.left_out)

    @property
    def lost(self) -> dict[str, str]:
        """Pictures that are not used, each with its reason: unreadable, of another size, without a board."""
        left_out = {one.name: one.reason for one in self.pictures.left_out}
        return left_out | {one.name: one.reason for one in self.detections.missed}

    @cached_property
    def coverage(self) -> Coverage:
        """Where the board was held, and what is missing."""
        from vision3d.calibrate import coverage

        return coverage(self.calibration)

    @cached_property
    def uncertainty(self) -> ProjectionUncertainty:
        """How sure the projection of a direction is, over the image."""
        from vision3d.calibrate import projection_uncertainty

        return projection_uncertainty(self.calibration, grid=GRID)

    @cached_property
    def uncertainty_freed(self) -> ProjectionUncertainty:
        """The same less the turn of the whole camera that explains most of it."""
        from vision3d.calibrate import projection_uncertainty

        return projection_uncertainty(self.calibration, freed_rotation=True, grid=GRID)

    @cached_property
    def worst_place(self) -> str:
        """Words for where the image is least known, such as `top left corner`."""
        std = self.uncertainty.map_px
        row, column = np.unravel_index(int(np.nanargmax(std)), std.shape)
        down = ("top", "", "bottom")[min(2, int(3 * row / std.shape[0]))]
        across = ("left", "", "right")[min(2, int(3 * column / std.shape[1]))]
        words = " ".join(filter(None, (down, across)))
        return f"{words} {'corner' if down and across else 'edge'}" if words else "middle"

    @cached_property
    def used(self) -> tuple[Mask, ...]:
        """Which corners of every view counted."""
        return tuple(weights > 0.0 for weights in self.calibration.weights)

    @cached_property
    def sigmas(self) -> tuple[Array, ...]:
        """Standard deviation of every corner of every view, px, as the residuals show it."""
        fit = self.calibration
        return tuple(fit.sigma_scale * np.hypot(view.sigma_px, fit.floor_px) for view in fit.views)

    @cached_property
    def normals(self) -> Array:
        """Normal of the board in every view, in the camera frame, away from the camera (V, 3)."""
        from sequential.manifold.quaternion import rotation_matrix

        return np.asarray(rotation_matrix(self.calibration.poses[:, :4])[:, :, 2])

    @cached_property
    def tilts(self) -> Array:
        """Angle between board and image in every view (V,), rad."""
        return np.asarray(np.arccos(np.clip(np.abs(self.normals[:, 2]), 0.0, 1.0)))

    @cached_property
    def distances(self) -> Array:
        """From the camera to the middle of the board in every view (V,), m."""
        from sequential.manifold.quaternion import rotation_matrix

        poses, middle = self.calibration.poses, self.settings.board.points.mean(axis=0)
        return np.asarray(np.linalg.norm(rotation_matrix(poses[:, :4]) @ middle + poses[:, 4:], axis=1))
