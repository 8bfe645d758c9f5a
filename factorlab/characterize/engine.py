"""From channels to a study: which part was still, and what every axis says there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from factorlab.characterize.channels import Channel
from factorlab.characterize.declared import Declared
from factorlab.characterize.slow import SlowNoise, slow_noise
from sequential.errors import DataError
from sequential.sensors import (
    Characteristics,
    Finding,
    ImuRecording,
    StepResponse,
    StillDetector,
    characterize,
    step_response,
)

__all__ = ["Study", "still_part", "study"]

MARGIN = 0.5  # s
WHOLE = 0.98  # of a recording: a dwell longer than this is all of it
Window = tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """What was found out about a recording.

    Parameters
    ----------
    name : of the recording
    channels, axes : as many; readings of the part used, and what they say
    steps : the response of each channel, where the recording is of a step instead
    window : s after the first stamp, the part that was still; None where all of it was taken
    duration : s, of the whole recording
    declared : noise to compare with
    findings : what readers and checks noticed
    slow : Allan deviations and the coefficients N, B and K
    step_at : s after the first stamp, when the input stepped, where that is known
    """

    name: str
    channels: tuple[Channel, ...]
    axes: tuple[Characteristics, ...]
    steps: tuple[StepResponse, ...]
    window: Window | None
    duration: float
    declared: Declared
    findings: tuple[Finding, ...]
    slow: SlowNoise
    step_at: float | None = None

    def groups(self) -> dict[str, list[int]]:
        """Indices of the channels of each sensor."""
        found: dict[str, list[int]] = {}
        for k, channel in enumerate(self.channels):
            found.setdefault(channel.group, []).append(k)
        return found


def study(
    name: str,
    channels: tuple[Channel, ...],
    *,
    window: Window | None = None,
    declared: Declared | None = None,
    findings: tuple[Finding, ...] = (),
    lsb: float | None = None,
    bits: int = 16,
    step: bool = False,
    step_at: float | None = None,
    progress: Callable[[str, int, int], None] = lambda *_: None,
) -> Study:
    """Characterise every channel, at rest or over a step.

    Parameters
    ----------
    window : s after the first stamp, the part to take
    step : the recording is of one step, and its response is wanted
    step_at : s after the first stamp, when the input stepped

    Raises
    ------
    DataError
    """
    declared = declared or Declared()
    declared.require_known(channels)
    first, last = min(c.t[0] for c in channels), max(c.t[-1] for c in channels)
    chosen = channels if window is None else tuple(_cut(c, int(first), window) for c in channels)
    axes, steps = [], []
    for k, channel in enumerate(chosen):
        progress(channel.name, k, len(chosen))
        if step:
            steps.append(step_response(channel.t, channel.values, at=step_at))
        else:
            axes.append(
                characterize(
                    channel.t,
                    channel.values,
                    name=channel.name,
                    unit=channel.unit,
                    temperature=channel.temperature,
                    lsb=lsb,
                    bits=bits,
                )
            )
    duration = float(last - first) * 1e-9
    slow = SlowNoise() if step else slow_noise(name, chosen)
    return Study(
        name,
        chosen,
        tuple(axes),
        tuple(steps),
        window,
        duration,
        declared,
        (*findings, *slow.findings),
        slow,
        step_at,
    )


def still_part(recording: ImuRecording) -> Window | None:
    """The longest dwell, s after the first stamp; None where the whole recording is one.

    Raises
    ------
    DataError
        where nothing is still.
    """
    seen = recording
    if recording.accel is None and recording.gyro is None:  # the detector looks at the variance of any three
        known = np.isfinite(recording.mag).all(axis=1)  # type: ignore[arg-type]
        seen = ImuRecording(recording.t[known], gyro=recording.mag[known], name=recording.name)  # type: ignore[index]
    dwells = StillDetector().find(seen)
    if not dwells:
        raise DataError(
            f"recording {recording.name!r} is never still for a second; noise, bias and Allan deviation need "
            "a sensor at rest: put it down, or name the part with --still START:STOP (s)"
        )
    quiet = [run for rows in dwells for run in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)]
    rows = max(quiet, key=len)
    if len(rows) >= WHOLE * len(seen):
        return None
    since = (seen.t[rows] - recording.t[0]) * 1e-9
    # the detector's window sees a motion only once it fills a part of it
    edge = MARGIN if since[-1] - since[0] > 10.0 * MARGIN else 0.0
    start = float(since[0]) + (edge if rows[0] > 0 else 0.0)
    return start, float(since[-1]) - (edge if rows[-1] < len(seen) - 1 else 0.0)


def _cut(channel: Channel, first: int, window: Window) -> Channel:
    since = (channel.t - first) * 1e-9
    inside: NDArray[np.bool_] = (since >= window[0]) & (since <= window[1])
    if not inside.any():
        raise DataError(f"{channel.name} has no reading between {window[0]:g} s and {window[1]:g} s")
    heat = None if channel.temperature is None else channel.temperature[inside]
    return Channel(channel.name, channel.group, channel.unit, channel.t[inside], channel.values[inside], heat)
