"""The first guess of everything: poses of the frames, clocks, rotation, gravity, trajectory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, FactorlabError
from sequential.manifold.quaternion import (
    quaternion_exp,
    quaternion_from_matrix,
    quaternion_inverse,
    quaternion_multiply,
    quaternion_normalize,
    rotate,
    rotation_matrix,
)
from vision3d.camera import Camera
from vision3d.inertial.alignment import Aligned
from vision3d.inertial.grid import Grid
from vision3d.inertial.problem import Corners, Imu
from vision3d.inertial.state import State
from vision3d.rigid import compose, inverse

__all__ = ["FramePoses", "pose_frames", "start_state", "stretches"]

Array = NDArray[np.float64]
SHORTEST_S = 1.0  # of a stretch
LONGEST_BLIND_S = 0.7  # without a frame: an IMU alone is not carried farther
GAP, GAP_S = 4.5, 0.06  # intervals of the IMU that make a gap, and seconds
EDGE_S = 0.02
LEAST_SIGMA_PX = 0.2  # of a corner, for the first poses
AROUND_S = 0.05  # of IMU before the first and after the last frame


@dataclass(frozen=True, eq=False)
class FramePoses:
    """Each frame's own camera_T_board (F, 7), and the RMS of its residuals in sigmas (F,)."""

    camera_T_board: Array
    misfit: Array


def pose_frames(camera: Camera, corners: Corners) -> tuple[FramePoses, NDArray[np.bool_]]:
    """Poses of the frames, and which frames have one; a frame that contradicts the camera has none."""
    from vision3d.pose import estimate_pose

    poses, misfits, good = [], [], np.zeros(len(corners.t), dtype=bool)
    starts = np.searchsorted(corners.frame, np.arange(len(corners.t) + 1))
    for k in range(len(corners.t)):
        rows = slice(starts[k], starts[k + 1])
        own = corners.points[rows], corners.pixels[rows], np.maximum(corners.sigma_px[rows], LEAST_SIGMA_PX)
        try:
            one = estimate_pose(camera, *own, robust=True)
        except FactorlabError:
            continue
        good[k] = True
        poses.append(one.camera_T_object)
        misfits.append(np.sqrt(one.chi2 / max(1, one.dof)))
    return FramePoses(np.array(poses).reshape(-1, 7), np.array(misfits)), good


def stretches(frames_t: Array, imu_t: Array) -> list[tuple[float, float]]:
    """Stretches (begin, end) of the IMU's clock with frames and readings both, frames given in that clock.

    Raises
    ------
    DataError
        where there is none.
    """
    usual = float(np.median(np.diff(imu_t)))
    breaks = np.flatnonzero(np.diff(imu_t) > max(GAP * usual, GAP_S))
    begins = np.concatenate([[imu_t[0]], imu_t[breaks + 1]])
    ends = np.concatenate([imu_t[breaks], [imu_t[-1]]])
    found = []
    for begin, end in zip(begins, ends, strict=True):
        own = frames_t[(frames_t >= begin + EDGE_S) & (frames_t <= end - EDGE_S)]
        runs = np.split(own, np.flatnonzero(np.diff(own) > LONGEST_BLIND_S) + 1)
        found += [
            (max(begin, run[0] - AROUND_S), min(end, run[-1] + AROUND_S))
            for run in runs
            if len(run) >= 4 and run[-1] - run[0] >= SHORTEST_S
        ]
    if not found:
        raise DataError(
            f"there is no stretch of {SHORTEST_S:g} s in which both the IMU reads without a gap and the "
            f"board is seen at least every {LONGEST_BLIND_S:g} s; keep the board in view while you move"
        )
    return found


def start_state(
    grid: Grid, corners: Corners, poses: FramePoses, imu: Imu, aligned: Aligned, gravity: float
) -> State:
    """A state to begin from: rotation by the gyro between frames, the camera at the IMU's place."""
    camera_T_imu = np.concatenate([quaternion_from_matrix(aligned.camera_R_imu), np.zeros(3)])
    board_T_imu = compose(inverse(poses.camera_T_board), camera_T_imu)
    t = corners.t + aligned.time_offset_s
    turned = _integrated(imu, aligned.gyro_bias)

    def at(when: Array) -> Array:
        nearest = _nearest(t, when)
        own, frame = turned[_nearest(imu.t, when)], turned[_nearest(imu.t, t[nearest])]
        return quaternion_normalize(
            quaternion_multiply(board_T_imu[nearest, :4], quaternion_multiply(quaternion_inverse(frame), own))
        )

    force = rotate(at(imu.t), imu.accel)
    down = -np.median(force, axis=0)
    length = float(np.linalg.norm(down))
    down = down / length if length > 0.0 else np.array([0.0, 1.0, 0.0])
    centres = grid.centres
    positions = np.column_stack([np.interp(centres, t, board_T_imu[:, 4 + k]) for k in range(3)])
    nodes = grid.nodes
    return State(
        grid, at(centres), positions, camera_T_imu, aligned.time_offset_s, gravity * down,
        np.tile(aligned.gyro_bias, (nodes, 1)), np.zeros((nodes, 3)), np.eye(3), np.eye(3),
    )  # fmt: skip


def restart(state: State, grid: Grid, corners: Corners, poses: FramePoses, imu: Imu) -> State:
    """The same calibration on another grid: its trajectory begins from the frames."""
    bias_gyro, bias_accel = state.biases(grid.node_times)
    aligned = Aligned(
        state.time_offset_s, rotation_matrix(state.camera_T_imu[:4]), bias_gyro.mean(axis=0),
        1.0, 0.0, 1.0, False, np.zeros(1), np.zeros(1), 0.0,  # noqa: FBT003 - not asked for here
    )  # fmt: skip
    begun = start_state(grid, corners, poses, imu, aligned, float(np.linalg.norm(state.gravity)))
    board_T_imu = compose(inverse(poses.camera_T_board), state.camera_T_imu)
    t = corners.t + state.time_offset_s
    positions = np.column_stack([np.interp(grid.centres, t, board_T_imu[:, 4 + k]) for k in range(3)])
    return State(
        grid, begun.rotations, positions, state.camera_T_imu, state.time_offset_s, state.gravity,
        bias_gyro, bias_accel, state.accel_matrix, state.gyro_matrix, state.board_scale,
    )  # fmt: skip


def _integrated(imu: Imu, bias: Array) -> Array:
    """Rotations (N, 4) since the first reading, by doubling: products of 1, 2, 4 … neighbours."""
    dt = np.diff(imu.t, prepend=imu.t[0])
    mean = imu.gyro - bias
    mean[1:] = 0.5 * (mean[1:] + mean[:-1])
    q = quaternion_exp(mean * dt[:, None])
    reach = 1
    while reach < len(q):
        q = np.concatenate([q[:reach], quaternion_multiply(q[:-reach], q[reach:])])
        reach *= 2
    return quaternion_normalize(q)


def _nearest(t: Array, when: Array) -> NDArray[np.intp]:
    after = np.clip(np.searchsorted(t, when), 1, max(len(t) - 1, 1))
    after = np.minimum(after, len(t) - 1)
    before = np.maximum(after - 1, 0)
    return np.where(when - t[before] <= t[after] - when, before, after)
