"""The numbers of a camera-IMU calibration for a machine."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sequential.manifold import SE3
from sequential.manifold.quaternion import rotation_matrix
from vision3d.inertial.excitation import excitation_of

if TYPE_CHECKING:
    from factorlab.cam_imu.job import CamImuRun

__all__ = ["cam_imu_numbers", "difference_from", "matrix_of", "truth_errors"]


def matrix_of(pose: Any) -> Any:
    """(4, 4) matrix of a pose (7,)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation_matrix(pose[:4]), pose[4:]
    return matrix


def cam_imu_numbers(run: CamImuRun) -> dict[str, Any]:
    """What `report.json`, `calibration.json` and `--json` say besides verdicts."""
    found = run.found
    state, problem = found.adjusted.state, found.problem
    constants, q = problem.constants, problem.constants.count
    moved = excitation_of(found)
    gyro_std, accel_std = found.bias_std()
    dt = float(np.median(np.diff(problem.imu.t)))
    numbers: dict[str, Any] = {
        "board": run.job.board.name,
        "camera_T_imu": {
            "qw_qx_qy_qz_px_py_pz": found.camera_T_imu.tolist(),
            "matrix": matrix_of(found.camera_T_imu).tolist(),
            "cov": found.cov[:6, :6].tolist(),
            "rotation_std_deg": np.degrees(found.rotation_std).tolist(),
            "translation_std_m": found.translation_std.tolist(),
        },
        "time_offset_s": run.time_offset_s,
        "time_offset_std_s": found.time_offset_std_s,
        "gravity_board": state.gravity.tolist(),
        "gravity_std_deg": np.degrees(found.std[7:9] / np.linalg.norm(state.gravity)).tolist(),
        "biases": {
            "t_s": (state.grid.node_times + found_origin(run)).tolist(),
            "gyro_rad_s": state.gyro_bias.tolist(),
            "gyro_std_rad_s": gyro_std.tolist(),
            "accel_m_s2": state.accel_bias.tolist(),
            "accel_std_m_s2": accel_std.tolist(),
        },
        "imu_model": constants.imu_model,
        "accel_matrix": state.accel_matrix.tolist(),
        "gyro_matrix": state.gyro_matrix.tolist(),
        "constants_std": dict(
            zip(constants.names, np.sqrt(np.diagonal(found.border_cov)[:q]).tolist(), strict=True)
        ),
        "noise": {
            "gyro_density": problem.gyro_sigma * dt**0.5,
            "accel_density": problem.accel_sigma * dt**0.5,
            "corner_scale": problem.corner_scale,
            "rms_px": found.rms_px,
        },
        "frames": {
            "looked_at": run.frames,
            "with_board": len(run.names),
            "used": int(found.frames_used.sum()),
            "left_out": [
                name for name, used in zip(_used_names(run), found.frames_used, strict=True) if not used
            ],
            "stamps": run.stamps_from,
        },
        "duration_s": float(problem.corners.t[-1] - problem.corners.t[0]),
        "stretches": len(state.grid.begins),
        "knots_per_s": found.knots_per_s,
        "excitation": {
            "rate_rms_deg_s": np.degrees(moved.rate).tolist(),
            "acceleration_rms_m_s2": moved.acceleration.tolist(),
        },
        "alignment": {
            "correlation": found.aligned.correlation,
            "next_best_correlation": found.aligned.rival,
        },
        "iterations": found.adjusted.iterations,
        "seconds": run.seconds,
    }
    if run.checked is not None:
        numbers["checks"] = {
            "halves_difference": None if run.checked.halves is None else run.checked.halves.tolist(),
            "halves_sigmas": run.checked.halves_sigmas,
            "board_scale": run.checked.board_scale,
            "board_scale_std": run.checked.board_scale_std,
        }
    if run.job.compare is not None:
        numbers["difference"] = {"from": run.job.compare_name, "step": difference_from(run).tolist()}
    if run.truth is not None:
        numbers["truth"] = truth_errors(run)
    return numbers


def found_origin(run: CamImuRun) -> float:
    """Seconds to add to times of the estimation, so that they count from the IMU's first sample."""
    return (run.origin_ns[1] - int(run.recording.t[0])) * 1e-9


def _used_names(run: CamImuRun) -> list[str]:
    """Names of the frames that the estimation holds: those within the IMU's recording."""
    held = np.isin(run.times, run.found.problem.corners.t)
    return [name for name, one in zip(run.names, held, strict=True) if one]


def difference_from(run: CamImuRun) -> Any:
    """(7,) the other calibration's, less ours: rotation, translation (our right chart), offset."""
    other = run.job.compare
    assert other is not None  # noqa: S101 - the caller has looked
    pose = SE3().local(run.found.camera_T_imu, other.camera_T_imu)
    return np.append(pose, other.time_offset_s - run.time_offset_s)


def truth_errors(run: CamImuRun) -> dict[str, float]:
    """Errors against the truth of a rendered recording, and the largest over its standard deviation."""
    assert run.truth is not None  # noqa: S101 - the caller has looked
    rig, found = run.truth.rig, run.found
    error = np.append(
        SE3().local(rig.camera_T_imu, found.camera_T_imu), run.time_offset_s - rig.time_offset_s
    )
    gravity = run.truth.gravity, found.adjusted.state.gravity
    cosine = float(gravity[0] @ gravity[1] / np.linalg.norm(gravity[0]) / np.linalg.norm(gravity[1]))
    return {
        "rotation_error_deg": float(np.degrees(np.linalg.norm(error[:3]))),
        "translation_error_m": float(np.linalg.norm(error[3:6])),
        "time_offset_error_s": float(abs(error[6])),
        "gravity_error_deg": float(np.degrees(np.arccos(min(1.0, cosine)))),
        "nees": float(error @ np.linalg.solve(found.cov[:7, :7], error)),
        "nees_dof": 7.0,
        "z_rms": float(np.sqrt(np.mean((error / found.std[:7]) ** 2))),
    }
