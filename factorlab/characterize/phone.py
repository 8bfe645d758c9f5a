"""A phone's sensors each with the samples they took, before they are brought to common stamps."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from factorlab.characterize.channels import Channel, channels_of
from sequential.errors import FactorlabError, FileFormatError
from sequential.readers.imu.archive import Export, open_export
from sequential.readers.imu.assemble import assemble
from sequential.readers.imu.phone import phone_channels
from sequential.readers.imu.units import parse_units
from sequential.sensors import Finding, ImuRecording

__all__ = ["with_own_samples"]

MERGED = "have stamps of their own"  # what the reader says where it has interpolated or averaged


def with_own_samples(
    place: Path, recording: ImuRecording, findings: tuple[Finding, ...], units: str | None = None
) -> tuple[tuple[Channel, ...], tuple[Finding, ...]]:
    """Channels of a recording, each sensor read from its own files where the reader has interpolated it.

    Interpolation takes up to 30 % off the noise, so σ, R and Allan's deviation would come out too small.

    Returns
    -------
    channels, findings : the reader's remark is dropped once it no longer applies, and else a warning
    """
    channels = channels_of(recording)
    if not any(MERGED in one.what for one in findings):
        return channels, findings
    alone = _alone(open_export(place), units) if place.is_dir() or place.suffix.lower() == ".zip" else {}
    missing = [sensor for sensor in recording.sensors if sensor not in alone]
    chosen = [c for sensor in recording.sensors for c in _of(sensor, alone.get(sensor, recording))]
    if missing:
        told = [replace(one, severity="warn") if MERGED in one.what else one for one in findings]
    else:
        told = [one for one in findings if MERGED not in one.what]
    return tuple(chosen), tuple(told)


def _of(sensor: str, recording: ImuRecording) -> tuple[Channel, ...]:
    return tuple(channel for channel in channels_of(recording) if channel.group == sensor)


def _alone(export: Export, units: str | None) -> dict[str, ImuRecording]:
    """A recording of every sensor of an export, with its own stamps; what cannot be had is left out."""
    kinds = {name: _kind(export, name) for name in export.names("csv")}
    scales = {name: scale for name, scale in parse_units(units).items() if name != "t"}
    found = {}
    for sensor in ("accel", "gyro", "mag"):
        # other files stay: gravity, and what says which signs the phone used
        files = tuple(name for name in export.inside if kinds.get(name) in {sensor, None})
        try:
            found[sensor] = assemble(phone_channels(replace(export, inside=files), None), scales)
        except FactorlabError:
            continue
    return {sensor: one for sensor, one in found.items() if getattr(one, sensor) is not None}


def _kind(export: Export, name: str) -> str | None:
    """The sensor of a file; None for files of none."""
    try:
        channels = phone_channels(replace(export, inside=(name,)), None)
    except FileFormatError:
        return "accel"  # an acceleration without gravity is refused on its own
    except FactorlabError:
        return None
    return next(s for s in ("accel", "gyro", "mag") if getattr(channels, s) is not None)
