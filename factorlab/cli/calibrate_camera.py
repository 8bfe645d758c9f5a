"""`factorlab calibrate camera`: a lens from pictures of a board, and how sure it is."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.board_options import BOARD_OPTIONS, board_of
from factorlab.cli.faults import in_one_sentence
from factorlab.cli.progress import bar
from factorlab.cli.settings import Command, as_json, check_option, command_line, config_option, with_options

if TYPE_CHECKING:
    from factorlab.camera import CameraSettings

__all__ = ["LENSES", "camera"]

LENSES = ("auto", "pinhole", "brown1", "brown2", "brown4", "brown5", "rational8", "thin12", "fisheye4")


OPTIONS: tuple[Callable[[Command], Command], ...] = (
    click.argument("sources", metavar="IMAGES…", nargs=-1, required=True),
    *BOARD_OPTIONS,
    click.option("--lens", type=click.Choice(LENSES), default="auto", show_default=True,
                 help="Lens model; auto takes the one that predicts pictures best that it has not seen."),
    click.option("--board-shape", type=click.Choice(("auto", "flat", "bent")), default="auto",
                 show_default=True, help="auto estimates a bend where left-out pictures call for it."),
    click.option("--window", type=click.IntRange(1, 60), metavar="N",
                 help="Half-width of the corner window, px.  [default: from the squares, corner by corner]"),
    click.option("--frames", type=click.IntRange(3, 500), default=40, show_default=True, metavar="N",
                 help="Pictures taken from a video: the sharpest of N equal stretches."),
    click.option("--compare", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE",
                 help="Another calibration of the camera, in any format: a map of how they differ."),
    click.option("--next-pose/--no-next-pose", default=True, show_default=True,
                 help="Find where the board would tell most next."),
    click.option("--all-corners", is_flag=True, help="Keep corners that noise does not explain."),
    as_json,
    click.option("-o", "--out", type=click.Path(path_type=Path), metavar="DIR",
                 help="Write the report, the camera in five formats, corners.csv and poses.csv here."),
    click.option("--force", is_flag=True, help="Write over an earlier report in DIR."),
    check_option,
    config_option,
)  # fmt: skip


def camera_options(command: Command) -> Command:
    """Argument and options of the command."""
    return with_options(command, OPTIONS)


@click.command(short_help="Camera, from pictures of a checkerboard, ChArUco or circles.")
@camera_options
@in_one_sentence
def camera(sources: tuple[str, ...], **options: Any) -> int:
    """Intrinsics and distortion of a camera, with their uncertainty, from IMAGES of a board.

    IMAGES are files, patterns, folders or videos.  Ten to twenty pictures do: the board tilted by 30 to 45°
    this way and that, near enough to fill the image, in every corner of it once.

    Corners are found and audited picture by picture; the lens model is the one that predicts left-out
    pictures best; a map says how sure a projection is everywhere in the image.
    """
    from factorlab.camera import calibrate_pictures, camera_document, export_files
    from factorlab.cli.delivery import deliver, require_output

    require_output(options["out"], None, force=options["force"])
    settings = _settings(options)
    told: list[str] = []
    try:
        with bar("camera", shown=sys.stderr.isatty()) as progress:
            done = calibrate_pictures(sources, settings, say=told.append, progress=progress)
    finally:  # what was left out is said once the bar is gone, also where the rest ends in an error
        for text in told:
            click.echo(text, err=True)
    command = command_line()
    return deliver(
        camera_document(done, command),
        as_json=options["as_json"],
        out=options["out"],
        force=options["force"],
        check=options["check"],
        files=export_files(done) if options["out"] is not None else None,
    )


def _settings(options: dict[str, Any]) -> CameraSettings:
    """The board and the rest."""
    from factorlab.camera import CameraSettings

    return CameraSettings(
        board=board_of(options),
        lens=options["lens"],
        window=options["window"],
        robust=not options["all_corners"],
        shape=options["board_shape"],
        frames=options["frames"],
        compare=options["compare"],
        next_pose=options["next_pose"],
    )
