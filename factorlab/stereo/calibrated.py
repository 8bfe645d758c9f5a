"""What is asked of a stereo calibration, and everything that a page says about the answer."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from factorlab.camera.fitting import Fitted
    from factorlab.stereo.pair_pictures import PicturePairs
    from vision3d.boards import Board
    from vision3d.stereo.calibration import StereoCalibration
    from vision3d.stereo.deviations import Deviations
    from vision3d.stereo.held_out import HeldOut
    from vision3d.stereo.rectification import Rectification
    from vision3d.stereo.rig_uncertainty import RigUncertainty
    from vision3d.stereo.row_errors import Measured
    from vision3d.views import Detections

__all__ = ["CalibratedStereo", "StereoSettings"]

Array = NDArray[np.float64]
GRID = (25, 19)  # nodes of the map


@dataclass(frozen=True, slots=True)
class StereoSettings:
    """What is asked of a stereo calibration.

    Parameters
    ----------
    board : what the pictures show
    lens : a name of `vision3d.camera.LENSES` for both cameras, or `"auto"`: chosen for each
    cameras : files of the left and of the right camera, which are then held; None is calibrated
    intrinsics : `"joint"`: both cameras and their pose together; `"alone"`: each camera by itself first, and
        held
    window : half-width of the corner refinement, px; None lets every corner have its own
    robust : leave out corners that noise does not explain
    shape : of the board, as in `factorlab.camera.CameraSettings`
    frames : how many pairs are taken from two videos
    """

    board: Board
    lens: str = "auto"
    cameras: tuple[Path | None, Path | None] = (None, None)
    intrinsics: Literal["joint", "alone"] = "joint"
    window: int | None = None
    robust: bool = True
    shape: Literal["auto", "flat", "bent"] = "auto"
    frames: int = 40


@dataclass(frozen=True, eq=False)
class CalibratedStereo:
    """A stereo calibration and its checks.

    Parameters
    ----------
    pictures : pairs that were read
    detections : of the left and of the right pictures
    fitted : each camera alone; None where it was given
    calibration : the answer
    held : every pair predicted from the others; None where there are too few
    deviations : what every pair alone says of the cameras' pose
    seconds : what took how long
    """

    settings: StereoSettings
    pictures: PicturePairs
    detections: tuple[Detections, Detections]
    fitted: tuple[Fitted | None, Fitted | None]
    calibration: StereoCalibration
    held: HeldOut | None
    deviations: Deviations
    seconds: dict[str, float]

    @property
    def given(self) -> int:
        """Pairs that were given, whole or not."""
        return self.pictures.given

    @property
    def lost(self) -> dict[str, str]:
        """Pictures that do not take part in a pair, each with its reason."""
        lost = {one.name: one.reason for one in self.pictures.left_out}
        return lost | {one.name: one.reason for own in self.detections for one in own.missed}

    @cached_property
    def rectification(self) -> Rectification:
        """Without black borders, at the left camera's size."""
        from vision3d.stereo.rectification import rectify

        return rectify(self.calibration.rig, size=self.calibration.rig.left.size)

    @cached_property
    def measured(self) -> Measured:
        """Rows and squares of the corners that count."""
        from vision3d.stereo.row_errors import measured

        fit = self.calibration
        weights = [fit.weights_of_pair(v) if pair.is_whole else None for v, pair in enumerate(fit.pairs)]
        return measured(self.rectification, fit.pairs, weights)

    @cached_property
    def distance_m(self) -> float:
        """Median distance of the boards that both cameras saw, along the left camera's axis."""
        from vision3d.rigid import transform

        fit = self.calibration
        middles = [
            transform(fit.poses[v], pair.left.points).mean(axis=0)[2]
            for v in fit.whole
            if (pair := fit.pairs[v]).left is not None
        ]
        return float(np.median(middles))

    @cached_property
    def uncertainty(self) -> RigUncertainty:
        """How sure rows and depths are over the rectified image, at the distance of the boards."""
        from vision3d.calibrate import pixel_grid
        from vision3d.stereo.rig_uncertainty import rig_uncertainty

        pixels = pixel_grid(self.rectification.size, GRID)
        return rig_uncertainty(self.rectification, pixels, self.distance_m)

    @cached_property
    def depth_spread(self) -> tuple[Array, Array]:
        """Distances (K,) m, and σ of a depth in the middle of the image from the rig alone, (K,) m."""
        from vision3d.stereo.rig_uncertainty import rig_uncertainty

        near, far = 0.5 * self.distance_m, 20.0 * self.distance_m
        depths = np.geomspace(near, far, 40)
        middle = 0.5 * (np.array(self.rectification.size) - 1.0)
        found = rig_uncertainty(self.rectification, np.broadcast_to(middle, (len(depths), 2)), depths)
        return depths, found.depth_std_m

    @cached_property
    def sigmas(self) -> tuple[Array, ...]:
        """Standard deviation of every corner of every picture, px, as the residuals show it."""
        fit = self.calibration
        found = []
        for side, pair in fit.pictures:
            view = fit.pairs[pair].left if side == 0 else fit.pairs[pair].right
            assert view is not None  # noqa: S101 - a picture shows the board
            floor, scale = fit.noise[side]
            found.append(fit.sigma_scale * scale * np.hypot(view.sigma_px, floor))
        return tuple(found)
