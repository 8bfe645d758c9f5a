"""What a stereo calibration says: the rig, the board's poses, how sure both are, and what did not fit."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from vision3d.calibrate.calibration import Calibration, SolveReport
from vision3d.stereo.consensus import Disagreement
from vision3d.stereo.rig import StereoRig
from vision3d.stereo.view_pairs import ViewPair

__all__ = ["SIDES", "StereoCalibration"]

Array = NDArray[np.float64]
SIDES = ("left", "right")


@dataclass(frozen=True, eq=False)
class StereoCalibration:
    """Two cameras calibrated together from V pairs, whose P pictures show the board.

    Attributes
    ----------
    rig : StereoRig
        Both cameras, their pose, and the covariance of all of it.
    joint_cov : Array
        Covariance of θ, (q, q): that of the rig, and of the bend of the board.  Where the corners of one pair
        err together, the scatter of the pairs is in it.
    cov_independent : Array
        The same if the corners' errors were independent.
    inflation : float
        Standard deviations in `joint_cov` over those in `cov_independent`, root of the mean square.
    free : NDArray[np.bool_]
        What of θ was estimated, (q,).
    pairs : tuple[ViewPair, ...]
        What was fitted; a pair that the others contradict stands here as two, one picture each.
    poses, pose_covs : Array
        left_T_board of every pair (V, 7), and its covariance (V, 6, 6), rotation then translation in the
        board's frame.
    pose_follows, pose_alone : Array
        (V, 6, q) how poses follow θ, and (V, 6, 6) their covariances when θ is known.
    warp : Array
        How far the board is bent, (2,) m, as in `vision3d.calibrate.Calibration`.
    pictures : tuple[tuple[int, int], ...]
        Side (0 left, 1 right) and number of the pair of each picture.
    residuals, weights : tuple[Array, ...]
        Corner minus projection (N, 2) px, and weight (N,) of every corner relative to one at its sigma, of
        each picture.
    sigma_px : tuple[float, float]
        Standard deviation of a typical corner of the left and of the right camera, per axis.
    noise : tuple[tuple[float, float], tuple[float, float]]
        Floor, px, and scale of the stated sigmas of either camera.
    sigma_scale : float
        Standard deviation of the residuals in units of what `noise` makes of the stated sigmas: about 1.
    rms_px, rms_left_px, rms_right_px : float
        Root mean square distance (OpenCV's definition) over the corners that count in full: of both cameras
        together, and of either.
    rms_all_px : float
        Of both over all corners.
    pair_rms : Array
        (V, 2), of the left and of the right picture of every pair; NaN where it does not show the board.
    outliers : tuple[tuple[int, int, int], ...]
        Corners left out: side, number of the pair, number of the corner on the board.
    outlier_pictures : tuple[tuple[int, int], ...]
        Side and pair of pictures that fit much worse than the others; they count little.
    disagreeing : tuple[Disagreement, ...]
        Pairs that the others contradict.
    renumbered : tuple[str, ...]
        Pairs whose right picture counted the corners from another end.
    alone : tuple[Calibration | None, Calibration | None]
        Each camera calibrated from its own pictures; None where it was known.
    report : SolveReport
        How the solve went.
    """

    rig: StereoRig
    joint_cov: Array
    cov_independent: Array
    inflation: float
    free: NDArray[np.bool_]
    pairs: tuple[ViewPair, ...]
    poses: Array
    pose_covs: Array
    pose_follows: Array
    pose_alone: Array
    warp: Array
    pictures: tuple[tuple[int, int], ...]
    residuals: tuple[Array, ...]
    weights: tuple[Array, ...]
    sigma_px: tuple[float, float]
    noise: tuple[tuple[float, float], tuple[float, float]]
    sigma_scale: float
    rms_px: float
    rms_left_px: float
    rms_right_px: float
    rms_all_px: float
    pair_rms: Array
    outliers: tuple[tuple[int, int, int], ...]
    outlier_pictures: tuple[tuple[int, int], ...]
    disagreeing: tuple[Disagreement, ...]
    renumbered: tuple[str, ...]
    alone: tuple[Calibration | None, Calibration | None]
    report: SolveReport

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            for array in value if isinstance(value, tuple) else (value,):
                if isinstance(array, np.ndarray):
                    array.flags.writeable = False

    @property
    def whole(self) -> tuple[int, ...]:
        """Numbers of the pairs that both cameras saw."""
        return tuple(v for v, pair in enumerate(self.pairs) if pair.is_whole)

    @property
    def std(self) -> Array:
        """Standard deviations of θ: the pose (6,), the left parameters, the right ones, the bend (2,)."""
        deviations: Array = np.sqrt(np.diag(self.joint_cov))
        return deviations

    @property
    def camera_stds(self) -> tuple[Array, Array]:
        """Standard deviations of the parameters of either camera."""
        at = 6 + self.rig.left.count
        return self.std[6:at], self.std[at:-2]

    @property
    def corner_count(self) -> int:
        """Corners of all pictures."""
        return sum(len(one) for one in self.weights)

    def picture(self, side: int, pair: int) -> int:
        """Number of the picture of one side (0 left, 1 right) of a pair."""
        return self.pictures.index((side, pair))

    def weights_of_pair(self, pair: int) -> tuple[Array, Array]:
        """Weights (N,) of the corners of either picture of a pair that both cameras saw."""
        return self.weights[self.picture(0, pair)], self.weights[self.picture(1, pair)]
