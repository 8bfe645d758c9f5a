"""Options of every command that reads a recording of an IMU, and what is said about its health."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.settings import Command, with_options

if TYPE_CHECKING:
    from factorlab.datasets.recordings import OpenedRecording
    from sequential.sensors.finding import Finding

__all__ = ["opened", "recording_options"]

OPTIONS = (
    click.option("--kind", metavar="KIND", help="Format of the file, where it is not found out rightly."),
    click.option("--units", metavar="S=U,…", help="Units: accel=g,gyro=deg/s,mag=uT,t=ms, or '16384 LSB/g'."),
    click.option("--columns", metavar="R=C,…", help="Names of columns: ax=acc_x,ay=acc_y … t=when."),
    click.option(
        "--rate",
        type=click.FloatRange(min=0, min_open=True),
        metavar="HZ",
        help="Rate, where there are no stamps.",
    ),
)


def recording_options(command: Command) -> Command:
    """Give a command `--kind`, `--units`, `--columns` and `--rate`, for `opened`."""
    return with_options(command, OPTIONS)


def opened(
    source: str, *, usable: bool = True, only: tuple[str, ...] | None = None, **options: Any
) -> tuple[OpenedRecording, tuple[Finding, ...]]:
    """Open a recording and say on stderr what is wrong with it.

    Parameters
    ----------
    source : a path, or SET:PART as in `broad:07`
    usable : raise where a finding is a failure
    only : the sensors that count, of accel, gyro and mag; what is wrong with others stops nothing
    options : kind, units, columns and rate, as the options of `recording_options` give them

    Raises
    ------
    DataError
        where the recording cannot be read, or would give wrong results.
    """
    from factorlab.datasets.recordings import open_recording
    from sequential.sensors.health import failures, inspect

    found = open_recording(source, **options)
    findings = inspect(found.recording, only=only)
    for finding in findings:
        if finding.severity != "fail" or not usable:
            click.echo(f"{finding.severity}: {finding}", err=True)
    if usable and (error := failures(findings, found.recording.name)) is not None:
        raise error
    return found, findings
