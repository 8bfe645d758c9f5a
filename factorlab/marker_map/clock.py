"""Two clocks: whether camera and IMU share a time, by how much one is ahead, and whether that changes.

The turns that the markers show from frame to frame are laid over those that the gyro integrates, at every
lag; the best is where the squares of what is left are least, to a fraction of a sample by a parabola.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.log import seconds
from sequential.manifold import quaternion_inverse, quaternion_log, quaternion_multiply, rotate
from sequential.sensors.recording import ImuRecording

__all__ = ["ClockOffset", "clock_offset", "require_overlap"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
FEWEST_TURNS = 12
LONGEST_S = 0.4  # between two frames whose turn is compared
OUTLIER_RAD = 0.2
LEAST_S = 1.0
STEP_S = 0.004


@dataclass(frozen=True)
class ClockOffset:
    """IMU time is camera time plus `offset_s`.

    Parameters
    ----------
    sigma_s : standard deviation of it
    explained : share of the turns' squares that the gyro explains at the best lag
    drift_s : how much later half is ahead of the first, and its standard deviation
    """

    offset_s: float
    sigma_s: float
    explained: float
    drift_s: tuple[float, float]


def require_overlap(frames: Ints, imu: ImuRecording) -> None:
    """Raise unless frames (F,) ns and IMU share a second or more.

    Raises
    ------
    DataError
        that tells both spans.
    """
    shared = (min(frames[-1], imu.t[-1]) - max(frames[0], imu.t[0])) * 1e-9
    if shared < min(LEAST_S, 0.5 * (frames[-1] - frames[0]) * 1e-9):
        spans = [f"{t[0] * 1e-9:.3f} to {t[-1] * 1e-9:.3f} s" for t in (frames, imu.t)]
        raise DataError(
            f"camera and IMU have no time in common: frames run from {spans[0]}, the IMU from {spans[1]}; "
            "give the frames' times by the IMU's clock with --stamps FILE, or --time-offset S (IMU time = "
            "camera time + S), or --time-offset auto to find it from the turns"
        )


def clock_offset(
    t: Ints, poses: Array, body_T_camera: Array, imu: ImuRecording, *, reach_s: float | None = None
) -> ClockOffset | None:
    """Compare turns.

    Parameters
    ----------
    t : (F,) ns, times of the poses on the camera's clock
    poses : (F, 7) world_T_camera
    reach_s : largest offset looked for; None lays the frames over the whole recording

    Returns
    -------
    ClockOffset or None
        None where there are too few turns, or none that tells a lag.
    """
    start, end = seconds(t[:-1], int(t[0])), seconds(t[1:], int(t[0]))
    turn = quaternion_log(quaternion_multiply(quaternion_inverse(poses[:-1, :4]), poses[1:, :4]))
    turn = rotate(body_T_camera[:4], turn)
    usable = (end - start < LONGEST_S) & (np.linalg.norm(turn, axis=1) < OUTLIER_RAD * 5)
    start, end, turn = start[usable], end[usable], turn[usable]
    if len(turn) < FEWEST_TURNS:
        return None
    at = seconds(imu.t, int(t[0]))
    assert imu.gyro is not None  # noqa: S101 - required at the door
    steps = 0.5 * (imu.gyro[1:] + imu.gyro[:-1]) * np.diff(at)[:, None]
    angle = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    low, high = (at[0] - start[0], at[-1] - end[-1]) if reach_s is None else (-reach_s, reach_s)
    if high - low < 3 * STEP_S:  # the IMU is not longer than the frames: lags on both sides, in part
        low, high = low - 0.5 * (end[-1] - start[0]), high + 0.5 * (end[-1] - start[0])
    lags = np.arange(low, high + STEP_S, STEP_S)
    left = np.array([_left(lag, start, end, turn, at, angle)[0] for lag in lags])
    best = int(np.argmin(left))
    offset, sigma, share = _peak(lags[best], start, end, turn, at, angle)
    if not np.isfinite(sigma):
        return None
    half = len(turn) // 2
    parts = [
        _peak(_nearest(offset, *rows), *rows)
        for rows in (
            (start[:half], end[:half], turn[:half], at, angle),
            (start[half:], end[half:], turn[half:], at, angle),
        )
    ]
    drift = (parts[1][0] - parts[0][0], float(np.hypot(parts[0][1], parts[1][1])))
    return ClockOffset(offset, sigma, share, drift)


def _nearest(lag: float, start: Array, end: Array, turn: Array, at: Array, angle: Array) -> float:
    """The best lag within a tenth of a second."""
    lags = lag + STEP_S * np.arange(-25, 26)
    return float(lags[np.argmin([_left(one, start, end, turn, at, angle)[0] for one in lags])])


def _left(lag: float, start: Array, end: Array, turn: Array, at: Array, angle: Array) -> tuple[float, int]:
    """Mean square of what is left of the turns at a lag (bias taken off), and how many were compared."""
    inside = (start + lag >= at[0]) & (end + lag <= at[-1])
    if inside.sum() < max(FEWEST_TURNS // 2, 0.3 * len(turn)):
        return np.inf, 0
    ends = [
        np.column_stack([np.interp(x[inside] + lag, at, column) for column in angle.T]) for x in (end, start)
    ]
    gap = turn[inside] - (ends[0] - ends[1])
    span = (end - start)[inside, None]
    gap = gap - span * (np.median(gap / span, axis=0))
    size = np.minimum(np.linalg.norm(gap, axis=1), OUTLIER_RAD)
    return float(np.mean(size**2)), int(inside.sum())


def _peak(
    lag: float, start: Array, end: Array, turn: Array, at: Array, angle: Array
) -> tuple[float, float, float]:
    """Refine by parabolas; the lag, its standard deviation, and the share of squares explained."""
    bend = 0.0
    for _ in range(2):
        values = np.array([_left(lag + d, start, end, turn, at, angle)[0] for d in (-STEP_S, 0.0, STEP_S)])
        bend = values[0] - 2 * values[1] + values[2]
        if not (np.isfinite(values).all() and bend > 0):
            return lag, float("inf"), 0.0
        lag += float(np.clip(0.5 * STEP_S * (values[0] - values[2]) / bend, -STEP_S, STEP_S))
    least, count = _left(lag, start, end, turn, at, angle)
    usual = float(np.mean(np.sum((turn - turn.mean(axis=0)) ** 2, axis=1)))
    curvature = bend / STEP_S**2  # of the mean square, so of count terms
    sigma = float(np.sqrt(2.0 * (least / 3.0) / (curvature * count))) if count else float("inf")
    return lag, sigma, 1.0 - least / max(usual, 1e-12)
