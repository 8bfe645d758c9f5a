"""Camera and IMU from a board that both saw move: mounting, clocks, biases, and how sure each is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ModelError
from sequential.noise import ImuNoise
from vision3d.camera import Camera
from vision3d.inertial.adjust import BiasWalk
from vision3d.inertial.alignment import Aligned, align, turns_between
from vision3d.inertial.bandwidth import knots_per_second
from vision3d.inertial.checks import check_alignment, check_readings, search_range
from vision3d.inertial.excitation import check_turns, require_observable
from vision3d.inertial.grid import Grid
from vision3d.inertial.problem import Corners, Imu
from vision3d.inertial.result import CamImuCalibration
from vision3d.inertial.robust_fit import fit
from vision3d.inertial.start import FramePoses, pose_frames, start_state, stretches
from vision3d.inertial.state import Constants
from vision3d.rigid import inverse

__all__ = ["CamImuSettings", "calibrate_cam_imu"]

Array = NDArray[np.float64]
GRAVITY = 9.80665
MEMS_WALK = BiasWalk(2e-5, 3e-4)
"""Of a consumer's IMU, where no noise file says better: rad/s²/√Hz, m/s³/√Hz."""
NODE_S = 5.0


@dataclass(frozen=True)
class CamImuSettings:
    """What is asked for.

    Parameters
    ----------
    imu_model : of `vision3d.inertial.IMU_MODELS`: what is estimated of the IMU besides biases
    gravity : its length, m/s²
    noise : of the IMU; its bias walks are taken, its densities compared with the residuals
    knots_per_s : of the trajectory; None: as many as the readings ask for
    order : of the splines; 6 has an acceleration that is smooth twice
    search_s : largest offset of the clocks that is looked for; None: 1 s, or all of both recordings where
        their clocks have nothing to do with each other
    common_clock : both stamps count from about the same moment
    """

    imu_model: str = "calibrated"
    gravity: float = GRAVITY
    noise: ImuNoise | None = None
    knots_per_s: float | None = None
    order: int = 6
    search_s: float | None = None
    common_clock: bool = True

    def __post_init__(self) -> None:
        Constants(self.imu_model)
        if not 8.0 < self.gravity < 12.0:
            raise ModelError(f"gravity is about 9.8 m/s², got {self.gravity}")
        if not 4 <= self.order <= 8:
            raise ModelError(f"the order of the splines is 4 to 8, got {self.order}")
        if self.knots_per_s is not None and not 1.0 <= self.knots_per_s <= 400.0:
            raise ModelError(f"knots a second are 1 to 400, got {self.knots_per_s}")

    @property
    def walk(self) -> BiasWalk:
        """How biases may change."""
        if self.noise is None or min(self.noise.gyro_bias_walk, self.noise.accel_bias_walk) <= 0.0:
            return MEMS_WALK
        return BiasWalk(self.noise.gyro_bias_walk, self.noise.accel_bias_walk)


def calibrate_cam_imu(
    camera: Camera, corners: Corners, imu: Imu, settings: CamImuSettings | None = None
) -> CamImuCalibration:
    """Estimate how camera and IMU are mounted to each other, and how their clocks differ.

    Parameters
    ----------
    camera : with known intrinsics
    corners : of a board at rest, in frames stamped by the camera's clock
    imu : stamped by its own
    settings : see `CamImuSettings`

    Raises
    ------
    DataError
        too few frames, no overlap, a gyro in other units, or turns that do not belong together.
    UnderConstrainedError
        a motion is missing; the message says which.

    Notes
    -----
    Furgale, Rehder, Siegwart 2013, "Unified temporal and spatial calibration for multi-sensor systems": a
    continuous trajectory as B-splines, here of position and, cumulative, of rotation.  Maximum likelihood;
    noise of the three sensors from their own residuals, less what the unknowns use up.
    """
    own = CamImuSettings() if settings is None else settings
    check_readings(corners, imu, own.gravity)
    poses, good = pose_frames(camera, corners)
    corners = corners.select(good)
    if len(corners.t) < 8:
        raise DataError(
            f"the board's pose is found in {len(corners.t)} frames only; is the camera's calibration that of "
            "these pictures?"
        )
    check_turns(corners.t, inverse(poses.camera_T_board)[:, :4])
    aligned = _aligned(corners, poses, imu, own)
    check_alignment(aligned, imu, corners)
    frames_t = corners.t + aligned.time_offset_s
    spans = stretches(frames_t, imu.t)
    rate = own.knots_per_s or _knots(spans, imu)
    grid = Grid.over(spans, 1.0 / rate, own.order, NODE_S)
    seen = grid.inside(frames_t)
    used = poses_of(poses, seen)
    corners = corners.select(seen)
    readings = imu.select(grid.inside(imu.t))
    begun = start_state(grid, corners, used, readings, aligned, own.gravity)
    problem, adjusted, walk = fit(camera, corners, readings, begun, Constants(own.imu_model), own.walk)
    found = CamImuCalibration(own, problem, adjusted, aligned, used, walk, rate)
    require_observable(found)
    return found


def poses_of(poses: FramePoses, rows: NDArray[np.bool_]) -> FramePoses:
    """Poses of some of the frames."""
    return FramePoses(poses.camera_T_board[rows], poses.misfit[rows])


def _aligned(corners: Corners, poses: FramePoses, imu: Imu, settings: CamImuSettings) -> Aligned:
    turns = turns_between(corners.t, inverse(poses.camera_T_board)[:, :4])
    return align(
        turns,
        imu.t,
        imu.gyro,
        search_range(corners, imu, settings.search_s, common_clock=settings.common_clock),
    )


def _knots(spans: Sequence[tuple[float, float]], imu: Imu) -> float:
    inside = np.zeros(len(imu.t), dtype=bool)
    for begin, end in spans:
        inside |= (imu.t >= begin) & (imu.t <= end)
    return knots_per_second(imu.t[inside], imu.gyro[inside], imu.accel[inside])
