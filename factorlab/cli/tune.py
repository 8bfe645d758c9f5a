"""`factorlab tune`: noise levels from the readings, with intervals and a verdict before and after."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.faults import CHECK_FAILED, in_one_sentence
from factorlab.cli.settings import (
    as_json,
    check_option,
    command_line,
    config_option,
    max_gap_option,
    print_json,
    robot_option,
    seed_option,
)

if TYPE_CHECKING:
    from factorlab.datasets import Dataset
    from factorlab.tuning import Fitted
    from sequential.log import SensorLog

__all__ = ["tune"]

METHODS = ("ml", "nis", "em", "als", "still")  # the same as factorlab.tuning.METHODS, which costs an import


@dataclass(frozen=True, slots=True)
class Settings:
    """What the command line asks for."""

    source: str
    method: str
    model: str | None
    knob: tuple[str, ...]
    stream: tuple[str, ...]
    lsb: float | None
    use_every: int | None
    robot: int | None
    max_gap: float | None
    profile: bool
    as_json: bool
    out: Path | None
    force: bool
    seed: int
    check: bool


@click.command(short_help="Noise levels from the readings, with 95 % intervals.")
@click.argument("source", metavar="DATASET|LOG")
@click.option(
    "--method",
    type=click.Choice(METHODS),
    default="ml",
    show_default=True,
    help="ml: likelihood of the innovations; nis: process noise until the NIS is as expected; em: whole "
    "covariances; als: from autocovariances, linear models; still: a sensor at rest.",
)
@click.option(
    "--model",
    metavar="FILE.py:NAME",
    help="For a log of your own: a StateSpace, or a function that returns one; its float arguments, or KNOBS "
    "in the file, are what is tuned.",
)
@click.option(
    "--knob",
    multiple=True,
    metavar="NAME[=VALUE]",
    help="Turn only this knob, from VALUE on; may be repeated.",
)
@click.option("--profile", is_flag=True, help="Intervals from the profile likelihood (ml); slower.")
@click.option(
    "--stream",
    multiple=True,
    metavar="NAME",
    help="A stream at rest (still); may be repeated.  [default: all, or the model's sensors]",
)
@click.option(
    "--lsb", type=click.FloatRange(min=0, min_open=True), metavar="STEP", help="Resolution of it (still)."
)
@click.option(
    "--use-every",
    type=click.IntRange(min=1),
    metavar="K",
    help="Use one reading in K, as compare does.  [default: 5 for a dataset, 1 for a log]",
)
@robot_option
@max_gap_option
@as_json
@click.option(
    "-o",
    "--out",
    type=click.Path(file_okay=True, path_type=Path),
    metavar="DIR",
    help="Write report.json here, and report.html with estimates before and after.",
)
@click.option("--force", is_flag=True, help="Write over an earlier report in DIR.")
@seed_option
@check_option
@config_option
@in_one_sentence
def tune(**options: Any) -> int:
    """Fit the noise of a model to a log, or take a sensor's noise from a recording at rest.

    DATASET is kitti, plaza1, plaza2, mrclam or rail; LOG is a CSV or NPZ file with named streams, together
    with --model (not needed for --method still).  Held-out readings and truth are not looked at.
    """
    return tune_and_show(Settings(**options))


def tune_and_show(settings: Settings) -> int:
    """Tune, write, print; returns the exit code."""
    _require_that_options_fit(settings)
    from factorlab.report.folder import require_free
    from factorlab.tuning import fitted_document

    if settings.out is not None:
        require_free(settings.out, force=settings.force)
    done = _at_rest(settings) if settings.method == "still" else _over_models(settings)
    whole = fitted_document(done, command_line())
    if settings.as_json:
        print_json(whole)
    else:
        _print(done)
    if settings.out is not None:
        click.echo(f"report: {_write(done, whole, settings)}", err=settings.as_json)
    return CHECK_FAILED if settings.check and any(one.failed for one in done) else 0


def _require_that_options_fit(settings: Settings) -> None:
    still = settings.method == "still"
    for option, given, fits, where in (
        ("--knob", settings.knob, settings.method in {"ml", "nis"}, "--method ml or nis"),
        ("--profile", settings.profile, settings.method == "ml", "--method ml"),
        ("--stream", settings.stream, still, "--method still"),
        ("--lsb", settings.lsb is not None, still, "--method still"),
        ("--use-every", settings.use_every is not None, not still, "the other methods"),
    ):
        if given and not fits:
            raise click.UsageError(f"{option} goes with {where}, not with --method {settings.method}")


def _over_models(settings: Settings) -> tuple[Fitted, ...]:
    from factorlab.cli.progress import bar
    from factorlab.tuning import tune_dataset
    from factorlab.tuning.engine import UnknownKnobError

    asked, done = _asked(settings.knob), []
    for dataset in _datasets(settings):
        with bar(dataset.name, shown=sys.stderr.isatty()) as progress:
            progress("tuning the noise", 0, 1)
            try:
                done.append(
                    tune_dataset(
                        dataset,
                        settings.method,
                        asked=asked,
                        profile=settings.profile,
                        max_gap=settings.max_gap,
                        seed=settings.seed,
                    )
                )
            except UnknownKnobError as error:
                raise click.BadParameter(str(error), param_hint="--knob") from error
    return tuple(done)


def _asked(given: tuple[str, ...]) -> dict[str, float | None]:
    """`name` or `name=value` each."""
    asked: dict[str, float | None] = {}
    for one in given:
        name, equals, value = one.partition("=")
        try:
            asked[name.strip()] = float(value) if equals else None
        except ValueError:
            raise click.BadParameter(
                f"{one!r} is not NAME=VALUE with a number", param_hint="--knob"
            ) from None
    return asked


def _datasets(settings: Settings) -> list[Dataset]:
    """The named dataset, or the user's own log."""
    from factorlab.datasets import NAMES, load

    if settings.source in NAMES:
        if settings.model is not None:
            raise click.UsageError(f"--model goes with a log of your own; {settings.source} brings its own")
        every = 5 if settings.use_every is None else settings.use_every
        return load(settings.source, use_every=every, robot=settings.robot)
    from factorlab.compare.own import own_dataset, require_log

    path = require_log(settings.source, NAMES)
    if settings.robot is not None:
        raise click.UsageError("--robot goes with a dataset that has several")
    if settings.model is None:
        raise click.UsageError(
            f"a log of your own needs a model: factorlab tune {path} --model FILE.py:NAME "
            "(or --method still, for a sensor at rest)"
        )
    return [own_dataset(path, settings.model, None, settings.use_every or 1)]


