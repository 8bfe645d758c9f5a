"""`factorlab calibrate stereo`: two cameras and their pose from pairs of pictures of a board."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.board_options import BOARD_OPTIONS, board_of
from factorlab.cli.calibrate_camera import LENSES
from factorlab.cli.faults import in_one_sentence
from factorlab.cli.progress import bar
from factorlab.cli.settings import Command, as_json, check_option, command_line, config_option, with_options

if TYPE_CHECKING:
    from factorlab.stereo.calibrated import StereoSettings

__all__ = ["stereo"]

FILE = click.Path(dir_okay=False, path_type=Path)

OPTIONS: tuple[Callable[[Command], Command], ...] = (
    click.argument("sources", metavar="LEFT RIGHT", nargs=-1, required=True),
    *BOARD_OPTIONS,
    click.option("--lens", type=click.Choice(LENSES), default="auto", show_default=True,
                 help="Lens model of both; auto takes for each the one that predicts best."),
    click.option("--left-camera", type=FILE, metavar="FILE",
                 help="Calibration of the left camera, in any format: it is held."),
    click.option("--right-camera", type=FILE, metavar="FILE", help="The same of the right camera."),
    click.option("--intrinsics", type=click.Choice(("joint", "alone")), default="joint", show_default=True,
                 help="Both cameras and their pose together, or each camera by itself first and then held."),
    click.option("--board-shape", type=click.Choice(("auto", "flat", "bent")), default="auto",
                 show_default=True, help="auto estimates a bend where left-out pictures call for it."),
    click.option("--window", type=click.IntRange(1, 60), metavar="N",
                 help="Half-width of the corner window, px.  [default: from the squares, corner by corner]"),
    click.option("--frames", type=click.IntRange(3, 500), default=40, show_default=True, metavar="N",
                 help="Pairs taken from two videos: the sharpest of N equal stretches."),
    click.option("--all-corners", is_flag=True,
                 help="Keep corners that noise does not explain, and pairs that the others contradict."),
    as_json,
    click.option("-o", "--out", type=click.Path(path_type=Path), metavar="DIR",
                 help="Write the report, the rig in every format, corners.csv and pairs.csv here."),
    click.option("--force", is_flag=True, help="Write over an earlier report in DIR."),
    check_option,
    config_option,
)  # fmt: skip


def stereo_options(command: Command) -> Command:
    """Argument and options of the command."""
    return with_options(command, OPTIONS)


@click.command(short_help="Two cameras and their pose, from pairs of pictures of a board.")
@stereo_options
@in_one_sentence
def stereo(sources: tuple[str, ...], **options: Any) -> int:
    """Two cameras and where they are to each other, from pairs of pictures of a board.

    LEFT and RIGHT are two quoted patterns, folders or videos ('left*.jpg' 'right*.jpg').  Pictures are paired
    by name, by number or in order.  Ten to twenty pairs do: the board where both cameras see it, tilted by 30
    to 45° this way and that, near and far, at rest.

    Everything is estimated together; each pair is then predicted from the others, and a rig that moved
    between pairs is told.
    """
    from factorlab.cli.delivery import deliver, require_output
    from factorlab.stereo.calibration_document import stereo_document
    from factorlab.stereo.calibration_job import calibrate_stereo_pictures
    from factorlab.stereo.calibration_numbers import stereo_files
    from factorlab.stereo.pairing import split_sides

    require_output(options["out"], None, force=options["force"])
    settings = _settings(options)
    if len(sources) < 2:
        raise click.UsageError("LEFT and RIGHT are two patterns, folders or videos; only one was given")
    left, right = split_sides(sources)
    told: list[str] = []
    try:
        with bar("stereo", shown=sys.stderr.isatty()) as progress:
            done = calibrate_stereo_pictures(left, right, settings, say=told.append, progress=progress)
    finally:  # what was left out is said once the bar is gone, also where the rest ends in an error
        for text in told:
            click.echo(text, err=True)
    return deliver(
        stereo_document(done, command_line()),
        as_json=options["as_json"],
        out=options["out"],
        force=options["force"],
        check=options["check"],
        files=stereo_files(done) if options["out"] is not None else None,
    )


def _settings(options: dict[str, Any]) -> StereoSettings:
    """The board and the rest."""
    from factorlab.stereo.calibrated import StereoSettings

    return StereoSettings(
        board=board_of(options),
        lens=options["lens"],
        cameras=(options["left_camera"], options["right_camera"]),
        intrinsics=options["intrinsics"],
        window=options["window"],
        robust=not options["all_corners"],
        shape=options["board_shape"],
        frames=options["frames"],
    )
