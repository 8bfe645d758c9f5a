"""What every command that ends in a document does with it: print it, write it, return an exit code."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from factorlab.cli.faults import CHECK_FAILED
from factorlab.cli.settings import print_json

if TYPE_CHECKING:
    from factorlab.report.document import Document

__all__ = ["deliver", "header_option", "require_output", "show"]

COLOURS = {"PASS": "green", "WARN": "yellow", "FAIL": "red"}
HEADER = "calibration.h"
header_option = click.option(
    "--c-header",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE.h",
    help="Write the constants as a C header here, for the firmware.",
)


def require_output(out: Path | None, c_header: Path | None, *, force: bool) -> None:
    """Raise unless results may be written where they are asked for; called before the work is done.

    Raises
    ------
    DataError
        where something is there already and `force` is False, or where a folder is missing.
    """
    if out is not None:
        from factorlab.report.folder import require_free

        require_free(out, force=force)
    if c_header is not None:
        from sequential.errors import DataError

        if c_header.exists() and not force:
            raise DataError(f"{c_header} is there already; choose another name, or use --force")
        if not c_header.parent.is_dir():
            raise DataError(f"{c_header} cannot be written: there is no folder {c_header.parent}; create it")


def deliver(
    document: Document,
    *,
    as_json: bool = False,
    out: Path | None = None,
    force: bool = False,
    check: bool = False,
    files: Mapping[str, str | bytes] | None = None,
    c_header: Path | None = None,
) -> int:
    """Print lines or JSON, and write the folder asked for; returns 3 with `check` where a verdict is FAIL.

    `c_header` is where calibration.h of `files` goes besides.
    """
    show(document, as_json=as_json)
    if out is not None:
        from factorlab.report.document import write_document

        page = write_document(document, out, force=force, files=files)
        click.echo(f"{'rapport : ' if document.lang == 'fr' else 'report: '}{page}", err=as_json)
    if c_header is not None:
        from sequential.readers.files import replacing

        with replacing(c_header) as file:
            file.write((files or {})[HEADER])
        click.echo(f"header: {c_header}", err=as_json)
    return CHECK_FAILED if check and document.failed else 0


def show(document: Document, *, as_json: bool) -> None:
    """Print lines or JSON."""
    if as_json:
        print_json(document.to_json())
    else:
        _show(document)


def _show(document: Document) -> None:
    """Lines with the verdicts in colour, unless NO_COLOR is set."""
    import os

    from factorlab.report.document_text import document_lines
    from factorlab.report.words import WORDS

    badges = {} if "NO_COLOR" in os.environ else WORDS[document.lang].badges
    colour_of = {word: COLOURS[status] for status, word in badges.items() if status in COLOURS}
    for line in document_lines(document):
        first, gap, rest = line.partition("  ")
        click.echo(
            click.style(first, fg=colour_of[first], bold=True) + gap + rest if first in colour_of else line
        )
