"""The stamps of a recording: too few, pauses, lost samples, jitter, changes of the rate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.sensors.finding import Finding
from sequential.sensors.recording import ImuRecording

__all__ = ["FEWEST", "clock_findings", "moment"]

Array = NDArray[np.float64]
FEWEST = 10  # samples
SHORT_S = 10.0
PAUSE = 5.0  # median intervals
PAUSE_S = 0.5
JITTER = 0.25  # standard deviation of the interval, of its median
RATE_CHANGE = 0.15


def clock_findings(recording: ImuRecording) -> list[Finding]:
    """Findings about t alone."""
    if len(recording) < FEWEST:
        what = f"the recording has {len(recording)} samples, which is too few for anything"
        return [Finding("fail", what, do="record for a minute at least")]
    found = []
    if recording.duration < SHORT_S:
        what = (
            f"the recording lasts {recording.duration:.2g} s: noise, bias and drift are hardly known from it"
        )
        found.append(Finding("warn", what, do="record a minute or more; hours for an Allan plot"))
    dt = recording.dt
    usual = float(np.median(dt))
    found += _pauses(recording, dt, usual)
    found += _jitter(dt[dt < PAUSE * usual], usual)
    found += _rate_changes(recording, dt, usual)
    return found


def moment(start: float, stop: float) -> str:
    """`t = 1.20 s`, or `t = 1.20-3.40 s`, counted from the start of the recording."""
    return f"t = {start:.2f} s" if stop - start < 0.005 else f"t = {start:.2f}-{stop:.2f} s"


def _pauses(recording: ImuRecording, dt: Array, usual: float) -> list[Finding]:
    found = []
    long = np.flatnonzero((dt > PAUSE * usual) & (dt > PAUSE_S))
    if len(long):
        worst = int(long[np.argmax(dt[long])])
        many = "a pause" if len(long) == 1 else f"{len(long)} pauses"
        what = f"{many} in the recording, the longest of {dt[worst]:.2f} s"
        do = "cut the recording there with slice: what happened in a pause is not known to any filter"
        where = moment(recording.seconds[worst], recording.seconds[worst + 1])
        found.append(Finding("warn", what, where, do))
    lost = np.round(dt / usual) - 1.0
    short = (lost >= 1) & ~((dt > PAUSE * usual) & (dt > PAUSE_S))
    missing = int(lost[short].sum())
    if missing > 0.001 * len(dt) and missing > 2 and float(np.std(dt[~short])) < 0.3 * usual:
        first = int(np.flatnonzero(short)[0])
        what = f"about {missing} samples ({missing / len(dt):.1%}) were lost in short gaps"
        where = f"first at t = {recording.seconds[first]:.2f} s"
        found.append(Finding("note" if missing < 0.02 * len(dt) else "warn", what, where))
    return found


def _jitter(dt: Array, usual: float) -> list[Finding]:
    spread = float(np.std(dt)) / usual
    if spread <= JITTER:
        return []
    what = f"the interval between samples varies by {spread:.0%} of its median {1e3 * usual:.3g} ms"
    do = "stamp samples where they are taken (data-ready interrupt), not where they are written"
    return [Finding("warn", what, do=do)]


def _rate_changes(recording: ImuRecording, dt: Array, usual: float) -> list[Finding]:
    """A step of the median interval between the parts of a recording."""
    parts = np.array_split(np.arange(len(dt)), min(20, max(len(dt) // 50, 1)))
    medians = np.array([np.median(dt[rows]) for rows in parts])
    steps = np.abs(np.diff(np.log(medians)))
    if not len(steps) or medians.max() < (1.0 + RATE_CHANGE) * medians.min():
        return []
    at = int(np.argmax(steps))
    before, after = np.median(medians[: at + 1]), np.median(medians[at + 1 :])
    if abs(np.log(after / before)) < np.log(1.0 + RATE_CHANGE):
        return []
    both = np.concatenate([parts[at], parts[at + 1]])
    turn = int(both[np.argmin([_cost(dt[both], k) for k in range(1, len(both))]) + 1])
    what = f"the rate changes from {1 / before:.4g} to {1 / after:.4g} Hz"
    do = "cut the recording there with slice, and set the rate of the logger once"
    return [Finding("warn", what, f"t = {recording.seconds[turn]:.2f} s", do)]


def _cost(dt: Array, k: int) -> float:
    return float(np.abs(dt[:k] - np.median(dt[:k])).sum() + np.abs(dt[k:] - np.median(dt[k:])).sum())
