"""All checks of a recording, the gravest findings first."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from sequential.errors import DataError
from sequential.sensors.finding import Finding
from sequential.sensors.health.clock import clock_findings
from sequential.sensors.health.field import field_findings
from sequential.sensors.health.readings import reading_findings
from sequential.sensors.health.rest import rest_findings
from sequential.sensors.health.scale import scale_findings
from sequential.sensors.recording import ImuRecording

__all__ = ["failures", "inspect"]

ORDER = {"fail": 0, "warn": 1, "note": 2}


def inspect(recording: ImuRecording, *, only: tuple[str, ...] | None = None) -> tuple[Finding, ...]:
    """Say what is wrong with a recording, or worth knowing about it.

    Looked for are: what the reader mended; too few samples; pauses, lost samples, jitter and changes of the
    rate; saturated, stuck, frozen and coarse axes; units that contradict gravity; a gyro and an
    accelerometer that disagree about a turn; a recording without rest; a magnetometer that is absent,
    constant, or shows no field of the Earth.

    Parameters
    ----------
    only : sensors to look at, of accel, gyro and mag; all of them by default

    Returns
    -------
    findings : failures first, then warnings, then notes; a failure says that results would be wrong
    """
    found = [*recording.findings]
    if only is not None:
        recording = _restricted(recording, only)
    for check in (clock_findings, reading_findings, scale_findings, rest_findings):
        found += check(recording)
    if only is None or "mag" in only:
        found += field_findings(recording)
    return tuple(sorted(found, key=lambda finding: ORDER[finding.severity]))


def _restricted(recording: ImuRecording, only: tuple[str, ...]) -> ImuRecording:
    """The recording with these sensors, or as it is where it has none of them."""
    left_out: dict[str, Any] = {sensor: None for sensor in recording.sensors if sensor not in only}
    return replace(recording, **left_out) if len(left_out) < len(recording.sensors) else recording


def failures(findings: tuple[Finding, ...], name: str = "the recording") -> DataError | None:
    """The error that a command ends with where a finding is a failure; None where none is."""
    grave = [str(finding) for finding in findings if finding.severity == "fail"]
    return DataError(f"{name} cannot be used: {'; '.join(grave)}") if grave else None
