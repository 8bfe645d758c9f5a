"""Where a recording is still: dwells, found by the variance of a sliding window against a level of rest.

The rule of Tedaldi et al. (ICRA 2014, section IV) compares the variance with a multiple of that of a still
initial part.  Here the level of rest may come from the recording itself, and every dwell is judged once more
against its own level, so that a vibrating table is as still as it gets.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, MissingStreamError
from sequential.sensors.recording import ImuRecording

__all__ = ["StillDetector", "window_variance"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
TURNING = 0.05  # of the fastest rate


@dataclass(frozen=True, slots=True)
class StillDetector:
    """Settings of the search for still parts.

    Parameters
    ----------
    window : length over which a variance is taken, s
    shortest : dwells below this are left out, s; half a window at either end is not used
    initial : seconds from the start that are known to be still; None: the level of rest is the most
        common one of the recording
    factor : variance over the level of rest up to which a window is still; None: where the recording's
        own still and moving windows part best (Otsu), between 3 and 100
    settle : variance over a dwell's own level, above which its ends are cut off
    knock : a shorter disturbance inside a dwell is left out and does not end it, s
    """

    window: float = 0.5
    shortest: float = 1.0
    initial: float | None = None
    factor: float | None = None
    settle: float = 3.0
    knock: float = 0.6

    def __post_init__(self) -> None:
        for name in ("window", "shortest", "settle"):
            if not getattr(self, name) > 0:
                raise DataError(f"StillDetector.{name} is {getattr(self, name)}; expected more than zero")

    def levels(self, recording: ImuRecording) -> tuple[Array, float, float]:
        """Variance around every sample (N,), the level of rest, and the threshold between rest and motion.

        Of the accelerometer, in its units squared; of the gyro where there is no accelerometer.
        """
        values = recording.accel if recording.accel is not None else recording.gyro
        if values is None:
            raise MissingStreamError(
                f"recording {recording.name!r} has neither accelerometer nor gyro: stillness cannot be seen"
            )
        variance = window_variance(values, self.samples(recording))
        rest = self._rest(variance, recording)
        factor = self._factor(variance / rest) if self.factor is None else self.factor
        return variance, rest, factor * rest

    def _factor(self, ratio: Array) -> float:
        """Where still and moving windows part best, from 3 to 100."""
        return float(np.clip(10 ** _split(np.log10(np.clip(ratio, 0.1, 1e7))), 3.0, 100.0))

    def samples(self, recording: ImuRecording) -> int:
        """Samples of one window."""
        if len(recording) < 3 or recording.duration < self.window:
            raise DataError(
                f"recording {recording.name!r} lasts {recording.duration:.2f} s, a window of stillness "
                f"{self.window:g} s: record for longer"
            )
        return max(5, round(self.window * recording.rate))

    def _rest(self, variance: Array, recording: ImuRecording) -> float:
        tiny = 1e-12 * float(variance.max()) + 1e-30  # a simulated sensor may be noiseless
        if self.initial is None:
            logs = np.log(variance + tiny)
            lower = logs[logs <= _split(logs)]  # motion may be more common than rest
            return max(float(np.exp(_mode(lower, 0.05))), tiny)
        inside = recording.seconds <= self.initial
        if inside.sum() < 2 * self.samples(recording):
            raise DataError(f"initial = {self.initial:g} s is less than two windows of {self.window:g} s")
        return max(float(np.median(variance[inside])), tiny)

    def find(self, recording: ImuRecording) -> list[NDArray[np.int64]]:
        """Rows of every dwell, in order; the rows of one are consecutive but for knocks left out."""
        variance, _, threshold = self.levels(recording)
        still = (variance <= threshold) & ~self._turning(recording)
        half = self.samples(recording) // 2
        certain = self.shortest - min(self.window, self.shortest / 2)
        fewest = max(3, round(certain * recording.rate))
        gap = round(self.knock * recording.rate) + 2 * half
        found = []
        for start, stop in _bridged(still, gap, recording):
            own = self._settled(variance[start:stop], still[start:stop], fewest)
            if own is not None and len(own) >= fewest:
                found.append(start + own)
        return found

    def _turning(self, recording: ImuRecording) -> Mask:
        """Where the gyro's mean over a window is not its rest: a turn at a constant rate varies little."""
        if recording.gyro is None:
            return np.zeros(len(recording), dtype=bool)
        count = self.samples(recording)
        mean = window_mean(recording.gyro, count)
        rest = np.array([_mode(column) for column in mean.T])
        off = np.linalg.norm(mean - rest, axis=1)
        noise = np.sqrt(np.quantile(window_variance(recording.gyro, count), 0.1) / count)
        peak = float(np.linalg.norm(recording.gyro - rest, axis=1).max())
        return np.asarray(off > max(TURNING * peak, 8 * noise))

    def _settled(self, variance: Array, still: Mask, fewest: int) -> NDArray[np.int64] | None:
        """Rows of a dwell whose variance is near the dwell's own level."""
        if int(still.sum()) < fewest:
            return None
        level = float(np.quantile(variance[still], 0.4))
        return np.flatnonzero(still & (variance <= self.settle * level))


