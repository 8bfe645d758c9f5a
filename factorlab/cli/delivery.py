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

__all__ = ["deliver"]

COLOURS = {"PASS": "green", "WARN": "yellow", "FAIL": "red"}


def deliver(
    document: Document,
    *,
    as_json: bool = False,
    out: Path | None = None,
    force: bool = False,
    check: bool = False,
    files: Mapping[str, str | bytes] | None = None,
) -> int:
    """Print lines or JSON, and write the folder asked for; returns 3 with `check` where a verdict is FAIL."""
    if as_json:
        print_json(document.to_json())
    else:
        _show(document)
    if out is not None:
        from factorlab.report.document import write_document

        page = write_document(document, out, force=force, files=files)
        click.echo(f"{'rapport : ' if document.lang == 'fr' else 'report: '}{page}", err=as_json)
    return CHECK_FAILED if check and document.failed else 0


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
