"""Whatever goes wrong becomes one sentence on stderr and an exit code."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import click

__all__ = ["CHECK_FAILED", "DATA_ERROR", "INTERRUPTED", "in_one_sentence"]

DATA_ERROR, CHECK_FAILED, INTERRUPTED = 1, 3, 130


def in_one_sentence(command: Callable[..., int]) -> Callable[..., None]:
    """Turn a function that returns an exit code into the body of a command, and give it --debug."""

    @click.option("--debug", is_flag=True, help="Show the traceback of an error.")
    @functools.wraps(command)
    def body(*, debug: bool, **options: Any) -> None:
        raise SystemExit(command(**options) if debug else _code(lambda: command(**options)))

    return body


def _code(run: Callable[[], int]) -> int:
    from sequential.errors import FactorlabError

    try:
        return run()
    except FactorlabError as error:
        click.echo(f"error: {_line(error)}", err=True)
    except KeyboardInterrupt:
        click.echo("interrupted", err=True)
        return INTERRUPTED
    except (click.ClickException, click.exceptions.Exit, click.Abort, BrokenPipeError):
        raise  # click's own: usage errors, and a reader that went away
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        click.echo(f"error: {where}{error.strerror or _line(error)}", err=True)
    except Exception as error:  # noqa: BLE001 - the last door before the user
        kind = type(error).__name__
        click.echo(f"error: unexpected {kind}: {_line(error)}; --debug shows where", err=True)
    return DATA_ERROR


def _line(error: BaseException) -> str:
    """The message on one line."""
    return " ".join(str(error).split()) or type(error).__name__
