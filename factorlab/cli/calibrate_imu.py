"""`factorlab calibrate accel|gyro|imu`: constants of an inertial sensor from dwells and moves."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.delivery import header_option, require_output
from factorlab.cli.faults import in_one_sentence
from factorlab.cli.recording import opened, recording_options
from factorlab.cli.settings import Command, as_json, check_option, command_line, config_option, with_options

if TYPE_CHECKING:
    from factorlab.calibration import Calibrated
    from sequential.sensors import ImuRecording, StillDetector

__all__ = ["accel", "gyro", "imu"]

OPTIONS: tuple[Callable[[Command], Command], ...] = (
    click.argument("sources", metavar="LOG…", nargs=-1, required=True),
    recording_options,
    click.option("--gravity", type=click.FloatRange(8, 12), metavar="M/S2", help="|g|.  [default: 9.80665]"),
    click.option(
        "--latitude", type=click.FloatRange(-90, 90), metavar="DEG", help="|g| of that place instead."
    ),
    click.option("--height", type=float, metavar="M", help="Height above the ellipsoid, with --latitude."),
    click.option("--window", type=click.FloatRange(min=0.05), default=0.5, show_default=True, metavar="S",
                 help="Window of the variance that tells still from moving."),
    click.option("--dwell", type=click.FloatRange(min=0.1), default=1.0, show_default=True, metavar="S",
                 help="Shortest dwell."),
    click.option("--initial", type=click.FloatRange(min=0.1), metavar="S",
                 help="The first S seconds are still.  [default: the level of rest is found]"),
    click.option("--verify", "verify_with", metavar="FILE", help="Try the constants on another recording."),
    as_json,
    click.option("-o", "--out", type=click.Path(path_type=Path), metavar="DIR",
                 help="Write the report, calibration.json, calibration.h and kalibr_imu.yaml here."),
    header_option,
    click.option("--force", is_flag=True, help="Write over an earlier report in DIR, or over FILE.h."),
    check_option,
    config_option,
)  # fmt: skip


def shared_options(command: Command) -> Command:
    """The arguments and options that the three commands have in common."""
    return with_options(command, OPTIONS)


positions_option = click.option(
    "--positions",
    type=click.Choice(("many", "six")),
    default="many",
    show_default=True,
    help="six: gain and offset per axis, from every axis up and down; many: misalignment too.",
)


@click.command(short_help="Accelerometer, from many positions or from six.")
@positions_option
@shared_options
@in_one_sentence
def accel(positions: str, **options: Any) -> int:
    """Gain, offset and misalignment of an accelerometer, so that it reads g in every dwell.

    LOG is a recording with the sensor held still in many positions, or several recordings, one a position.
    Still parts are found; every dwell is predicted from the others as a check.
    """
    from factorlab.calibration import calibrate_accel

    logs, detector = _logs(options), _detector(options)
    return _deliver(calibrate_accel(logs, _settings(positions, options), detector), "accelerometer", options)


@click.command(short_help="Gyro: bias at rest, gain from turns of known angle.")
@click.option("--turn", "turns", multiple=True, metavar="AXIS=DEG",
              help="One a move between still parts, in order: --turn x=90 --turn y=-360 …")  # fmt: skip
@click.option("--turn-sigma", type=click.FloatRange(min=0, min_open=True), default=0.5, show_default=True,
              metavar="DEG", help="How exactly the angles are known.")  # fmt: skip
@shared_options
@in_one_sentence
def gyro(turns: tuple[str, ...], turn_sigma: float, **options: Any) -> int:
    """Bias of a gyro from its still parts and, with --turn, its gains from turns of known angle."""
    import math

    from factorlab.calibration import calibrate_gyro
    from sequential.errors import DataError
    from sequential.sensors import KnownTurn

    try:
        known = [KnownTurn.parse(turn) for turn in turns]
    except DataError as error:
        raise click.BadParameter(str(error), param_hint="--turn") from error
    logs, gravity, detector = _logs(options), _gravity(options), _detector(options)
    done = calibrate_gyro(logs, detector, known, gravity=gravity, turn_sigma=math.radians(turn_sigma))
    return _deliver(done, "gyro", options)


@click.command(short_help="Both, from one multi-position recording.")
@shared_options
@in_one_sentence
def imu(**options: Any) -> int:
    """Accelerometer from the dwells, then gyro from the moves between them, in one frame.

    The gyro carries gravity from dwell to dwell and must arrive where the accelerometer reads it.
    """
    from factorlab.calibration import calibrate_imu

    logs, detector = _logs(options), _detector(options)
    return _deliver(
        calibrate_imu(logs, _settings("many", options), detector), "accelerometer and gyro", options
    )


def _settings(positions: str, options: dict[str, Any]) -> Any:
    from sequential.sensors import MultiPosition

    six = positions == "six"
    return MultiPosition(gravity=_gravity(options), shears=not six, six=six)


def _gravity(options: dict[str, Any]) -> float:
    import math

    from sequential.sensors import STANDARD_GRAVITY, local_gravity

    given, latitude, height = (options[name] for name in ("gravity", "latitude", "height"))
    if given is not None and latitude is not None:
        raise click.UsageError("--gravity and --latitude say the same thing twice; give one")
    if height is not None and latitude is None:
        raise click.UsageError("--height goes with --latitude")
    if latitude is not None:
        return local_gravity(math.radians(latitude), height or 0.0)
    return STANDARD_GRAVITY if given is None else float(given)


def _detector(options: dict[str, Any]) -> StillDetector:
    from sequential.sensors import StillDetector

    return StillDetector(window=options["window"], shortest=options["dwell"], initial=options["initial"])


def _logs(options: dict[str, Any]) -> list[ImuRecording]:
    require_output(options["out"], options["c_header"], force=options["force"])
    return [_read(source, options) for source in options["sources"]]


def _read(source: str, options: dict[str, Any]) -> ImuRecording:
    chosen = {name: options[name] for name in ("kind", "units", "columns", "rate")}
    return opened(source, only=("accel", "gyro"), **chosen)[0].recording


def _deliver(done: Calibrated, what: str, options: dict[str, Any]) -> int:
    from factorlab.calibration import calibration_document, export_files
    from factorlab.cli.delivery import deliver

    if options["verify_with"] is not None:
        done = done.verified(_read(options["verify_with"], options))
    command = command_line()
    document = calibration_document(done, f"Calibration of the {what}", command)
    return deliver(
        document,
        as_json=options["as_json"],
        out=options["out"],
        force=options["force"],
        check=options["check"],
        files=export_files(done, command),
        c_header=options["c_header"],
    )
