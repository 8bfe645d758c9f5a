"""An image run on a recording, beside what the same filter computes in double precision."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from factorlab.attitude import Reference, Solved
from factorlab.firmware.build import Image, build, constants_header
from factorlab.firmware.emulation import Emulation, mpu6050_counts
from factorlab.firmware.recorded import build_host, frames_unlike, run_host
from factorlab.firmware.targets import emulate
from sequential.attitude import AttitudeHistory, attitude_from_angles
from sequential.errors import DataError
from sequential.evaluate import attitude_error
from sequential.evaluate.attitude_error import AttitudeError
from sequential.sensors import ImuCalibration, ImuRecording

__all__ = ["MODELS", "Trial", "as_read", "run_trial"]

Array = NDArray[np.float64]
PERIOD_NS = 10_000_000
# module of the firmware: the Python filter; with c- before it, and -q behind it in fixed point, the C filter
MODELS = {
    "mahony": "mahony",
    "tilt": "kalman",
    "complementary": "complementary",
    "error_state": "error-state",
}


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """What came out.

    Parameters
    ----------
    image : that ran
    emulation : its bytes, and when
    board : the filter on the board; a sample whose frame was lost has no row
    model : the Python filter on the same samples; None where the image has no filter
    apart : (N,) angle between both, degrees
    solved : both, for figures; with errors where there is a truth
    unlike : frames that say something else than the same application on this computer
    """

    image: Image
    emulation: Emulation
    board: AttitudeHistory
    model: AttitudeHistory | None
    apart: Array | None
    solved: tuple[Solved, ...]
    unlike: int


def run_trial(
    recording: ImuRecording,
    target: str,
    *,
    filter: str | None = None,  # noqa: A002 - the word of the Makefiles
    mode: str = "q",
    calibration: ImuCalibration | None = None,
    truth: Reference | None = None,
    image: Path | None = None,
) -> Trial:
    """Build an image, run it in its emulator on what the board's sensor would have read.

    Parameters
    ----------
    recording : accelerometer and gyro in SI, as the sensor reads them
    target : "m4" or "avr"
    filter : module of firmware/core; the target's default unless given
    mode : frames: "q" quaternion, "a" angles, "t" text
    calibration : compiled in, and given to the Python filter
    truth : at the samples of the recording
    image : folder for the image, which is kept then

    Raises
    ------
    DataError, ToolMissingError
        where the recording is too short, there is no such filter, or a tool is missing.
    """
    with tempfile.TemporaryDirectory(prefix="factorlab-image-") as scratch:
        made = build(target, image or Path(scratch), filter=filter, calibration=calibration)
        counts = mpu6050_counts(recording)
        emulation = emulate(made, counts, mode)
        constants = None if calibration is None else constants_header(calibration, Path(scratch))
        host = build_host(Path(scratch) / "host", filter=made.filter, calibration=constants)
        unlike = frames_unlike(emulation, run_host(host, counts, mode=mode))
    there = np.array([frame is not None for frame in emulation.frames])
    if there.sum() < 2:
        raise DataError(f"the image for {made.board} sent {there.sum()} frames for {len(counts)} samples")
    t = recording.t[0] + PERIOD_NS * np.arange(len(counts))
    path = emulation.world_q_body if mode == "q" else attitude_from_angles(emulation.roll_pitch_yaw)
    norms = np.linalg.norm(path[there], axis=1, keepdims=True)
    board = AttitudeHistory(t[there], path[there] / np.where(norms > 0, norms, 1.0), name=made.filter)
    read = as_read(counts, t, recording.name, calibration)
    return _compared(made, emulation, board, read, there, truth, recording, unlike)


def as_read(
    counts: NDArray[np.int16], t: NDArray[np.int64], name: str, calibration: ImuCalibration | None = None
) -> ImuRecording:
    """What the filter of a board works on: rounded counts (N, 7), calibrated, as SI."""
    accel, gyro = (
        _si(kind, part.astype(np.float64), calibration)
        for kind, part in (("accel", counts[:, :3]), ("gyro", counts[:, 4:]))
    )
    return ImuRecording(t, accel, gyro, name=name)


def _si(kind: str, counts: Array, calibration: ImuCalibration | None) -> Array:
    """Counts of one sensor by its calibration, which may have been made from readings of nominal gain."""
    from sequential.sensors.calibration_header import nominal_calibration

    own = None if calibration is None else getattr(calibration, kind)
    if own is not None and own.unit_in == "counts":
        return np.asarray(own.apply(counts))
    readings = getattr(nominal_calibration(), kind).apply(counts)
    return np.asarray(readings if own is None else own.apply(readings))


def _compared(
    image: Image,
    emulation: Emulation,
    board: AttitudeHistory,
    read: ImuRecording,
    there: NDArray[np.bool_],
    truth: Reference | None,
    recording: ImuRecording,
    unlike: int,
) -> Trial:
    """Beside the Python filter, and the truth where there is one."""
    from factorlab.attitude import make_estimator

    module, _, kind = image.filter.rpartition("_")
    if module not in MODELS:
        return Trial(image, emulation, board, None, None, (), unlike)
    model_name = MODELS[module]
    port_name = f"c-{model_name}-q" if kind == "q" else f"c-{model_name}"
    whole = make_estimator(model_name).estimate(read)
    model = AttitudeHistory(board.t, whole.world_q_body[there], name=model_name)
    apart = np.degrees(attitude_error(board.world_q_body, model.world_q_body).errors[:, 0])
    rows = np.clip(np.searchsorted(recording.t, board.t), 0, len(recording) - 1)
    solved = [
        Solved(name, history, 0.0, _error(history, truth, rows))
        for name, history in ((port_name, board), (model_name, model))
    ]
    return Trial(image, emulation, board, model, apart, tuple(solved), unlike)


def _error(
    history: AttitudeHistory, truth: Reference | None, rows: NDArray[np.int64]
) -> AttitudeError | None:
    """Against the truth at some of its rows; None where it judges none of them (BROAD: nothing moves)."""
    if truth is None:
        return None
    seen, where = truth.world_q_body[rows], truth.where[rows]
    if not (where & np.isfinite(seen).all(axis=1)).any():
        return None
    return attitude_error(history.world_q_body, seen, where, heading_offset="mean")
