"""What a camera-IMU calibration is worth, in verdicts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from factorlab.cam_imu.numbers import difference_from, truth_errors
from factorlab.camera.verdicts import judged
from factorlab.report.document import Status, Verdict
from vision3d.inertial.excitation import excitation_of, missing_motion

if TYPE_CHECKING:
    from factorlab.cam_imu.job import CamImuRun

__all__ = ["cam_imu_verdicts"]

ENOUGH_FRAMES = 100
GOOD_ROTATION, FAIR_ROTATION = 0.1, 0.5  # σ, °
GOOD_TRANSLATION, FAIR_TRANSLATION = 5.0, 20.0  # σ, mm
GOOD_OFFSET, FAIR_OFFSET = 0.5, 2.0  # σ, ms
GOOD_PX, FAIR_PX = 0.5, 1.5
GOOD_SIGMAS, FAIR_SIGMAS = 3.5, 6.0  # of the largest of seven differences of halves
GOOD_BOARD, FAIR_BOARD = 0.01, 0.03  # of its size, where that is beyond its own uncertainty
GOOD_NOISE, FAIR_NOISE = 1.5, 3.0  # residuals over the declared noise
FEW = 0.02
CLEAR = 0.8  # correlation of the speeds of turning
TRUE_ROTATION, TRUE_TRANSLATION, TRUE_OFFSET = 0.1, 5.0, 0.5


def cam_imu_verdicts(run: CamImuRun) -> tuple[Verdict, ...]:
    """Frames, clocks, the three answers, residuals, checks: in the order of a reader."""
    return (
        _frames(run),
        _clocks(run),
        _rotation(run),
        _translation(run),
        _offset(run),
        _residuals(run),
        *_noise(run),
        *_halves(run),
        *_board(run),
        _biases(run),
        _solved(run),
        *_other(run),
        *_truth(run),
    )


def _frames(run: CamImuRun) -> Verdict:
    found = run.found
    used, seen = int(found.frames_used.sum()), len(run.names)
    outside = seen - len(found.frames_used)
    wrong = len(found.frames_used) - used
    status: Status = "PASS" if used >= ENOUGH_FRAMES and wrong <= FEW * seen else "WARN"
    seconds = float(found.problem.corners.t[-1] - found.problem.corners.t[0])
    said = [f"the board is in {seen} of {run.frames} frames, over {seconds:.0f} s"]
    said += [f"{outside} lie outside of what the IMU recorded, or alone"] if outside else []
    said += [f"{wrong} contradict the others and count for nothing"] if wrong else []
    stretches = len(found.adjusted.state.grid.begins)
    said += (
        [f"in {stretches} stretches, between which the IMU or the board was not seen"]
        if stretches > 1
        else []
    )
    action = "" if used >= ENOUGH_FRAMES else "record half a minute, the whole board in view"
    if wrong > FEW * seen:
        action = action or "look at the frames that are left out: blur, glare, a board that moved?"
    return Verdict("frames used", used, None, status, "; ".join(said), action)


def _clocks(run: CamImuRun) -> Verdict:
    aligned = run.found.aligned
    status: Status = (
        "PASS" if aligned.correlation >= CLEAR and aligned.rival < aligned.correlation - 0.1 else "WARN"
    )
    meaning = (
        "correlation of how fast camera and gyro turn, at the offset found; at offsets farther than half a "
        f"second from it at most {aligned.rival:.2f}"
        if aligned.rival > -1.0
        else "correlation of how fast camera and gyro turn, at the offset found"
    )
    action = "" if status == "PASS" else "move irregularly: a steady rhythm looks the same a beat later"
    return Verdict("clocks matched", aligned.correlation, None, status, meaning, action)


def _rotation(run: CamImuRun) -> Verdict:
    std = float(np.degrees(run.found.rotation_std.max()))
    status = judged(std, GOOD_ROTATION, FAIR_ROTATION)
    meaning = "of the rotation between camera and IMU, about the axis where it is least sure"
    return Verdict("σ of the rotation", std, None, status, meaning, _advice(run, status), "°")


def _translation(run: CamImuRun) -> Verdict:
    std = 1e3 * float(run.found.translation_std.max())
    status = judged(std, GOOD_TRANSLATION, FAIR_TRANSLATION)
    x, y, z = 1e3 * run.found.camera_T_imu[4:]
    meaning = f"the IMU is at {x:.1f}, {y:.1f}, {z:.1f} mm in the camera's frame (right, down, ahead)"
    return Verdict("σ of the translation", std, None, status, meaning, _advice(run, status), "mm")


def _offset(run: CamImuRun) -> Verdict:
    std = 1e3 * run.found.time_offset_std_s
    status = judged(std, GOOD_OFFSET, FAIR_OFFSET)
    meaning = f"{1e3 * run.time_offset_s:.3f} ms are added to a camera's stamp to give the IMU's"
    if abs(run.time_offset_s) > 100.0:
        meaning = f"{run.time_offset_s:.6f} s are added to a frame's stamp to give the IMU's"
    return Verdict("σ of the time offset", std, None, status, meaning, _advice(run, status), "ms")


def _advice(run: CamImuRun, status: Status) -> str:
    return "" if status == "PASS" else missing_motion(run.found, excitation_of(run.found))


def _residuals(run: CamImuRun) -> Verdict:
    found = run.found
    status = judged(found.rms_px, GOOD_PX, FAIR_PX)
    dropped = int(np.count_nonzero(found.problem.corner_weight == 0.0))
    sigma = found.problem.corner_scale * float(np.median(found.problem.corners.sigma_px))
    meaning = (
        f"distance of a corner from where the moving camera predicts it; σ of a coordinate {sigma:.2g} px; "
        f"{dropped} of {len(found.problem.corner_weight)} corners left out"
    )
    action = "" if status == "PASS" else "motion blur, a rolling shutter, or a calibration of another camera?"
    return Verdict("residual of corners, RMS", found.rms_px, None, status, meaning, action, "px")


def _noise(run: CamImuRun) -> list[Verdict]:
    """Residuals of the IMU, beside what was declared."""
    problem, noise = run.found.problem, run.job.settings.noise
    dt = float(np.median(np.diff(problem.imu.t)))
    verdicts = []
    for name, sigma, unit, weight, told in (
        ("gyro", problem.gyro_sigma, "rad/s/√Hz", problem.gyro_weight, noise.gyro_density if noise else None),
        (
            "accelerometer",
            problem.accel_sigma,
            "m/s²/√Hz",
            problem.accel_weight,
            noise.accel_density if noise else None,
        ),
    ):
        density = sigma * dt**0.5
        share = float(np.mean(weight == 0.0))
        meaning = f"white noise that its residuals show; {100 * share:.2g} % of its samples are left out"
        status: Status = "PASS" if share < FEW else "WARN"
        action = "" if status == "PASS" else "knocks, or a full scale that is too small?"
        if told:
            ratio = density / told
            status = judged(max(ratio, 1.0 / ratio if ratio > 0.2 else 1.0), GOOD_NOISE, FAIR_NOISE)
            status = "WARN" if status == "FAIL" else status
            meaning += f"; {ratio:.2f} times what {run.job.noise_name or 'was declared'} says"
            action = "" if status == "PASS" else "vibration, or a motion faster than the trajectory's knots?"
        verdicts.append(Verdict(f"{name} noise", density, None, status, meaning, action, unit))
    return verdicts


def _halves(run: CamImuRun) -> list[Verdict]:
    if run.checked is None:
        return []
    sigmas = run.checked.halves_sigmas
    if sigmas is None or run.checked.halves is None:
        meaning = "one half of the recording alone does not determine the calibration"
        return [Verdict("halves agree", None, None, "WARN", meaning, "record half a minute or more")]
    d = run.checked.halves
    status = judged(sigmas, GOOD_SIGMAS, FAIR_SIGMAS)
    meaning = f"each half of the recording alone: {apart_in_words(d)} apart; the largest of the seven in σ"
    action = "" if status == "PASS" else "is the rig rigid, the focus fixed, and do both clocks run evenly?"
    return [Verdict("halves agree", sigmas, None, status, meaning, action, "σ")]


def apart_in_words(difference: Any) -> str:
    """Rotation, translation and offset of a difference (7,)."""
    turn, shift = np.degrees(np.linalg.norm(difference[:3])), 1e3 * np.linalg.norm(difference[3:6])
    return f"{turn:.3f}°, {shift:.2f} mm and {1e3 * abs(difference[6]):.3f} ms"


def _board(run: CamImuRun) -> list[Verdict]:
    """The size of the board, weighed by the accelerometer."""
    if run.checked is None or run.checked.board_scale is None or run.checked.board_scale_std is None:
        return []
    scale, std = run.checked.board_scale, run.checked.board_scale_std
    off = abs(scale - 1.0)
    side = 1e3 * run.job.board.pitch_m
    meaning = f"{scale * side:.2f} ± {std * side:.2f} mm between points by the accelerometer; {side:.2f} told"
    if off < 3.0 * std:
        return [Verdict("board, measured by the IMU", scale * side, None, "PASS", meaning, unit="mm")]
    status = judged(off, GOOD_BOARD, FAIR_BOARD)
    action = (
        ""
        if status == "PASS"
        else f"measure the board: --square {scale * side:.1f}mm? Or calibrate the accelerometer"
    )
    return [Verdict("board, measured by the IMU", scale * side, None, status, meaning, action, "mm")]


def _biases(run: CamImuRun) -> Verdict:
    state = run.found.adjusted.state
    gyro, accel = np.degrees(state.gyro_bias.mean(axis=0)), state.accel_bias.mean(axis=0)
    meaning = (
        f"gyro ({', '.join(f'{value:.3f}' for value in gyro)}) °/s; accelerometer "
        f"({', '.join(f'{value:.3f}' for value in accel)}) m/s²"
    )
    return Verdict("biases, mean", None, None, "INFO", meaning)


def _solved(run: CamImuRun) -> Verdict:
    adjusted = run.found.adjusted
    count = 6 * adjusted.state.grid.count
    meaning = f"a trajectory of {run.found.knots_per_s:.0f} knots a second, {count} unknowns of it"
    status: Status = "PASS" if adjusted.settled else "FAIL"
    action = "" if adjusted.settled else "the minimum was not reached; set --knots, or record again"
    return Verdict("least squares settled", None, None, status, meaning, action)


def _other(run: CamImuRun) -> list[Verdict]:
    """How far the calibration to compare with is."""
    if run.job.compare is None:
        return []
    difference = difference_from(run)
    cov = run.found.cov[:7, :7] + (0.0 if run.job.compare.cov is None else run.job.compare.cov)
    sigmas = float(np.max(np.abs(difference) / np.sqrt(np.diagonal(cov))))
    small = (
        np.degrees(np.linalg.norm(difference[:3])) <= GOOD_ROTATION
        and 1e3 * np.linalg.norm(difference[3:6]) <= GOOD_TRANSLATION
        and 1e3 * abs(difference[6]) <= GOOD_OFFSET
    )
    status: Status = "PASS" if small or sigmas < GOOD_SIGMAS else "WARN"
    meaning = f"{apart_in_words(difference)} apart; the largest of the seven differences in σ"
    action = "" if status == "PASS" else "was the rig taken apart since, or the camera set otherwise?"
    return [Verdict(f"difference from {run.job.compare_name}", sigmas, None, status, meaning, action, "σ")]


def _truth(run: CamImuRun) -> list[Verdict]:
    """Errors of a demonstration."""
    if run.truth is None:
        return []
    errors = truth_errors(run)
    meant = "error against the rendered truth"
    rows = (
        ("true rotation error", errors["rotation_error_deg"], TRUE_ROTATION, "°"),
        ("true translation error", 1e3 * errors["translation_error_m"], TRUE_TRANSLATION, "mm"),
        ("true time offset error", 1e3 * errors["time_offset_error_s"], TRUE_OFFSET, "ms"),
    )
    verdicts = [
        Verdict(
            name,
            value,
            None,
            "PASS" if value <= bar else "FAIL",
            f"{meant}; at most {bar:g} {unit}",
            unit=unit,
        )
        for name, value, bar, unit in rows
    ]
    nees = errors["nees"] / errors["nees_dof"]
    status: Status = "PASS" if nees < 2.3 else "WARN"  # 99 % of seven degrees of freedom lie below 2.64
    return [
        *verdicts,
        Verdict(
            "NEES of the seven, a degree of freedom",
            nees,
            (0.24, 2.29),
            status,
            "1 on average where σ is honest",
        ),
    ]
