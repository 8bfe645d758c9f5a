"""A calibration over a part of its recording, to be adjusted by itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vision3d.inertial.grid import Grid
from vision3d.inertial.problem import Problem
from vision3d.inertial.result import CamImuCalibration
from vision3d.inertial.start import FramePoses, restart, stretches
from vision3d.inertial.state import State

__all__ = ["part_of"]


def part_of(found: CamImuCalibration, frames: NDArray[np.bool_]) -> tuple[Problem, State]:
    """Problem and beginning with some of the frames (F,), noise and weights as they were found.

    Raises
    ------
    DataError
        where too little is left.
    """
    whole, state = found.problem, found.adjusted.state
    frames = frames & found.frames_used
    corners = whole.corners.select(frames)
    spans = stretches(corners.t + state.time_offset_s, whole.imu.t)
    grid = Grid.over(spans, state.grid.step_s, state.grid.order, state.grid.node_step_s)
    seen = grid.inside(corners.t + state.time_offset_s)
    chosen = np.flatnonzero(frames)[seen]
    mask = np.zeros(len(frames), dtype=bool)
    mask[chosen] = True
    inside = grid.inside(whole.imu.t)
    imu = whole.imu.select(inside)
    poses = FramePoses(found.poses.camera_T_board[mask], found.poses.misfit[mask])
    problem = replace(
        whole,
        corners=whole.corners.select(mask),
        imu=imu,
        gyro_weight=whole.gyro_weight[inside],
        accel_weight=whole.accel_weight[inside],
        corner_weight=whole.corner_weight[mask[whole.corners.frame]],
    )
    return problem, restart(state, grid, problem.corners, poses, imu)
