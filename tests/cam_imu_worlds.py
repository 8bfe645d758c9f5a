"""Recordings of a camera and an IMU before a board, whose truth is known; corners are projected."""

from dataclasses import dataclass, replace

import numpy as np

from sequential.manifold import SE3
from vision3d.boards import Checkerboard
from vision3d.inertial import CamImuCalibration, CamImuSettings, Corners, Imu, calibrate_cam_imu
from vision3d.inertial.simulated import Carried, Rig, project_corners, read_imu

BOARD = Checkerboard(9, 6, 0.035)


@dataclass(frozen=True, eq=False)
class Recorded:
    rig: Rig
    motion: Carried
    corners: Corners
    imu: Imu

    def calibrated(self, **settings) -> CamImuCalibration:
        return calibrate_cam_imu(self.rig.camera, self.corners, self.imu, CamImuSettings(**settings))

    def changed(self, **parts) -> "Recorded":
        return replace(self, **parts)


def recorded(seed=0, *, seconds=12.0, fps=15.0, rate_hz=100.0, sigma_px=0.1, rig=None, **motion) -> Recorded:
    rng = np.random.default_rng([77, seed])
    own = Rig() if rig is None else rig
    carried = Carried.random(rng, own, BOARD, **motion)
    imu, _, _ = read_imu(carried, own, seconds, rate_hz, rng)
    t = np.arange(0.2, seconds - 0.2, 1.0 / fps)
    return Recorded(own, carried, project_corners(carried, own, BOARD, t, sigma_px, rng), imu)


def errors(world: Recorded, found: CamImuCalibration) -> np.ndarray:
    """(7,) rotation rad, translation m (camera_T_imu's chart), offset s."""
    pose = SE3().local(world.rig.camera_T_imu, found.camera_T_imu)
    return np.append(pose, found.time_offset_s - world.rig.time_offset_s)


def within(world, found, degrees=0.05, millimetres=2.0, milliseconds=0.1):
    """Whether the calibration is that near to the truth."""
    error = errors(world, found)
    sizes = (
        np.degrees(np.linalg.norm(error[:3])),
        1e3 * np.linalg.norm(error[3:6]),
        1e3 * abs(error[6]),
    )
    return sizes[0] <= degrees and sizes[1] <= millimetres and sizes[2] <= milliseconds
