"""What can be told before anything is fitted: too little, another unit, another time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from vision3d.inertial.alignment import Aligned
from vision3d.inertial.problem import Corners, Imu

__all__ = ["SEARCH_S", "check_alignment", "check_readings", "require_overlap", "search_range"]

Array = NDArray[np.float64]
FEWEST_FRAMES = 20
SHORTEST_S = 3.0
SEARCH_S = 1.0
DEGREES = float(np.degrees(1.0))
NEARLY, WRONG = 1.35, 1.5  # of a ratio
LEAST_CORRELATION = 0.5
GRAVITIES = (0.7, 1.4)  # of what an accelerometer reads at the median, over gravity


def check_readings(corners: Corners, imu: Imu, gravity: float) -> None:
    """Raise unless there is enough to begin with."""
    if len(corners.t) < FEWEST_FRAMES:
        raise DataError(
            f"the board is found in {len(corners.t)} frames; at least {FEWEST_FRAMES} are needed: record "
            "half a minute with the whole board in view"
        )
    if len(imu.t) < 50:
        raise DataError(f"the IMU's recording holds {len(imu.t)} samples; record half a minute")
    for what, t in (("frames", corners.t), ("samples of the IMU", imu.t)):
        if (np.diff(t) <= 0.0).any():
            k = int(np.flatnonzero(np.diff(t) <= 0.0)[0]) + 1
            raise DataError(
                f"the stamps of the {what} do not increase at number {k}; sort them and drop repeats"
            )
    if (length := corners.t[-1] - corners.t[0]) < SHORTEST_S:
        raise DataError(
            f"the board is seen for {length:.1f} s; a calibration takes {SHORTEST_S:g} s at the very least, "
            "half a minute does well"
        )
    typical = float(np.median(np.linalg.norm(imu.accel, axis=1)))
    if GRAVITIES[0] < typical < GRAVITIES[1]:
        raise DataError(
            f"the accelerometer reads {typical:.2f} at the median, where gravity is {gravity:.2f} m/s²: it "
            "is in g; say --units accel=g"
        )
    if not 0.5 * gravity < typical < 2.0 * gravity:
        raise DataError(
            f"the accelerometer reads {typical:.3g} at the median, where gravity is {gravity:.2f} m/s²; give "
            "its unit with --units accel=…, or calibrate it first (factorlab calibrate accel)"
        )


def search_range(
    corners: Corners, imu: Imu, search_s: float | None, *, common_clock: bool
) -> tuple[float, float]:
    """Offsets of the clocks to try, s.

    Raises
    ------
    DataError
        where the recordings do not overlap at any of them.
    """
    if common_clock:
        reach = SEARCH_S if search_s is None else search_s
        low, high = -reach, reach
    else:
        short = 0.5 * min(corners.t[-1] - corners.t[0], imu.t[-1] - imu.t[0])
        low = imu.t[0] - corners.t[-1] + short
        high = imu.t[-1] - corners.t[0] - short
        if search_s is not None:
            middle = imu.t[0] - corners.t[0]
            low, high = max(low, middle - search_s), min(high, middle + search_s)
    require_overlap((corners.t[0], corners.t[-1]), (imu.t[0], imu.t[-1]), (low, high))
    return low, high


def require_overlap(
    frames: tuple[float, float], imu: tuple[float, float], offsets: tuple[float, float]
) -> None:
    """Raise unless the frames and the IMU overlap at some of the offsets; begins and ends in s.

    Raises
    ------
    DataError
        with both spans.
    """
    low, high = offsets
    common = min(frames[1] + high, imu[1]) - max(frames[0] + low, imu[0])
    # a recording that is itself too short is another fault
    if common >= min(SHORTEST_S, 0.5 * (frames[1] - frames[0]), 0.5 * (imu[1] - imu[0])):
        return
    raise DataError(
        f"camera and IMU do not overlap in time: the frames span {_span(frames)}, the IMU {_span(imu)}, and "
        f"offsets of the clocks of up to {max(abs(low), abs(high)):g} s are tried; if their clocks have "
        f"nothing to do with each other (their beginnings are {imu[0] - frames[0]:.3f} s apart), say "
        "--clocks apart"
    )


def _span(ends: tuple[float, float]) -> str:
    return f"{ends[0]:.2f} to {ends[1]:.2f} s"


def check_alignment(aligned: Aligned, imu: Imu, corners: Corners) -> None:
    """Raise where gyro and camera do not turn alike."""
    for factor, words in (
        (DEGREES, "the gyro is in degrees a second where radians are needed; say --units gyro=deg/s"),
        (1.0 / DEGREES, "the gyro was converted from degrees to radians twice; say --units gyro=rad/s"),
    ):
        if factor / NEARLY < aligned.gain < factor * NEARLY:
            raise DataError(f"the gyro turns {aligned.gain:.3g} times as fast as the camera: {words}")
    if aligned.correlation >= LEAST_CORRELATION and not 1.0 / WRONG < aligned.gain < WRONG:
        raise DataError(
            f"the gyro turns {aligned.gain:.3g} times as fast as the camera; give its unit with --units "
            "gyro=…, calibrate its gain (factorlab calibrate gyro), and see that the camera's calibration is "
            "that of these pictures"
        )
    if aligned.mirrored:
        raise DataError(
            "the gyro turns as the camera's mirror image does: one axis has the wrong sign, or two are "
            "exchanged, so that its axes are left-handed; set --columns right"
        )
    if aligned.correlation < LEAST_CORRELATION:
        raise DataError(
            f"at no offset of the clocks does the gyro turn as the camera does (best correlation "
            f"{aligned.correlation:.2f} at {aligned.time_offset_s:.3f} s); are video and IMU log of the same "
            "moment, and did they turn at all? Offsets tried: "
            f"{aligned.offsets_s[0]:.2f} to {aligned.offsets_s[-1]:.2f} s; --search tries more"
        )
