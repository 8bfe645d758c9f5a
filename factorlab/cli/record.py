"""`factorlab record`: a recording from a board."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.faults import DATA_ERROR, in_one_sentence
from factorlab.cli.settings import as_json, config_option, print_json
from factorlab.cli.stopping import stopping

if TYPE_CHECKING:
    from factorlab.live import Recorded

__all__ = ["record"]

MODES = ("raw", "quaternion", "angles", "text")


@click.group(short_help="Record from a board.")
def record() -> None:
    """Record what a board sends; each kind of line is a command."""


@record.command(name="serial", short_help="Samples or attitudes from a serial port.")
@click.argument("port", metavar="PORT")
@click.option(
    "-o",
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    required=True,
    metavar="FILE",
    help="CSV to write; attitudes also as FILE.tum.",
)
@click.option("--mode", type=click.Choice(MODES), default="raw", show_default=True, help="What to ask for.")
@click.option(
    "--baud",
    type=click.IntRange(min=50),
    metavar="BIT/S",
    help="Speed of the line.  [default: found out, 500000 first]",
)
@click.option(
    "--seconds",
    type=click.FloatRange(min=0, min_open=True),
    metavar="S",
    help="By the board's clock.  [default: until Ctrl-C]",
)
@click.option(
    "--wait",
    type=click.FloatRange(min=0, min_open=True),
    default=3.0,
    show_default=True,
    metavar="S",
    help="For a first frame.",
)
@click.option(
    "--calibration",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="calibration.json that the board should have been built with.",
)
@click.option("--force", is_flag=True, help="Replace a file that is there.")
@as_json
@config_option
@in_one_sentence
def serial(port: str, out: Path, as_json: bool, **options: Any) -> int:
    """Record from a board with this project's firmware, until --seconds are over or Ctrl-C.

    PORT is a serial port: /dev/ttyUSB0, /dev/ttyACM0, COM3.  Raw samples become a recording in SI units that
    `factorlab calibrate`, `characterize` and `attitude` read; attitudes become a table, or with FILE.tum the
    TUM format that evo reads.  Rate, jitter and losses are told at the end.  Ctrl-C, a board that is
    unplugged or a program that is killed lose nothing that came before: until the end, lines go to FILE.part.
    """
    from factorlab.live import RecordSettings, SerialPort, record_serial

    if out.suffix == ".tum" and options["mode"] == "raw":
        raise click.UsageError(f"{out} would hold attitudes; add --mode quaternion, or name a .csv")
    settings = RecordSettings(options["mode"], options["seconds"], options["wait"])
    with stopping() as stop, SerialPort(port, options["baud"]) as line, _counter() as tell:
        recorded = record_serial(line, out, settings, force=options["force"], stopped=stop.is_set, tell=tell)
    if as_json:
        print_json(recorded.to_json())
    else:
        for text in recorded.lines():
            click.echo(text)
    for warning in _warnings(recorded, options["calibration"]):
        click.echo(f"warn: {warning}", err=True)
    if recorded.ended:
        click.echo(f"error: {recorded.ended}; what came before is in {recorded.path}", err=True)
    return DATA_ERROR if recorded.ended else 0


def _warnings(recorded: Recorded, calibration: Path | None) -> Iterator[str]:
    """What the boot frame, or its absence, means for the recording."""
    if recorded.board is None:
        if recorded.mode == "raw":
            yield (
                "the board did not say its full scales, so the file holds counts; read_imu and --units take "
                "them, as in --units 'accel=±8 g,gyro=±2000 dps'"
            )
        return
    if calibration is not None:
        from sequential.sensors import ImuCalibration
        from sequential.sensors.calibration_header import calibration_hash

        built, wanted = recorded.board.calibration_hash, calibration_hash(ImuCalibration.load(calibration))
        if built != wanted:
            has = f"calibration {built:08x}" if built else "no calibration"
            yield f"the board was built with {has}, {calibration} is {wanted:08x}; build and flash it anew"


@contextmanager
def _counter() -> Iterator[Callable[[float, int, int], None]]:
    """A line that counts on a terminal, silence elsewhere."""
    from factorlab.live.recorder import silent

    if not sys.stderr.isatty():
        yield silent
        return
    shown = -1

    def tell(seconds: float, samples: int, lost: int) -> None:
        nonlocal shown
        if (tenths := int(10 * seconds)) != shown:
            shown = tenths
            click.echo(f"\r{seconds:8.1f} s {samples:8d} samples {lost:6d} lost ", nl=False, err=True)

    yield tell
    click.echo("\r" + " " * 48 + "\r", nl=False, err=True)
