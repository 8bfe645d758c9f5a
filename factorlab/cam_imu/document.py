"""The page of a camera-IMU calibration: verdicts, constants, residuals, biases, motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from factorlab.cam_imu.numbers import cam_imu_numbers
from factorlab.cam_imu.verdicts import cam_imu_verdicts
from factorlab.report.document import Document, Section, Table
from sequential.manifold.quaternion import quaternion_log
from vision3d.inertial.excitation import AXES, excitation_of

if TYPE_CHECKING:
    from factorlab.cam_imu.job import CamImuRun

__all__ = ["cam_imu_document"]

RIG_TOLD = (
    "camera_T_imu takes points from the IMU's axes to the camera's (x right, y down, z ahead): Kalibr's "
    "T_cam_imu. Its rotation is given as a rotation vector, its translation is where the IMU is; σ are about "
    "and along the camera's axes."
)
MOTION_TOLD = (
    "Rotation and translation are told by turns about every axis, the offset of the clocks by turns that "
    "begin and end. About an axis that all turns share, camera and IMU could be turned against each other "
    "unseen."
)
CLOCKS_READ = (
    "Left: correlation of the speeds of turning over the offset of the clocks. Right: speed of turning by "
    "the gyro, and by pairs of frames put at the offset found."
)
INERTIAL_READ = (
    "Reading less prediction, in the noise found; grey: ±3σ. A slow wave in it is a motion that the knots "
    "cannot follow, or a bias that wanders faster than its walk."
)
CORNERS_READ = (
    "Left: all residuals of the corners that count, with circles of 1, 2, 3 σ. Right: RMS frame by frame, "
    "orange where a frame counts for nothing."
)
BIASES_READ = "Estimate and ±3σ at the nodes; between them a straight line."
TRAJECTORY_READ = (
    "The path of the IMU in the board's frame, and the board; the line to the camera at some moments."
)


def cam_imu_document(run: CamImuRun, command: str = "") -> Document:
    """Everything about a calibration, for the screen, `--json` and the page."""
    found = run.found
    angle = float(np.degrees(np.linalg.norm(quaternion_log(found.camera_T_imu[:4]))))
    distance = 1e3 * float(np.linalg.norm(found.camera_T_imu[4:]))
    offset = (
        f"{1e3 * run.time_offset_s:.3f} ms"
        if abs(run.time_offset_s) < 100.0
        else f"{run.time_offset_s:.6f} s"
    )
    lead = (
        f"{run.job.board.name} in {len(run.names)} frames, {len(found.problem.imu.t)} samples of the IMU: "
        f"turned by {angle:.2f}°, {distance:.1f} mm apart, clocks {offset} apart."
    )
    return Document(
        "Calibration of camera and IMU",
        lead,
        cam_imu_verdicts(run),
        tuple(_sections(run)),
        cam_imu_numbers(run),
        command=command,
    )


def _sections(run: CamImuRun) -> list[Section]:
    from factorlab.report import cam_imu_figures as figures

    return [
        Section("Rig", RIG_TOLD, _rig(run)),
        Section("Motion", MOTION_TOLD, _motion(run)),
        Section("Clocks", "", None, lambda: figures.clocks(run), CLOCKS_READ),
        Section("Residuals of the IMU", "", None, lambda: figures.inertial_residuals(run), INERTIAL_READ),
        Section("Residuals of the corners", "", None, lambda: figures.corner_residuals(run), CORNERS_READ),
        Section("Biases", "", None, lambda: figures.biases(run), BIASES_READ),
        Section("Trajectory", "", None, lambda: figures.trajectory(run), TRAJECTORY_READ),
    ]


def _rig(run: CamImuRun) -> Table:
    found = run.found
    state, problem = found.adjusted.state, found.problem
    turn = np.degrees(quaternion_log(found.camera_T_imu[:4]))
    rows: list[tuple[str, float, float | None, str]] = []
    for k, axis in enumerate("xyz"):
        rows.append((f"rotation about {axis}", float(turn[k]), float(np.degrees(found.rotation_std[k])), "°"))
    for k, axis in enumerate("xyz"):
        rows.append(
            (
                f"translation along {axis}",
                1e3 * float(found.camera_T_imu[4 + k]),
                1e3 * float(found.translation_std[k]),
                "mm",
            )
        )
    rows.append(("time offset", 1e3 * run.time_offset_s, 1e3 * found.time_offset_std_s, "ms"))
    gravity_std = float(np.degrees(found.std[7:9].max() / np.linalg.norm(state.gravity)))
    for k, axis in enumerate("xyz"):
        rows.append((f"gravity along the board's {axis}", float(state.gravity[k]), None, "m/s²"))
    rows.append(("gravity, direction", None, gravity_std, "°"))  # type: ignore[arg-type]
    columns = problem.constants.matrix_columns
    for name, matrix, (i, j), place in (
        ("accelerometer", state.accel_matrix, problem.constants.accel_entries, columns[0]),
        ("gyro", state.gyro_matrix, problem.constants.gyro_entries, columns[1]),
    ):
        for row, column, std in zip(i, j, found.std[place], strict=True):
            rows.append(
                (f"{name} gain {'xyz'[row]}{'xyz'[column]}", float(matrix[row, column]), float(std), "")
            )
    return Table(("constant", "value", "σ", "unit"), tuple(rows), digits=6)


def _motion(run: CamImuRun) -> Table:
    moved = excitation_of(run.found)
    rows = tuple(
        (
            name,
            float(np.degrees(moved.rate[k])),
            float(np.degrees(run.found.rotation_std[k])),
            1e3 * float(run.found.translation_std[k]),
        )
        for k, name in enumerate(AXES)
    )
    return Table(
        (
            "about the camera's",
            ("turning, RMS", "°/s"),
            ("σ of the rotation", "°"),
            ("σ of the translation", "mm"),
        ),
        rows,
    )
