"""What comparisons of chains and of SLAM problems share on the command line."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import click

from factorlab.cli.faults import CHECK_FAILED, DATA_ERROR
from factorlab.cli.settings import print_json

if TYPE_CHECKING:
    from factorlab.compare import Comparison
    from factorlab.slam import SlamComparison

__all__ = ["coloured", "exit_code", "names_of", "progress_of", "say_why", "show"]

One = TypeVar("One")
Names = tuple[str, ...]


def names_of(given: str | None, require: Callable[[Names], Names]) -> Names | None:
    """Names of estimators; a wrong one is a usage error."""
    if given is None:
        return None
    from factorlab.compare.estimators import UnknownEstimatorError

    try:
        return require(tuple(name.strip() for name in given.split(",") if name.strip()))
    except UnknownEstimatorError as error:
        raise click.BadParameter(str(error), param_hint="--estimators") from error


def progress_of(name: str) -> Any:
    """A progress bar, where somebody watches."""
    from factorlab.cli.progress import bar

    return bar(name, shown=sys.stderr.isatty())


def show(
    comparisons: Sequence[One],
    whole: dict[str, Any],
    lines: Callable[[One], Iterable[str]],
    *,
    as_json: bool,
) -> None:
    """The document, or every comparison line by line."""
    if as_json:
        print_json(whole)
        return
    for comparison in comparisons:
        for line in lines(comparison):
            click.echo(coloured(line))
        click.echo()


def coloured(line: str) -> str:
    """A line with its status in colour, unless NO_COLOR is set."""
    colours = {"PASS": "green", "WARN": "yellow", "FAIL": "red"}
    if line[:4] in colours and "NO_COLOR" not in os.environ:
        return click.style(line[:4], fg=colours[line[:4]], bold=True) + line[4:]
    return line


def say_why(comparisons: Sequence[Comparison | SlamComparison]) -> int:
    """No estimator succeeded: the reasons in one sentence."""
    reasons = dict.fromkeys(row.message for comparison in comparisons for row in comparison.rows)
    click.echo(f"error: no estimator succeeded: {'; '.join(reasons)}", err=True)
    return DATA_ERROR


def exit_code(comparisons: Sequence[Comparison | SlamComparison], *, check: bool) -> int:
    """3 where it was asked for and a finding is FAIL."""
    failed = any(finding.status == "FAIL" for comparison in comparisons for finding in comparison.findings)
    return CHECK_FAILED if check and failed else 0
