"""The files beside the report: the rig for other programs, and what it was made from."""

from __future__ import annotations

import contextlib
import csv
import io
import json
from typing import TYPE_CHECKING

import numpy as np

from factorlab.cam_imu.numbers import cam_imu_numbers, matrix_of
from sequential.errors import ModelError
from sequential.manifold.quaternion import quaternion_from_matrix
from sequential.readers.stamps import decimal_seconds
from vision3d.camera_files.numbers import numbers

if TYPE_CHECKING:
    from factorlab.cam_imu.job import CamImuRun

__all__ = ["FORMAT", "cam_imu_files", "camchain_text", "imu_yaml_text"]

FORMAT = "factorlab camera-imu calibration"


def cam_imu_files(run: CamImuRun) -> dict[str, str | bytes]:
    """Names and contents: Kalibr's two files, our own JSON, the trajectory, residuals of the frames."""
    files: dict[str, str | bytes] = {
        "calibration.json": calibration_json(run),
        "imu.yaml": imu_yaml_text(run),
        "trajectory.tum": trajectory_tum(run),
        "frames.csv": frames_csv(run),
    }
    with contextlib.suppress(ModelError):  # a lens that Kalibr cannot say; calibration.json can
        files["camchain-imucam.yaml"] = camchain_text(run)
    return files


def calibration_json(run: CamImuRun) -> str:
    """Our own format: the camera and every number with its covariance."""
    from vision3d.camera_files.own_json import camera_record

    kalibr = {"T_cam_imu": matrix_of(run.found.camera_T_imu).tolist(), "timeshift_cam_imu": run.time_offset_s}
    whole = {"format": FORMAT, "version": 1, "camera": camera_record(run.job.camera), **kalibr}
    whole |= cam_imu_numbers(run)
    return json.dumps(whole, indent=1, ensure_ascii=False) + "\n"


def camchain_text(run: CamImuRun) -> str:
    """Kalibr's camchain-imucam.yaml.

    Raises
    ------
    ModelError
        for a lens that Kalibr does not have.
    """
    from vision3d.camera_files.kalibr import kalibr_text

    lines = kalibr_text(run.job.camera).rstrip("\n").split("\n")
    pose = [f"  - {numbers(row)}" for row in matrix_of(run.found.camera_T_imu)]
    lines += ["  T_cam_imu:", *pose, f"  timeshift_cam_imu: {run.time_offset_s!r}"]
    return "\n".join(lines) + "\n"


def imu_yaml_text(run: CamImuRun) -> str:
    """Kalibr's imu.yaml with the white noise of the residuals, and the bias walks that were assumed."""
    problem, walk = run.found.problem, run.found.walk
    dt = float(np.median(np.diff(problem.imu.t)))
    rows = {
        "accelerometer_noise_density": problem.accel_sigma * dt**0.5,
        "accelerometer_random_walk": walk.accel,
        "gyroscope_noise_density": problem.gyro_sigma * dt**0.5,
        "gyroscope_random_walk": walk.gyro,
    }
    lines = ["# densities: of the residuals of this calibration; random walks: as they were assumed"]
    lines += [f"{name}: {value:.9e}" for name, value in rows.items()]
    return "\n".join([*lines, "rostopic: /imu0", f"update_rate: {1.0 / dt!r}"]) + "\n"


def trajectory_tum(run: CamImuRun) -> str:
    """board_T_imu at the IMU's samples: seconds of its clock, position, quaternion with the scalar last."""
    t = run.found.problem.imu.t
    R, _, position, _, _ = run.found.adjusted.state.motion(t)
    q = quaternion_from_matrix(R)
    stamps = run.origin_ns[1] + np.round(1e9 * t).astype(np.int64)
    return "".join(
        f"{decimal_seconds(stamp)} {' '.join(f'{value:.9f}' for value in (*p, *one[1:], one[0]))}\n"
        for stamp, p, one in zip(stamps.tolist(), position, q, strict=True)
    )


def frames_csv(run: CamImuRun) -> str:
    """One frame a row: stamp, corners, how many count, RMS of those."""
    corners, weight = run.found.problem.corners, run.found.problem.corner_weight
    residuals = run.found.adjusted.linear.residuals_px
    text = io.StringIO()
    out = csv.writer(text, lineterminator="\n")
    out.writerow(["stamp_ns", "corners", "used", "rms_px"])
    for k, t in enumerate(corners.t):
        own = corners.frame == k
        used = own & (weight > 0.0)
        rms = float(np.sqrt(np.mean(np.sum(residuals[used if used.any() else own] ** 2, axis=1))))
        out.writerow(
            [run.origin_ns[0] + round(1e9 * float(t)), int(own.sum()), int(used.sum()), f"{rms:.5f}"]
        )
    return text.getvalue()
