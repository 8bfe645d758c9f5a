"""The part of a recording from which noise can be read: evenly sampled, and still."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.sensors.noise_fit import FEWEST
from sequential.sensors.recording import ImuRecording

__all__ = ["longest_even_stretch", "longest_still_stretch"]

Array = NDArray[np.float64]
PAUSE = 5.5  # intervals: a few lost samples shift the noise in time, which no spectrum notices
SAME_RATE, CHUNKS = 1.1, 16
BLOCK_S, BLOCK = 1.0, 50  # a block lasts a second, and has 50 samples at least
MOVING = 4.0  # times the variance of the quietest blocks
QUIET = 0.1  # share of the blocks, and there are few recordings with fewer still ones
SHORTEST = 4  # blocks


def longest_even_stretch(recording: ImuRecording) -> tuple[ImuRecording, list[str]]:
    """The longest part without a pause of more than five intervals, and what is to be said about the rest.

    Raises
    ------
    DataError
        where that part has fewer than 64 samples, or its rate changes.
    """
    dt = recording.dt
    if len(dt) < FEWEST - 1:
        raise DataError(
            f"recording {recording.name!r} has {len(recording)} samples; reading its noise needs {FEWEST} at "
            "least, and minutes to see more than white noise"
        )
    pauses = np.flatnonzero(dt > PAUSE * np.median(dt))
    starts, stops = np.concatenate([[0], pauses + 1]), np.concatenate([pauses + 1, [len(recording)]])
    longest = int(np.argmax(stops - starts))
    stretch = recording.select(slice(int(starts[longest]), int(stops[longest])))
    if len(stretch) < FEWEST:
        raise DataError(
            f"recording {recording.name!r} pauses {len(pauses)} times, and no stretch between has {FEWEST} "
            "samples; record without pauses"
        )
    medians = np.array(
        [np.median(part) for part in np.array_split(stretch.dt, min(CHUNKS, len(stretch) // 8))]
    )
    if medians.max() > SAME_RATE * medians.min():
        raise DataError(
            f"the rate of recording {recording.name!r} changes from {1 / medians.min():.4g} to "
            f"{1 / medians.max():.4g} Hz; give a part of one rate, as recording.slice(start_s, stop_s)"
        )
    notes = []
    if len(pauses):
        notes.append(
            f"The recording pauses {len(pauses)} times; the longest stretch without a pause, "
            f"{stretch.duration:.4g} s of {recording.duration:.4g} s, was used."
        )
    lost = int(np.sum(np.round(stretch.dt / np.median(stretch.dt)) - 1))
    if lost > 0.001 * len(stretch):
        notes.append(
            f"{lost} of {len(stretch) + lost} samples are missing; the others were taken as evenly spaced."
        )
    return stretch, notes


def longest_still_stretch(recording: ImuRecording) -> tuple[ImuRecording, list[str]]:
    """The longest part in which no second is much louder than the quietest tenth, and what is to be said.

    Noise, flicker and random walks are as loud in one second as in the next; a hand, a knock or a vibration
    is not.

    Raises
    ------
    DataError
        where no part of four seconds (or 200 samples) is still.
    """
    size = max(BLOCK, round(BLOCK_S * recording.rate))
    count = len(recording) // size
    loud = np.zeros(count, dtype=bool)
    for values in (recording.accel, recording.gyro):
        if values is not None and count > SHORTEST:
            variance = _variances(values, size, count)
            # rounding alone makes a twelfth of a step squared, which a quiet second may hide
            level = max(float(np.quantile(variance, QUIET)), float(np.sum(_steps(values) ** 2)) / 12.0)
            loud |= variance > MOVING * level
    if not loud.any():
        return recording, []
    edges = np.flatnonzero(np.concatenate([[True], loud, [True]]))
    longest = int(np.argmax(np.diff(edges)))
    start, stop = int(edges[longest]), int(edges[longest + 1]) - 1
    if stop - start < SHORTEST:
        lasts = (stop - start) * size / recording.rate
        raise DataError(
            f"recording {recording.name!r} moves: its longest still part lasts {lasts:.3g} s; lay the sensor "
            "down and record for minutes"
        )
    # the last block is followed by less than one of samples
    part = recording.select(slice(start * size, len(recording) if stop == count else stop * size))
    first = float((part.t[0] - recording.t[0]) * 1e-9)
    said = (
        f"The recording is not still throughout: {first:.4g} to {first + part.duration:.4g} s of "
        f"{recording.duration:.4g} s was used, the longest still part."
    )
    return part, [said]


def _steps(values: Array) -> Array:
    """Least difference between neighbours that differ, for each axis: the resolution, or nearly nothing."""
    moves = np.abs(np.diff(values, axis=0))
    least = np.where(moves > 0, moves, np.inf).min(axis=0)
    return np.asarray(np.where(np.isfinite(least), least, 0.0))


def _variances(values: Array, size: int, count: int) -> Array:
    """Variance about a straight line in each block (count,), summed over the axes, outliers aside."""
    blocks = values[: size * count].reshape(count, size, -1)
    t = np.arange(size) - 0.5 * (size - 1)
    rest = blocks - blocks.mean(axis=1, keepdims=True)
    rest = rest - t[:, None] * (np.einsum("i,bia->ba", t, rest) / (t @ t))[:, None]
    squares = np.sort(np.sum(rest**2, axis=2), axis=1)
    return np.asarray(squares[:, : size - size // 20].mean(axis=1))
