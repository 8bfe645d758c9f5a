"""All checks of a recording, the gravest findings first."""

from __future__ import annotations

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


def inspect(recording: ImuRecording) -> tuple[Finding, ...]:
    """Say what is wrong with a recording, or worth knowing about it.

    Looked for are: what the reader mended; too few samples; pauses, lost samples, jitter and changes of the
    rate; saturated, stuck, frozen and coarse axes; units that contradict gravity; a gyro and an
    accelerometer that disagree about a turn; a recording without rest; a magnetometer that is absent,
    constant, or shows no field of the Earth.

    Returns
    -------
    findings : failures first, then warnings, then notes; a failure says that results would be wrong
    """
    found = [*recording.findings]
    for check in (clock_findings, reading_findings, scale_findings, rest_findings, field_findings):
        found += check(recording)
    return tuple(sorted(found, key=lambda finding: ORDER[finding.severity]))


def failures(findings: tuple[Finding, ...], name: str = "the recording") -> DataError | None:
    """The error that a command ends with where a finding is a failure; None where none is."""
    grave = [str(finding) for finding in findings if finding.severity == "fail"]
    return DataError(f"{name} cannot be used: {'; '.join(grave)}") if grave else None
