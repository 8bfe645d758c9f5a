"""Options that several commands share, and the TOML file that may give them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import click

__all__ = [
    "Command",
    "as_json",
    "check_option",
    "command_line",
    "config_option",
    "lags_of",
    "max_gap_option",
    "print_json",
    "robot_option",
    "seed_option",
    "with_options",
]

Command = Callable[..., Any]

as_json = click.option(
    "--json", "as_json", is_flag=True, help="One JSON document on stdout, all else on stderr."
)
seed_option = click.option("--seed", type=int, default=0, show_default=True, help="Seed of resampled bands.")
check_option = click.option("--check", is_flag=True, help="Exit with 3 when a finding is FAIL.")
robot_option = click.option(
    "--robot", type=int, metavar="N", help="Only this robot, where a dataset has several."
)
max_gap_option = click.option(
    "--max-gap",
    type=click.FloatRange(min=0, min_open=True),
    metavar="S",
    help="Longest pause of the input to bridge, s.",
)


def with_options(command: Command, options: Sequence[Callable[[Command], Command]]) -> Command:
    """Give a command arguments and options, in the order in which its help lists them."""
    for option in reversed(options):
        command = option(command)
    return command


def config_option(command: Command) -> Command:
    """Give a command `--config FILE.toml`, whose keys are the names of its options."""
    return click.option(
        "--config",
        type=click.Path(dir_okay=False, path_type=Path),
        is_eager=True,
        expose_value=False,
        callback=_read,
        metavar="FILE.toml",
        help="Options from a file: use_every = 5, estimators = ['ekf', 'batch'] …; the command line wins.",
    )(command)


def _read(context: click.Context, parameter: click.Parameter, path: Path | None) -> None:
    if path is None:
        return
    import tomllib

    try:
        given = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise click.BadParameter(f"{path}: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise click.BadParameter(f"{path} is not TOML: {error}") from error
    known = _known(context.command)
    several = {p.name for p in context.command.params if getattr(p, "multiple", False)}
    values = {}
    for key, value in given.items():
        name = known.get(key.replace("-", "_"))
        if name is None:
            raise click.BadParameter(f"{path}: unknown key {key!r}{did_you_mean(key, known)}")
        row = [str(one) for one in (value if isinstance(value, list) else [value])]
        values[name] = row if name in several else ",".join(row) if isinstance(value, list) else value
    context.default_map = {**(context.default_map or {}), **values}


def _known(command: click.Command) -> dict[str, str]:
    """Names that a file may use, each with the parameter it stands for."""
    known = {}
    for parameter in command.params:
        if parameter.name is None or parameter.name in {"config", "help", "debug"}:
            continue
        for option in (*parameter.opts, parameter.name):
            if len(option) > 2:
                known[option.lstrip("-").replace("-", "_")] = parameter.name
    return known


def did_you_mean(key: str, known: Any) -> str:
    """`; did you mean …?`, or the whole list where nothing is near."""
    near = get_close_matches(key, list(known), n=1, cutoff=0.5)
    return f"; did you mean {near[0]!r}?" if near else f"; known are {', '.join(sorted(known))}"


def lags_of(given: str | None) -> tuple[float, ...]:
    """`--lags 1,5,20` as numbers; a usage error for what is not."""
    if given is None:
        return ()
    try:
        return tuple(float(part) for part in given.split(",") if part.strip())
    except ValueError as error:
        raise click.BadParameter(
            f"{given!r} is not a row of numbers such as 1,5,20", param_hint="--lags"
        ) from error


def command_line() -> str:
    """The command line, as it can be typed again."""
    import shlex
    import sys

    return shlex.join(["factorlab", *sys.argv[1:]])


def print_json(document: Any) -> None:
    """The one document on stdout: strict JSON, no NaN."""
    import json

    click.echo(json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False))
