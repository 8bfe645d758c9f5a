"""`factorlab attitude`: from a recording of an IMU to its orientation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.faults import in_one_sentence
from factorlab.cli.recording import opened, recording_options
from factorlab.cli.settings import as_json, check_option, command_line, config_option

if TYPE_CHECKING:
    from factorlab.attitude import Reference
    from sequential.sensors import ImuRecording
    from sequential.sensors.finding import Finding

__all__ = ["attitude"]

FILTERS = (
    "error-state", "smoother", "mahony", "madgwick", "complementary", "kalman", "c-error-state", "c-mahony",
    "c-mahony-q", "c-complementary", "c-complementary-q", "c-kalman", "c-kalman-q",
)  # fmt: skip


@click.command(short_help="Orientation of an IMU, with its uncertainty.")
@click.argument("source", metavar="LOG")
@click.option("--filter", "name", type=click.Choice(FILTERS), help="Estimator.  [default: error-state]")
@click.option("--compare", metavar="NAMES", help="Others beside it: mahony,c-mahony … or all.")
@click.option(
    "--calibration",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE.json",
    help="Constants from `factorlab calibrate`, applied first.",
)
@click.option("--no-mag", is_flag=True, help="Leave the magnetometer out (6-D).")
@click.option(
    "--truth",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE.tum",
    help="Hold it to these orientations.  [default: the truth that comes with the recording]",
)
@click.option("--no-truth", is_flag=True, help="Do not look at the truth that comes with the recording.")
@recording_options
@as_json
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Write the report, orientation.csv and orientation.tum here.",
)
@click.option("--force", is_flag=True, help="Write over an earlier report in DIR.")
@check_option
@config_option
@in_one_sentence
def attitude(source: str, name: str | None, compare: str | None, **options: Any) -> int:
    """Orientation of the IMU in LOG at every sample: a file, or a recording such as broad:07.

    With a magnetometer the answer is 9-D (north is magnetic), without 6-D (the heading counts from where it
    began).  Angles, uncertainty, gyro bias, rest and magnetic disturbance are drawn; where the recording has
    a truth (BROAD, RepoIMU, --truth), errors are told and the uncertainty is judged.

    The filters whose names begin with c- are those of the firmware: the same C sources as on the board, in
    single precision, or with -q in fixed point.
    """
    from factorlab.attitude import attitude_document, orientation_csv, orientation_tum, solve_attitude
    from factorlab.cli.delivery import deliver

    names = _names(name, compare)
    recording, reference, findings = _recording(source, options)
    solved = solve_attitude(recording, names, reference)
    calibration = options["calibration"]
    document = attitude_document(
        recording, solved, reference, findings,
        calibrated=calibration.name if calibration else "", command=command_line(),
    )  # fmt: skip
    files: dict[str, str | bytes] = {}
    if options["out"] is not None:
        for one in solved:
            stem = "orientation" if one is solved[0] else f"orientation_{one.name}"
            files |= {
                f"{stem}.csv": orientation_csv(one.history),
                f"{stem}.tum": orientation_tum(one.history),
            }
    return deliver(
        document,
        as_json=options["as_json"],
        out=options["out"],
        force=options["force"],
        check=options["check"],
        files=files,
    )


def _names(name: str | None, compare: str | None) -> tuple[str, ...]:
    """The estimator asked for first, then those beside it, each once."""
    from factorlab.attitude import DEFAULT, available, left_out

    there = available()
    first = name or (DEFAULT if DEFAULT in there else there[0])
    if compare == "all" and (lacking := left_out()):
        click.echo(f"left out: {', '.join(lacking)}: {next(iter(lacking.values()))}", err=True)
    others = there if compare == "all" else tuple((compare or "").replace(" ", "").split(","))
    for other in filter(None, others):
        if other not in FILTERS:
            from factorlab.cli.settings import did_you_mean

            raise click.BadParameter(
                f"no filter {other!r}{did_you_mean(other, FILTERS)}", param_hint="--compare"
            )
    return tuple(dict.fromkeys((first, *filter(None, others))))


def _recording(
    source: str, options: dict[str, Any]
) -> tuple[ImuRecording, Reference | None, tuple[Finding, ...]]:
    """Opened, calibrated and inspected, with its truth."""
    from dataclasses import replace

    from factorlab.attitude import Reference, reference_of
    from sequential.errors import DataError
    from sequential.sensors import ImuCalibration
    from sequential.sensors.health import failures, inspect

    given = {key: options[key] for key in ("kind", "units", "columns", "rate")}
    calibration, no_mag = options["calibration"], options["no_mag"]
    found, findings = opened(source, usable=calibration is None and not no_mag, **given)
    recording = found.recording
    if calibration is not None or no_mag:
        if calibration is not None:
            recording = ImuCalibration.load(calibration).apply(recording)
        if no_mag:
            recording = replace(recording, mag=None)
        findings = inspect(recording)
        if (error := failures(findings, recording.name)) is not None:
            raise error
    if options["truth"] is not None and options["no_truth"]:
        raise click.UsageError("--truth and --no-truth contradict each other")
    if options["truth"] is not None:
        return recording, reference_of(options["truth"], recording), findings
    if found.truth is None or options["no_truth"]:
        return recording, None, findings
    if len(found.truth.world_q_body) != len(recording):
        raise DataError(f"the truth of {source!r} has another number of samples than the recording")
    return recording, Reference(found.truth.world_q_body, found.truth.movement), findings
