"""From what a file holds to a recording: order, holes, repeated stamps and units, each mended and said."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError, MissingStreamError
from sequential.readers.imu.clock import NO_STAMP, ordered
from sequential.readers.imu.guess import FREE_FALL, guess_accel, guess_gyro, guess_mag
from sequential.readers.imu.units import GRAVITY, Scale
from sequential.sensors.finding import Finding, Severity
from sequential.sensors.recording import ImuRecording
from sequential.sensors.turning import level_at_rest

__all__ = ["Channels", "assemble"]

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]
SENSORS = ("accel", "gyro", "mag")
FEW = 0.2  # share of repeated stamps up to which they are slips, and above which the clock is coarse


@dataclass(slots=True, eq=False)
class Channels:
    """What was found in a file: stamps, readings as they stand there, and the units that it states."""

    where: str
    name: str
    t: Stamps
    accel: Array | None = None
    gyro: Array | None = None
    mag: Array | None = None
    temperature: Array | None = None
    units: dict[str, Scale] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)

    def select(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> None:
        """Keep these rows, in this order."""
        self.t = self.t[rows]
        for name in (*SENSORS, "temperature"):
            if (values := getattr(self, name)) is not None:
                setattr(self, name, values[rows])


def assemble(channels: Channels, units: Mapping[str, Scale]) -> ImuRecording:
    """Mend, convert and check.

    Parameters
    ----------
    units : what the user says; it wins over the file, and the file over a guess

    Raises
    ------
    FileFormatError, MissingStreamError
    """
    _drop_holes(channels)
    rows, said = ordered(channels.t, channels.where)
    if said:
        channels.select(rows)
        channels.findings += said
    _separate(channels)
    stated = {**channels.units, **units}
    rate = _rate(channels.t)
    scales = _scales(channels, stated, rate)
    arrays = {name: _converted(getattr(channels, name), scales.get(name)) for name in SENSORS}
    kinds = {
        f"{name}_unit": "counts"
        for name in SENSORS
        if arrays[name] is not None and (scales[name] is None or scales[name].factor is None)  # type: ignore[union-attr]
    }
    if arrays["accel"] is not None and "accel_unit" not in kinds:
        _require_gravity(channels, arrays["accel"], rate)
    heat = channels.temperature
    if heat is not None:
        heat = _converted(heat, stated.get("temperature"))
    return ImuRecording(
        t=channels.t,
        accel=arrays["accel"],
        gyro=arrays["gyro"],
        mag=arrays["mag"],
        temperature=heat,
        name=channels.name,
        findings=tuple(channels.findings),
        **kinds,
    )


def _rate(t: Stamps) -> float:
    return float(1e9 / np.median(np.diff(t))) if len(t) > 1 else float("nan")


def _drop_holes(channels: Channels) -> None:
    """Leave out rows without a stamp, or without a reading of accelerometer or gyro."""
    bad = channels.t == NO_STAMP
    for name in ("accel", "gyro"):
        if (values := getattr(channels, name)) is not None:
            bad |= ~np.isfinite(values).all(axis=1)
    if channels.mag is not None:
        part = ~np.isfinite(channels.mag).all(axis=1)
        channels.mag[part] = np.nan
        if channels.accel is None and channels.gyro is None:
            bad |= part
    if channels.temperature is not None:
        channels.temperature[np.isinf(channels.temperature)] = np.nan
    if bad.all():
        raise MissingStreamError(
            f"{channels.where} holds no complete sample: in every row a stamp, an accelerometer or a gyro "
            "reading is missing; where streams stand on lines of their own, export one file a sensor"
        )
    if bad.any():
        at = int(np.flatnonzero(bad)[0])
        many = int(bad.sum())
        what = f"{many} of {len(bad)} rows hold no number somewhere and are left out"
        severe: Severity = "warn" if many > 0.001 * len(bad) else "note"
        channels.findings.append(Finding(severe, what, f"first is sample {at}"))
        channels.select(~bad)


def _separate(channels: Channels) -> None:
    """Make stamps increase: drop lines that stand twice, spread what a coarse clock lumps together."""
    t = channels.t
    again = np.concatenate([[False], np.diff(t) == 0])
    if not again.any():
        return
    where = f"first at sample {int(np.flatnonzero(again)[0])}"
    share = float(again.mean())
    same = _same_as_before(channels) & again
    if (same == again).all() or (same.any() and share <= FEW):
        many = int(same.sum())
        what = f"{many} {'line stands' if many == 1 else 'lines stand'} twice and are left out"
        channels.findings.append(Finding("note" if same.mean() < 0.01 else "warn", what, where))
        channels.select(~same)
        again = again[~same]
    if not again.any():
        return
    if share > FEW:
        channels.t = _spread(t)
        what = f"the clock is coarse: {share:.0%} of the stamps repeat; samples are spread between its ticks"
    else:
        what = f"{int(again.sum())} stamps repeat the one before and their samples are left out"
        channels.select(~again)
    channels.findings.append(Finding("warn", what, where, "let the logger stamp in microseconds"))


def _same_as_before(channels: Channels) -> NDArray[np.bool_]:
    """(N,) whether all readings repeat those of the row above."""
    same = np.ones(len(channels.t), dtype=bool)
    for name in SENSORS:
        if (values := getattr(channels, name)) is not None:
            before = np.concatenate([values[:1], values[:-1]])
            same &= ((values == before) | (np.isnan(values) & np.isnan(before))).all(axis=1)
    return same


def _spread(t: Stamps) -> Stamps:
    ticks, counts = np.unique(t, return_counts=True)
    tick = int(np.median(np.diff(ticks))) if len(ticks) > 1 else 1_000_000
    room = np.minimum(np.diff(ticks, append=ticks[-1] + tick), tick)
    within = np.arange(len(t)) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.repeat(ticks, counts) + (np.repeat(room, counts) * within) // np.repeat(counts, counts)


def _scales(channels: Channels, stated: Mapping[str, Scale], rate: float) -> dict[str, Scale | None]:
    """The scale of every sensor that is there; guessed, and said, where nobody states it."""
    found: dict[str, Scale | None] = {name: stated.get(name) for name in SENSORS}
    if channels.accel is not None and found["accel"] is None:
        found["accel"], said = guess_accel(channels.accel, rate)
        channels.findings.append(said)
    if channels.gyro is not None and found["gyro"] is None:
        counted = Scale("counts", None) if found["accel"] is None and channels.accel is not None else None
        unit = found["accel"] or counted
        found["gyro"], said = guess_gyro(channels.gyro, channels.t, channels.accel, unit)
        channels.findings.append(said)
    if channels.mag is not None and found["mag"] is None:
        found["mag"], said = guess_mag(channels.mag)
        channels.findings.append(said)
    return found


def _converted(values: Array | None, scale: Scale | None) -> Array | None:
    if values is None or scale is None or scale.factor is None:
        return values
    return values if (scale.factor, scale.offset) == (1.0, 0.0) else values * scale.factor + scale.offset


def _require_gravity(channels: Channels, accel: Array, rate: float) -> None:
    """Refuse an accelerometer from which gravity was taken away."""
    level = level_at_rest(accel, rate)
    usual = float(np.median(np.linalg.norm(accel, axis=1)))
    if 0.8 < level < 1.25 and 0.8 < usual < 1.25:
        raise FileFormatError(
            f"{channels.where}: the accelerometer shows {level:.3f} at rest, so it is in g, not in m/s² as "
            "the file (or the option) says; give units accel=g"
        )
    if max(level, usual) < FREE_FALL * GRAVITY:
        raise FileFormatError(
            f"{channels.where}: the accelerometer shows {level:.3g} m/s² at rest, so gravity was taken "
            "away, or its unit is wrong; record the acceleration with gravity (phyphox: 'Acceleration (with "
            "g)', Sensor Logger: TotalAcceleration), or give units accel=g"
        )
