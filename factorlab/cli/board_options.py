"""Options that say which board pictures show."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.settings import Command

if TYPE_CHECKING:
    from vision3d.boards import Board

__all__ = ["BOARD_OPTIONS", "board_of", "board_options"]

KINDS = ("checkerboard", "charuco", "circles", "acircles", "markers")


def board_options(*, required: bool) -> tuple[Callable[[Command], Command], ...]:
    """Options of the board; where they are not required, the command says itself what is missing."""
    return (
        click.option("--board", "board_text", metavar="COLSxROWS", required=required,
                     help="Inner corners of a checkerboard (9x6), squares of ChArUco, circles, markers."),
        click.option("--square", metavar="LENGTH", required=required,
                     help="Side of a square or of a marker, or distance of circles: 25mm, 2.5cm, 0.025m."),
        click.option("--kind", type=click.Choice(KINDS), default="checkerboard", show_default=True,
                     help="What is on the board."),
        click.option("--marker", metavar="LENGTH",
                     help="Markers of a ChArUco board: 18mm, 0.75 squares by default; gap of markers."),
        click.option("--dictionary", metavar="NAME",
                     help="Of the markers: 4x4_50, 6x6_250 …  [default: 4x4_50]"),
    )  # fmt: skip


BOARD_OPTIONS = board_options(required=True)


def board_of(options: dict[str, Any]) -> Board:
    """The board of --board, --square, --kind, --marker and --dictionary.

    Raises
    ------
    click.UsageError
        where they do not go together: that is the command line's fault.
    """
    from sequential.errors import FactorlabError
    from vision3d.boards import board_from_text

    if options["kind"] not in ("charuco", "markers"):
        for name in ("marker", "dictionary"):
            if options[name] is not None:
                raise click.UsageError(f"--{name} goes with --kind charuco or markers")
    try:
        return board_from_text(
            options["board_text"], kind=options["kind"], square=options["square"],
            marker=options["marker"], dictionary=options["dictionary"] or "4x4_50",
        )  # fmt: skip
    except FactorlabError as error:
        raise click.BadParameter(str(error), param_hint="--board") from error
