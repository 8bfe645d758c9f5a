"""Whatever goes wrong becomes one sentence on stderr and an exit code."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import click

__all__ = ["CHECK_FAILED", "DATA_ERROR", "INTERRUPTED", "in_one_sentence"]

DATA_ERROR, CHECK_FAILED, INTERRUPTED = 1, 3, 130
WORDS = {
    "en": {
        "error": "error: ",
        "interrupted": "interrupted",
        "unexpected": "unexpected {kind}: {what}; --debug shows where",
    },
    "fr": {
        "error": "erreur : ",
        "interrupted": "interrompu",
        "unexpected": "imprévue, {kind} : {what} ; --debug montre où",
    },
}


def in_one_sentence(command: Callable[..., int]) -> Callable[..., None]:
    """Turn a function that returns an exit code into the body of a command, and give it --debug."""

    @click.option("--debug", is_flag=True, help="Show the traceback of an error.")
    @functools.wraps(command)
    def body(*, debug: bool, **options: Any) -> None:
        raise SystemExit(command(**options) if debug else _code(lambda: command(**options)))

    return body


def _code(run: Callable[[], int]) -> int:
    from sequential.errors import FactorlabError

    words = WORDS[_language()]
    try:
        return run()
    except FactorlabError as error:
        click.echo(words["error"] + _line(error), err=True)
    except KeyboardInterrupt:
        click.echo(words["interrupted"], err=True)
        return INTERRUPTED
    except (click.ClickException, click.exceptions.Exit, click.Abort, BrokenPipeError):
        raise  # click's own: usage errors, and a reader that went away
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        click.echo(f"{words['error']}{where}{error.strerror or _line(error)}", err=True)
    except Exception as error:  # noqa: BLE001 - the last door before the user
        told = words["unexpected"].format(kind=type(error).__name__, what=_line(error))
        click.echo(words["error"] + told, err=True)
    return DATA_ERROR


def _language() -> str:
    """That of the group of commands: see `factorlab.cli.french`."""
    context = click.get_current_context(silent=True)
    return "en" if context is None else str(context.meta.get("factorlab.language", "en"))


def _line(error: BaseException) -> str:
    """The message on one line."""
    return " ".join(str(error).split()) or type(error).__name__
