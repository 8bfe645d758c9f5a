"""Where a sensor at rest stands, in words: bias, gravity, drift, temperature."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from factorlab.characterize.words import say
from factorlab.report.document import Status, Verdict
from factorlab.report.words import Language
from sequential.sensors import STANDARD_GRAVITY, Characteristics, Estimate

__all__ = ["estimated", "of_drift", "of_heat", "of_level", "worst"]

Axes = list[Characteristics]
TURN = np.radians(0.05)  # rad/s of gyro bias below which nobody minds
OFF_GRAVITY = 0.01
LARGE = 0.5  # σ of a reading by which the bias moves during a recording, before it is a warning
LARGE = 0.5  # σ of a reading by which the bias moves during a recording, before it is a warning


def of_level(axes: Axes, group: str, lang: Language) -> Iterator[Verdict]:
    """Bias of a gyro, size of gravity, or just the mean."""
    if group == "gyro" and axes[0].unit == "rad/s":
        one = worst(axes, lambda axis: abs(axis.bias.value))
        degrees = float(np.degrees(abs(one.bias.value)))
        meaning = say(lang, "bias_gyro", deg=degrees, minute=60.0 * degrees)
        large = abs(one.bias.value) > TURN
        action = say(lang, "bias_gyro_do") if large else ""
        yield estimated(
            say(lang, "bias", axis=one.name), one.bias, "WARN" if large else "PASS", meaning, action, one.unit
        )
    elif group == "accel" and axes[0].unit == "m/s²" and len(axes) == 3:
        yield _gravity(axes, lang)
    else:
        for one in axes[:1] if group not in {"accel", "gyro", "mag"} else ():
            meaning = say(lang, "mean_means", half=0.5 * (one.bias.high - one.bias.low))
            yield estimated(say(lang, "mean", axis=one.name), one.bias, "INFO", meaning, "", one.unit)


def _gravity(axes: Axes, lang: Language) -> Verdict:
    mean = np.array([one.bias.value for one in axes])
    half = np.array([0.5 * (one.bias.high - one.bias.low) for one in axes])
    norm = float(np.linalg.norm(mean))
    wide = float(np.sqrt(np.sum((mean * half) ** 2))) / norm if norm else 0.0
    off = abs(norm / STANDARD_GRAVITY - 1.0)
    fits = off < OFF_GRAVITY
    meaning = say(lang, "accel_fits" if fits else "accel_off", percent=100.0 * off)
    return Verdict(
        say(lang, "norm_accel"),
        norm,
        (norm - wide, norm + wide),
        "PASS" if fits else "WARN",
        meaning,
        "" if fits else say(lang, "accel_do"),
        "m/s²",
    )


def of_drift(axes: Axes, lang: Language) -> Iterator[Verdict]:
    """The axis whose trend stands out most."""
    one = worst(axes, lambda axis: abs(axis.drift.value) / (axis.drift.high - axis.drift.low or 1.0))
    hourly, duration = one.drift.scaled(3600.0), one.timing.duration
    if one.drifts:
        change = abs(one.drift.value) * duration
        sigmas = change / max(one.noise.sigma.value, 1e-300)
        large = sigmas > LARGE
        key = "drift_seen" if large else "drift_small"
        meaning, action = (
            say(lang, key, change=change, unit=one.unit, sigmas=sigmas),
            say(lang, "drift_seen_do"),
        )
    else:
        bound, large, action = 0.5 * (hourly.high - hourly.low), False, ""
        meaning = say(lang, "drift_unseen", duration=duration, bound=bound, unit=one.unit)
    status: Status = "WARN" if large else "INFO" if one.drifts else "PASS"
    yield estimated(say(lang, "drift", axis=one.name), hourly, status, meaning, action, unit=f"{one.unit}/h")


def of_heat(axes: Axes, lang: Language) -> Iterator[Verdict]:
    """The axis that depends on temperature most clearly."""
    if np.isnan(axes[0].warmed):
        return
    known = [one for one in axes if one.per_degree is not None]
    if not known:
        meaning = say(lang, "heat_none", warmed=axes[0].warmed)
        yield Verdict(say(lang, "heat", axis=axes[0].name), None, None, "INFO", meaning)
        return
    one = worst(known, lambda axis: _clear(axis.per_degree))
    slope = one.per_degree
    assert slope is not None  # noqa: S101 - chosen among those that have one
    seen = _clear(slope) > 0.5
    meaning = say(lang, "heat_seen" if seen else "heat_unseen", warmed=one.warmed)
    action = say(lang, "heat_do") if seen else ""
    status: Status = "WARN" if seen else "PASS"
    yield estimated(say(lang, "heat", axis=one.name), slope, status, meaning, action, f"{one.unit}/°C")


def _clear(slope: Estimate | None) -> float:
    """Size of a slope over the width of its interval; above a half, the interval leaves zero out."""
    return 0.0 if slope is None else abs(slope.value) / max(slope.high - slope.low, 1e-300)


def worst(axes: Axes, by: Callable[[Characteristics], float]) -> Characteristics:
    """Give the axis for which something is largest."""
    return max(axes, key=by)


def estimated(metric: str, of: Estimate, status: Status, meaning: str, action: str, unit: str) -> Verdict:
    """A verdict about an estimate, whose interval is the band."""
    return Verdict(metric, of.value, (of.low, of.high), status, meaning, action, unit)
