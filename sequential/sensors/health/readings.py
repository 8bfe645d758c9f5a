"""The readings of each axis: saturated, stuck, frozen, repeated, coarse."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.sensors.finding import Finding, Severity
from sequential.sensors.health.clock import FEWEST, moment
from sequential.sensors.recording import ImuRecording
from sequential.sensors.turning import quietest

__all__ = ["WORDS", "reading_findings"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
WORDS = {"accel": "accelerometer", "gyro": "gyro", "mag": "magnetometer"}
AXES = "xyz"
STUCK_S, FEWEST_EQUAL = 2.0, 50  # s and samples: a run of equal values that is worth a word
STUCK_SHARE = 0.2  # of the recording
SATURATED_SHARE = 0.05  # of the samples, above which integrals are worthless
STEEP = 5.0  # steps by which a clipped signal enters or leaves the end of its range, at least
FINE_STEPS = 40  # an axis must span so many steps before its ends are believed to be stops


def reading_findings(recording: ImuRecording) -> list[Finding]:
    """Findings about each axis of each sensor."""
    if len(recording) < FEWEST:
        return []
    found = []
    for sensor in recording.sensors:
        values, rows = _known(recording, sensor)
        if len(rows) < FEWEST:
            continue
        seconds = recording.seconds[rows]
        frozen = _longest(_runs(values), seconds)
        if frozen is not None:
            found += _frozen(sensor, seconds, frozen)
        for axis in range(3):
            starts, lengths = _runs(values[:, [axis]])
            stretch = _longest((starts, lengths), seconds)
            if stretch is not None and not (frozen and _mostly(stretch, frozen)):
                found.append(_stuck(f"{WORDS[sensor]} {AXES[axis]}", seconds, stretch))
            found += _saturated(f"{WORDS[sensor]} {AXES[axis]}", seconds, values[:, axis], starts, lengths)
        found += _coarse(recording, sensor, values)
    return found + _repeated(recording)


def _known(recording: ImuRecording, sensor: str) -> tuple[Array, Ints]:
    """The rows in which a sensor has a reading."""
    values = getattr(recording, sensor)
    rows = np.flatnonzero(np.isfinite(values[:, 0]))
    return values[rows], rows


def _runs(values: Array) -> tuple[Ints, Ints]:
    """Start and length of every run of equal rows."""
    starts = np.flatnonzero(np.concatenate([[True], (values[1:] != values[:-1]).any(axis=1)]))
    return starts, np.diff(np.concatenate([starts, [len(values)]]))


def _longest(runs: tuple[Ints, Ints], seconds: Array) -> tuple[int, int] | None:
    """First and last sample of a run of seconds, where no other run is nearly so long; None elsewhere."""
    starts, lengths = runs
    worst = int(np.argmax(lengths))
    first, last = int(starts[worst]), int(starts[worst] + lengths[worst] - 1)
    usual = float(np.quantile(np.delete(lengths, worst), 0.999)) if len(lengths) > 1 else 1.0
    if lengths[worst] < max(FEWEST_EQUAL, 10.0 * usual) or seconds[last] - seconds[first] < STUCK_S:
        return None
    return first, last


def _mostly(part: tuple[int, int], whole: tuple[int, int]) -> bool:
    """Whether nine tenths of a stretch lie in another one."""
    shared = min(part[1], whole[1]) - max(part[0], whole[0])
    return shared >= 0.9 * (part[1] - part[0])


def _frozen(sensor: str, seconds: Array, stretch: tuple[int, int]) -> list[Finding]:
    """All axes of a sensor at once; a constant magnetometer is told elsewhere."""
    first, last = stretch
    if last - first + 1 == len(seconds):
        what = f"the {WORDS[sensor]} gives the same reading from beginning to end"
        do = "check the wiring and the logger: it sends its first sample again and again"
        return [] if sensor == "mag" else [Finding("fail", what, do=do)]
    what = f"the {WORDS[sensor]} gives the same reading for {seconds[last] - seconds[first]:.1f} s"
    do = "cut that part out with slice; check the logger"
    return [Finding("warn", what, moment(seconds[first], seconds[last]), do)]


def _stuck(name: str, seconds: Array, stretch: tuple[int, int]) -> Finding:
    """One value for seconds, in an axis that otherwise changes all the time."""
    first, last = stretch
    if last - first + 1 == len(seconds):
        do = "check the wiring, or leave this sensor out"
        return Finding("fail", f"{name} is stuck: one value from beginning to end", do=do)
    lasted = float(seconds[last] - seconds[first])
    share = lasted / float(seconds[-1] - seconds[0])
    what, do = (
        f"{name} is stuck at one value for {lasted:.1f} s",
        "cut that part out with slice; check the wiring",
    )
    return Finding("fail" if share > STUCK_SHARE else "warn", what, moment(seconds[first], seconds[last]), do)


def _saturated(name: str, seconds: Array, values: Array, starts: Ints, lengths: Ints) -> list[Finding]:
    """An extreme value that is held for longer than any other value ever is: the end of the range."""
    step = _step(values)
    if step == 0.0 or np.ptp(values) < FINE_STEPS * step:
        return []
    held, usual = values[starts], float(np.quantile(lengths, 0.99))
    found = []
    for stop in (values.max(), values.min()):
        at_stop = held == stop
        long = at_stop & (lengths >= max(3.0, 2.0 * usual)) & _abrupt(values, starts, lengths, STEEP * step)
        many = int(lengths[at_stop].sum())
        if not long.any() or many < 5:
            continue
        first = int(np.flatnonzero(long)[0])
        where = moment(seconds[starts[first]], seconds[starts[first] + lengths[first] - 1])
        what = f"{name} saturates at {stop:.5g} in {many} samples ({many / len(values):.2%})"
        do = "set a larger range of the sensor, or move more slowly"
        severity: Severity = "fail" if many > SATURATED_SHARE * len(values) else "warn"
        found.append(Finding(severity, what, f"first at {where}", do))
    return found


def _abrupt(values: Array, starts: Ints, lengths: Ints, least: float) -> NDArray[np.bool_]:
    """Runs that are entered or left by a jump; a smooth peak is flat as well, but has gentle flanks."""
    before = np.abs(values[np.maximum(starts - 1, 0)] - values[starts])
    after = np.abs(values[np.minimum(starts + lengths, len(values) - 1)] - values[starts])
    return np.asarray(np.maximum(before, after) >= least)


def _step(values: Array) -> float:
    """The smallest step between two values that occur; 0 where there is one value."""
    levels = np.unique(values)
    return float(np.diff(levels).min()) if len(levels) > 1 else 0.0


def _coarse(recording: ImuRecording, sensor: str, values: Array) -> list[Finding]:
    """Resolution against the noise at rest: below half a step, the noise is that of rounding."""
    calm = values[quietest(values, recording.rate)]
    found = []
    for axis in range(3):
        levels, counts = np.unique(values[:, axis], return_counts=True)
        if len(levels) < 2 or len(levels) > 0.2 * len(values) or len(calm) < 50:
            continue
        step = float(np.quantile(np.diff(levels), 0.1))
        noise = float(np.std(np.diff(calm[:, axis]))) / np.sqrt(2.0)
        if noise < 0.4 * step and counts.max() > 5:
            what = (
                f"{WORDS[sensor]} {AXES[axis]} is coarse: a step is {step:.3g}, the noise at rest {noise:.2g}"
            )
            do = "choose a smaller range; a noise figure from this is that of rounding"
            found.append(Finding("note", what, do=do))
    return found


def _repeated(recording: ImuRecording) -> list[Finding]:
    """Samples that repeat the one before in every axis: a logger faster than its sensor."""
    inertial = [v for v in (recording.accel, recording.gyro) if v is not None]
    if not inertial:
        return []
    table = np.hstack(inertial)
    lengths = _runs(table)[1]
    lengths = lengths[lengths < FEWEST_EQUAL]  # a stall is told elsewhere
    share = 1.0 - len(lengths) / max(int(lengths.sum()), 1)
    if not 0.1 < share < 1.0:
        return []
    own = recording.rate * (1.0 - share)
    what = f"{share:.0%} of the samples repeat the one before: the sensor itself gives {own:.3g} Hz"
    do = "log at the sensor's own rate; noise densities from repeated samples are too small"
    return [Finding("warn", what, do=do)]