def _at_rest(settings: Settings) -> tuple[Fitted, ...]:
    """Every stream that is asked for, or the sensors of the model, or all streams."""
    from factorlab.compare.declaration import load_declaration
    from factorlab.tuning import tune_still

    log = _log(settings)
    sensors = {} if settings.model is None else dict(load_declaration(settings.model).model.sensors)
    names = list(settings.stream) or [name for name in log if not sensors or name in sensors]
    if not names:
        from sequential.errors import MissingStreamError

        raise MissingStreamError(
            f"{settings.source} has {', '.join(log)}, the model {', '.join(sensors)}: no stream is in both"
        )
    title = f"{{}} of {Path(settings.source).name}, at rest"
    return tuple(
        tune_still(
            log,
            name,
            sensors[name].noise_cov if name in sensors else None,
            settings.lsb,
            title.format(name),
        )
        for name in names
    )


def _log(settings: Settings) -> SensorLog:
    from factorlab.compare.own import require_log
    from factorlab.datasets import NAMES
    from sequential.readers import read_log

    if settings.source in NAMES:
        raise click.UsageError(f"--method still takes a recording at rest, and {settings.source} moves")
    return read_log(require_log(settings.source, NAMES))


def _print(done: tuple[Fitted, ...]) -> None:
    from factorlab.cli.comparing import coloured
    from factorlab.tuning import fitted_lines

    for one in done:
        for line in fitted_lines(one):
            click.echo(coloured(line))
        click.echo()


def _write(done: tuple[Fitted, ...], whole: dict[str, Any], settings: Settings) -> Path:
    """The page with estimates before and after; for a sensor at rest the document alone."""
    from factorlab.tuning.report import write_document, write_page

    assert settings.out is not None  # noqa: S101 - the caller has looked
    write = write_document if settings.method == "still" else write_page
    return write(done, whole, settings.out, force=settings.force, max_gap=settings.max_gap)
