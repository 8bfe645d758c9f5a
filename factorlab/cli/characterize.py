"""`factorlab characterize`: what a sensor is worth, from a recording at rest."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.faults import DATA_ERROR, in_one_sentence
from factorlab.cli.settings import as_json, check_option, command_line, config_option

if TYPE_CHECKING:
    from factorlab.characterize import Study

__all__ = ["characterize"]


@dataclass(frozen=True, slots=True)
class Settings:
    """What the command line asks for."""

    log: Path
    column: tuple[str, ...]
    kind: str | None
    units: str | None
    rate: float | None
    temperature: str | None
    still: str | None
    step: bool
    step_at: float | None
    lsb: float | None
    bits: int
    r: tuple[str, ...]
    sigma: tuple[str, ...]
    noise: Path | None
    lang: str
    as_json: bool
    out: Path | None
    force: bool
    check: bool


@click.command(short_help="What a sensor is worth: noise, bias, drift, resolution, Allan deviation.")
@click.argument("log", type=click.Path(path_type=Path), metavar="LOG")
@click.option(
    "--column",
    multiple=True,
    metavar="NAME[=UNIT]",
    help="A column of a table of any sensor; may be repeated.  [default: the axes of an IMU]",
)
@click.option("--kind", metavar="KIND", help="Format of an IMU recording, where it is not to be found out.")
@click.option(
    "--units", metavar="accel=g,gyro=deg/s", help="Units of the file; guessed by default, and said."
)
@click.option(
    "--rate", type=click.FloatRange(min=0, min_open=True), metavar="HZ", help="Of a file without stamps."
)
@click.option("--temperature", metavar="NAME", help="Column of the temperature, with --column.")
@click.option("--still", metavar="START:STOP", help="Part to take, s.  [default: the longest part at rest]")
@click.option("--step", is_flag=True, help="The recording is of a step: latency, time constant, bandwidth.")
@click.option("--step-at", type=float, metavar="S", help="When the input stepped, s after the first stamp.")
@click.option(
    "--lsb", type=click.FloatRange(min=0, min_open=True), metavar="STEP", help="Resolution, where known."
)
@click.option("--bits", type=click.IntRange(1, 32), default=16, show_default=True, help="Of the converter.")
@click.option(
    "--r",
    "r",
    multiple=True,
    metavar="[NAME=]VALUE",
    help="R of your filter (variance) for all, a sensor (gyro) or an axis (gx), to compare; may be repeated.",
)
@click.option("--sigma", multiple=True, metavar="[NAME=]VALUE", help="The same as a standard deviation.")
@click.option("--noise", type=click.Path(path_type=Path), metavar="imu.yaml", help="Densities to compare.")
@click.option("--lang", type=click.Choice(["en", "fr"]), default="en", show_default=True, help="Of the text.")
@as_json
@click.option(
    "-o",
    "--out",
    type=click.Path(file_okay=True, path_type=Path),
    metavar="DIR",
    help="Write report.html, report.json and, for an IMU, imu.yaml here.",
)
@click.option("--force", is_flag=True, help="Write over an earlier report in DIR.")
@check_option
@config_option
@in_one_sentence
def characterize(**options: Any) -> int:
    """Say what a sensor is worth, from a recording in which it did not move.

    LOG is a recording of an IMU in any format that is read (CSV, phone exports, NPZ …), or with --column a
    table of any sensor.
    """
    return characterize_and_show(Settings(**options))


def characterize_and_show(settings: Settings) -> int:
    """Study, print, write; returns the exit code."""
    from factorlab.characterize.exports import kalibr_file
    from factorlab.characterize.page import document_of
    from factorlab.cli.delivery import deliver
    from factorlab.report.folder import require_free

    if settings.out is not None:
        require_free(settings.out, force=settings.force)
    found = _study(settings)
    lang: Any = settings.lang
    code = deliver(
        document_of(found, lang=lang, command=command_line()),
        as_json=settings.as_json,
        out=settings.out,
        force=settings.force,
        check=settings.check,
        files=kalibr_file(found, lang),
    )
    return code or (DATA_ERROR if any(one.severity == "fail" for one in found.findings) else 0)


def _study(settings: Settings) -> Study:
    from factorlab.characterize import read_columns, study
    from factorlab.characterize.engine import still_part
    from factorlab.characterize.phone import with_own_samples
    from factorlab.cli.progress import bar

    window = _window(settings.still)
    if settings.column:
        columns = dict(_pair(one, "") for one in settings.column)
        channels, findings = read_columns(
            settings.log, columns, rate=settings.rate, temperature=settings.temperature
        )
        name = settings.log.stem
    else:
        from sequential.readers import read_imu
        from sequential.sensors.health import inspect

        recording = read_imu(settings.log, kind=settings.kind, units=settings.units, rate=settings.rate)
        channels, findings = with_own_samples(settings.log, recording, inspect(recording), settings.units)
        name = recording.name
        if window is None and not settings.step:
            window = still_part(recording)
    with bar(name, shown=sys.stderr.isatty()) as progress:
        return study(
            name,
            channels,
            window=window,
            declared=_declared(settings),
            findings=findings,
            lsb=settings.lsb,
            bits=settings.bits,
            step=settings.step,
            step_at=settings.step_at,
            progress=progress,
        )


def _window(given: str | None) -> tuple[float, float] | None:
    if given is None:
        return None
    start, colon, stop = given.partition(":")
    try:
        window = float(start or 0.0), float(stop or "inf")
    except ValueError:
        window = (1.0, 0.0)
    if not colon or not window[0] < window[1]:
        raise click.BadParameter(
            f"{given!r} is not START:STOP in seconds, such as 10:70", param_hint="--still"
        )
    return window


def _pair(given: str, otherwise: str) -> tuple[str, str]:
    name, equals, value = given.partition("=")
    return name.strip(), value.strip() if equals else otherwise


def _declared(settings: Settings) -> Any:
    from factorlab.characterize.declared import Declared, read_noise

    noise = None if settings.noise is None else read_noise(settings.noise)
    return Declared.of(_values(settings.r, "--r"), _values(settings.sigma, "--sigma"), noise)


def _values(given: tuple[str, ...], option: str) -> dict[str, float]:
    """`VALUE` or `NAME=VALUE` each; a value without a name is for every channel."""
    found = {}
    for one in given:
        name, _, value = one.rpartition("=")
        try:
            found[name.strip()] = float(value)
        except ValueError:
            raise click.BadParameter(
                f"{one!r} is not [NAME=]VALUE with a number", param_hint=option
            ) from None
    return found
