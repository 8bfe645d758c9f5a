"""`factorlab sheet`: boards and markers to print, true to size."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.faults import in_one_sentence
from factorlab.cli.settings import Command, as_json, config_option, print_json, with_options

if TYPE_CHECKING:
    from vision3d.boards import Board
    from vision3d.sheets import Page

__all__ = ["sheet"]


@click.group(short_help="Boards and markers to print, true to size.")
def sheet() -> None:
    """Sheets to print: checkerboards, ChArUco boards, circles, markers; PDF or SVG, true to size.

    Print at 100 %, measure the ruler at the foot of the sheet, glue the sheet to something flat.  Each sheet
    says which command takes it.
    """


def sheet_options(command: Command) -> Command:
    """Options that every sheet has."""
    options = (
        click.option(
            "--paper",
            default="a4",
            show_default=True,
            metavar="NAME",
            help="a4, a3, a2, a1, a0, letter, legal, tabloid, or width x height in mm: 600x400.",
        ),
        click.option(
            "-o",
            "--out",
            type=click.Path(dir_okay=False, path_type=Path),
            required=True,
            metavar="FILE",
            help="FILE.pdf or FILE.svg.",
        ),
        click.option("--force", is_flag=True, help="Write over an earlier sheet."),
        as_json,
        config_option,
        in_one_sentence,
    )
    return with_options(command, options)


def board_options(default: str, counted: str, side: str) -> Callable[[Command], Command]:
    """Size of a board and of its squares."""

    def decorate(command: Command) -> Command:
        command = click.option(
            "--square", metavar="LENGTH", help=f"{side}, such as 25mm.  [default: the largest that fits]"
        )(command)
        return click.option(
            "--board", default=default, show_default=True, metavar="COLSxROWS", help=f"{counted}."
        )(command)

    return decorate


@sheet.command(short_help="Checkerboard.")
@board_options("9x6", "Inner corners, one fewer than squares each way", "Side of a square")
@sheet_options
def checkerboard(**options: Any) -> int:
    """A checkerboard; one even and one odd number of corners tell it from itself upside down."""
    return _board(options, kind="checkerboard")


@sheet.command(short_help="ChArUco board: also useful when it is partly out of the picture.")
@board_options("7x5", "Squares", "Side of a square")
@click.option("--marker", metavar="LENGTH", help="Side of the markers.  [default: 0.75 of the square]")
@click.option("--dictionary", default="5x5_100", show_default=True, metavar="NAME", help="Of the markers.")
@click.option("--legacy", is_flag=True, help="The pattern of OpenCV before 4.6.")
@sheet_options
def charuco(**options: Any) -> int:
    """A ChArUco board: a checkerboard with markers, which may be seen in part."""
    return _board(options, kind="charuco")


@sheet.command(short_help="Grid of circles.")
@board_options("7x5", "Circles in a row, and rows", "Spacing of the circles")
@click.option("--asymmetric", is_flag=True, help="Every second row is moved, as in OpenCV's 4x11.")
@sheet_options
def circles(**options: Any) -> int:
    """A grid of circles, symmetric or not."""
    return _board(options, kind="acircles" if options["asymmetric"] else "circles")


def marker_options(command: Command) -> Command:
    """Which markers, how large, on which board."""
    options = (
        click.option("--ids", default="0-5", show_default=True, metavar="LIST", help="0-11 or 3,7,12."),
        click.option(
            "--size", default="50mm", show_default=True, metavar="LENGTH", help="Side of the black square."
        ),
        click.option("--gap", metavar="LENGTH", help="White between them.  [default: a quarter of the size]"),
        click.option("--board", metavar="COLSxROWS", help="One board of markers instead of single ones."),
    )
    return with_options(command, options)


@sheet.command(short_help="ArUco markers, or a board of them.")
@marker_options
@click.option("--dictionary", default="4x4_50", show_default=True, metavar="NAME", help="Of the markers.")
@sheet_options
def markers(**options: Any) -> int:
    """ArUco markers to cut out, each with its number, or with --board a board of them."""
    return _markers(options)


@sheet.command(short_help="AprilTags, or a board of them.")
@marker_options
@click.option(
    "--family",
    "dictionary",
    default="36h11",
    show_default=True,
    type=click.Choice(("16h5", "25h9", "36h10", "36h11")),
    help="Of the tags.",
)
@sheet_options
def apriltags(**options: Any) -> int:
    """AprilTags to cut out, each with its number, or with --board a board of them."""
    return _markers(options)


def _board(options: dict[str, Any], kind: Any) -> int:
    from sequential.errors import ModelError
    from vision3d.boards import board_from_text
    from vision3d.sheets import board_page, calibration_command, largest_square_m

    given = {key: options[key] for key in ("marker", "dictionary", "legacy") if key in options}
    try:
        if options["square"] is None:
            trial = board_from_text(options["board"], square="100mm", kind=kind, **{**given, "marker": None})
            options["square"] = f"{1e3 * largest_square_m(trial, options['paper']):.6g}mm"
        board = board_from_text(options["board"], square=options["square"], kind=kind, **given)
        page = board_page(board, options["paper"])
    except ModelError as error:
        raise click.UsageError(str(error)) from error
    return _written([page], options, board, calibration_command(board))


def _markers(options: dict[str, Any]) -> int:
    from sequential.errors import ModelError
    from vision3d.boards import MarkerBoard, metres, size_from_text
    from vision3d.sheets import board_page, calibration_command, marker_pages

    try:
        size_m = metres(options["size"], "size")
        gap_m = None if options["gap"] is None else metres(options["gap"], "gap")
        ids = _numbers(options["ids"])
        if options["board"] is None:
            pages = marker_pages(options["dictionary"], ids, size_m, gap_m=gap_m, paper=options["paper"])
            board, command = None, f"factorlab markers IMAGE --size {options['size']}"
        else:
            columns, rows = size_from_text(options["board"])
            gap = 0.25 * size_m if gap_m is None else gap_m
            board = MarkerBoard.grid(columns, rows, size_m, gap, options["dictionary"], ids[0])
            pages, command = [board_page(board, options["paper"])], calibration_command(board)
    except ModelError as error:
        raise click.UsageError(str(error)) from error
    return _written(pages, options, board, command)


def _numbers(text: str) -> list[int]:
    """Numbers written as 0-5 or 3,7,12 or both."""
    import re

    from sequential.errors import ModelError

    ids: list[int] = []
    for part in text.replace(" ", "").split(","):
        match = re.fullmatch(r"(\d{1,4})(?:-(\d{1,4}))?", part)
        if match is None:
            raise ModelError(f"--ids is a list such as 0-11 or 3,7,12; got {text!r}")
        ids += range(int(match[1]), int(match[2] or match[1]) + 1)
    return ids


def _written(pages: list[Page], options: dict[str, Any], board: Board | None, command: str) -> int:
    """Write the sheets as the name of the file says, and tell of them."""
    from sequential.errors import DataError
    from vision3d.sheets import pdf_of, svg_of

    out: Path = options["out"]
    kind = out.suffix.lower()
    if kind not in {".pdf", ".svg"}:
        raise click.BadParameter(f"{out.name} is neither .pdf nor .svg", param_hint="--out")
    single = kind == ".pdf" or len(pages) == 1
    files = [out] if single else [out.with_stem(f"{out.stem}-{k + 1}") for k in range(len(pages))]
    for file in files:
        if file.exists() and not options["force"]:
            raise DataError(f"{file} is there already; choose another name, or use --force")
        if not file.parent.is_dir():
            raise DataError(f"{file} cannot be written: there is no folder {file.parent}; create it")
    if kind == ".pdf":
        out.write_bytes(pdf_of(pages))
    else:
        for file, page in zip(files, pages, strict=True):
            file.write_text(svg_of(page), encoding="utf-8")
    if options["as_json"]:
        told = {
            "files": [str(file) for file in files],
            "title": pages[0].title,
            "pages": len(pages),
            "paper_mm": [pages[0].width, pages[0].height],
            "points": None if board is None else board.count,
            "command": command,
        }
        print_json(told)
    else:
        click.echo(
            f"{pages[0].title}: {', '.join(map(str, files))} ({len(pages)} sheet{'s'[: len(pages) > 1]})"
        )
        click.echo(f"print at 100 %, check the ruler, then: {command}")
    return 0