def window_variance(values: Array, count: int) -> Array:
    """Sum over the axes (N, 3) of the variance in a window of `count` samples centred on each, (N,).

    Windows at the ends are the nearest whole ones.
    """
    centred = values - np.median(values, axis=0)
    squares = np.sum(window_mean(centred**2, count) - window_mean(centred, count) ** 2, axis=1)
    return np.asarray(np.clip(squares, 0.0, None))


def window_mean(values: Array, count: int) -> Array:
    """Mean (N, 3) over the same windows."""
    summed = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    mean = (summed[count:] - summed[:-count]) / count
    before = count // 2
    return np.asarray(np.pad(mean, ((before, count - 1 - before), (0, 0)), mode="edge"))


def _mode(values: Array, enough: float = 0.0) -> float:
    """Most common value: the half-sample mode (Bickel and Frühwirth, 2006), to a width of `enough`."""
    ordered = np.sort(values)
    while len(ordered) > 3:
        half = (len(ordered) + 1) // 2
        widths = ordered[half - 1 :] - ordered[: len(ordered) - half + 1]
        first = int(np.argmin(widths))
        ordered = ordered[first : first + half]
        if widths[first] <= enough:
            break
    return float(np.median(ordered))


def _split(values: Array, bins: int = 128) -> float:
    """Value that parts low from high ones best (Otsu); the largest where there is one level only."""
    counts, edges = np.histogram(values, bins)
    middle = (edges[1:] + edges[:-1]) / 2
    low = np.cumsum(counts)
    high = low[-1] - low
    total = np.cumsum(counts * middle)
    with np.errstate(divide="ignore", invalid="ignore"):
        between = low * high * (total / low - (total[-1] - total) / high) ** 2
    return float(middle[int(np.nanargmax(between))] if np.isfinite(between).any() else edges[-1])


def _bridged(still: Mask, gap: int, recording: ImuRecording) -> list[tuple[int, int]]:
    """Runs of still samples [start, stop), joined over gaps that end where they began."""
    step = np.diff(still.astype(np.int8), prepend=0, append=0)
    runs = [
        (int(a), int(b)) for a, b in zip(np.flatnonzero(step == 1), np.flatnonzero(step == -1), strict=True)
    ]
    values = recording.accel if recording.accel is not None else recording.gyro
    assert values is not None  # noqa: S101 - levels() has looked
    joined: list[tuple[int, int]] = []
    for start, stop in runs:
        if joined and start - joined[-1][1] <= gap and _alike(values, joined[-1], (start, stop)):
            joined[-1] = (joined[-1][0], stop)
        else:
            joined.append((start, stop))
    return joined


def _alike(values: Array, before: tuple[int, int], after: tuple[int, int]) -> bool:
    """Whether two runs read the same: means that differ by less than one standard deviation of a sample."""
    a, b = values[before[0] : before[1]], values[after[0] : after[1]]
    spread = np.sqrt(np.minimum(a.var(axis=0), b.var(axis=0)).sum())
    return bool(np.linalg.norm(a.mean(axis=0) - b.mean(axis=0)) <= spread + 1e-12)
