"""Samples of an IMU cut at the frames: each piece holds the mean of its two ends."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sequential.log import seconds
from sequential.sensors.recording import ImuRecording

if TYPE_CHECKING:
    from factorlab.graph.marker_inertial import Segment

__all__ = ["LONGEST_S", "cut_at_frames"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
LONGEST_S = 0.25
"""A pause of the IMU beyond this, and beyond five samples, is not bridged."""
SAMPLES = 5.0


def cut_at_frames(imu: ImuRecording, frames: Ints) -> list[Segment | None]:
    """One segment for each pair of neighbouring frames (F,) ns; None where the IMU paused or was not on.

    Readings are taken as samples of a continuous signal, straight from one to the next: the mean of both ends
    of a piece makes an integration of second order, where a held sample makes one of first order.
    """
    from factorlab.graph.marker_inertial import Segment

    origin = int(frames[0])
    at, cuts = seconds(imu.t, origin), seconds(frames, origin)
    assert imu.accel is not None and imu.gyro is not None  # noqa: S101, PT018 - required at the door
    values = np.hstack([imu.accel, imu.gyro])
    limit = max(LONGEST_S, SAMPLES / imu.rate)
    edges = np.unique(np.concatenate([at, cuts]))
    edges = edges[(edges >= cuts[0]) & (edges <= cuts[-1])]
    read = np.column_stack([np.interp(edges, at, column) for column in values.T])
    middle, dt = 0.5 * (read[1:] + read[:-1]), np.diff(edges)
    first = np.searchsorted(edges, cuts)
    after = np.searchsorted(at, cuts, side="right")
    segments: list[Segment | None] = []
    for k in range(len(cuts) - 1):
        low, high = max(after[k] - 1, 0), min(np.searchsorted(at, cuts[k + 1]), len(at) - 1)
        covered = at[0] <= cuts[k] and cuts[k + 1] <= at[-1]
        pause = np.diff(at[low : high + 1]).max(initial=0.0)
        if not covered or pause > limit:
            segments.append(None)
            continue
        rows = slice(first[k], first[k + 1])
        segments.append(Segment(middle[rows, :3], middle[rows, 3:], dt[rows]))
    return segments
