"""The slow part of the noise: Allan deviations and the coefficients N, B and K of every channel."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.characterize.channels import AXES, Channel
from sequential.errors import DataError, FactorlabError
from sequential.noise import ImuNoise
from sequential.sensors import (
    AllanDeviation,
    Finding,
    ImuNoiseReport,
    ImuRecording,
    NoiseFit,
    allan_deviation,
    fit_noise,
    imu_noise,
)
from sequential.sensors.imu_noise import filter_noise

__all__ = ["SlowNoise", "slow_noise"]

PAUSE = 5.5  # intervals, as in `sequential.sensors.imu_noise`
FEWEST = 64
PARTS, SAME_RATE = 16, 1.1
INERTIAL = {"accel": "m/s²", "gyro": "rad/s"}


@dataclass(frozen=True, slots=True, eq=False)
class SlowNoise:
    """Allan deviations and coefficients.

    Parameters
    ----------
    deviations : overlapping Allan deviation of a group, (T, k), where it could be had
    fits : by channel, where they could be had
    noise : of an IMU in SI units, as a filter takes it
    bounds : fields of `noise` that are upper bounds, since the recording is too short to see them
    rate : Hz
    findings : why something could not be had
    """

    deviations: Mapping[str, AllanDeviation] = field(default_factory=dict)
    fits: Mapping[str, NoiseFit] = field(default_factory=dict)
    noise: ImuNoise | None = None
    bounds: tuple[str, ...] = ()
    rate: float = float("nan")
    findings: tuple[Finding, ...] = ()


def slow_noise(name: str, channels: tuple[Channel, ...]) -> SlowNoise:
    """Allan deviations of all channels; an IMU's accelerometer and gyro are read together."""
    groups: dict[str, list[Channel]] = {}
    for channel in channels:
        groups.setdefault(channel.group, []).append(channel)
    deviations: dict[str, AllanDeviation] = {}
    fits: dict[str, NoiseFit] = {}
    said: list[Finding] = []
    three: dict[str, tuple[NoiseFit, NoiseFit, NoiseFit]] = {}
    rate = float("nan")
    for report in _reports(name, groups, said):
        three |= report.fits
        deviations |= report.deviations
        rate = report.rate
        said += [Finding("warn", note.rstrip(".")) for note in report.notes]
    for group, own_fits in three.items():
        fits |= dict(zip(AXES[group], own_fits, strict=True))
    for group, own in groups.items():
        if group in deviations:
            continue
        try:
            deviations[group] = _of_group(own, fits)
        except FactorlabError as fault:
            said.append(Finding("warn", f"no Allan deviation of {group}: {_plain(fault)}"))
    noise, bounds = filter_noise(three) if set(three) == set(INERTIAL) else (None, ())
    return SlowNoise(deviations, fits, noise, bounds, rate, tuple(said))


def _reports(name: str, groups: Mapping[str, list[Channel]], said: list[Finding]) -> Iterator[ImuNoiseReport]:
    """Accelerometer and gyro in SI units through `imu_noise`, each apart where it has stamps of its own."""
    own: dict[str, Any] = {
        group: np.column_stack([channel.values for channel in groups[group]])
        for group, unit in INERTIAL.items()
        if group in groups and len(groups[group]) == 3 and groups[group][0].unit == unit
    }
    stamps = {group: groups[group][0].t for group in own}
    shared = len({(len(t), int(t[0]), int(t[-1])) for t in stamps.values()}) == 1
    for together in [own] if own and shared else [{group: values} for group, values in own.items()]:
        try:
            yield imu_noise(ImuRecording(stamps[next(iter(together))], name=name, **together))
        except FactorlabError as fault:
            which = "the whole IMU" if len(together) > 1 else next(iter(together))
            said.append(Finding("warn", f"no Allan deviation of {which}: {_plain(fault)}"))


def _of_group(channels: list[Channel], fits: dict[str, NoiseFit]) -> AllanDeviation:
    """Deviation of channels with common stamps, over the longest stretch without a pause; adds fits."""
    t = channels[0].t
    rows = _even_rows(t)
    rate = float((len(t[rows]) - 1) / ((t[rows][-1] - t[rows][0]) * 1e-9))
    values = np.column_stack([channel.values[rows] for channel in channels])
    found = allan_deviation(values, rate)
    for channel in channels:
        if np.ptp(channel.values[rows]) > 0.0 and len(channel.values[rows]) >= FEWEST:
            fits[channel.name] = fit_noise(channel.values[rows], rate, unit=channel.unit)
    return found


def _even_rows(t: NDArray[np.int64]) -> slice:
    steps = np.diff(t)
    pauses = np.flatnonzero(steps > PAUSE * np.median(steps))
    starts, stops = np.append(0, pauses + 1), np.append(pauses + 1, len(t))
    longest = int(np.argmax(stops - starts))
    rows = slice(int(starts[longest]), int(stops[longest]))
    parts = np.array_split(np.diff(t[rows]), PARTS)
    medians = np.array([np.median(part) for part in parts if len(part)]) * 1e-9
    if len(medians) and medians.max() > SAME_RATE * medians.min():
        first, last = 1.0 / medians.min(), 1.0 / medians.max()
        raise DataError(
            f"the rate of these readings changes from {first:.4g} to {last:.4g} Hz; "
            "give a part of one rate with --still START:STOP"
        )
    return rows


def _plain(fault: FactorlabError) -> str:
    return " ".join(str(fault).split())
