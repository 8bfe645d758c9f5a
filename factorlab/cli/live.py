"""`factorlab live`: what a sensor sees, while it sees it."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.faults import DATA_ERROR, in_one_sentence
from factorlab.cli.settings import as_json, command_line, config_option, print_json

if TYPE_CHECKING:
    from factorlab.live.camera import TaskSettings

__all__ = ["live"]

TASKS = ("markers", "calibrate", "line", "features")
KINDS = ("checkerboard", "charuco", "circles", "acircles")
PORT = 8090


def _resolution(context: click.Context, parameter: click.Parameter, text: str | None) -> Any:
    """Width and height, px."""
    if text is None:
        return None
    width, _, height = text.lower().replace("×", "x").partition("x")
    if not (width.isdecimal() and height.isdecimal() and int(width) and int(height)):
        raise click.BadParameter(f"a resolution is written as 640x480, got {text!r}")
    return int(width), int(height)


@click.group(short_help="A camera, live on a page.")
def live() -> None:
    """Look at a sensor while it runs."""


@live.command(name="camera", short_help="Markers, calibration, a line or features.")
@click.argument("source", metavar="[SOURCE]", default="0")
@click.option("--task", type=click.Choice(TASKS), default="markers", show_default=True, help="To begin with.")
@click.option(
    "--camera",
    "model",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Its calibration, in any format; markers then have poses.",
)
@click.option("--which", metavar="NAME", help="Camera of a file that has several: left, cam1, 2 …")
@click.option("--size", default="50mm", show_default=True, metavar="LENGTH", help="Side of the markers.")
@click.option("--dictionary", default="auto", show_default=True, help="Of the markers.")
@click.option(
    "--board", default="9x6", show_default=True, metavar="COLSxROWS", help="As `factorlab calibrate camera`."
)
@click.option("--square", default="25mm", show_default=True, metavar="LENGTH", help="Side of its squares.")
@click.option("--kind", type=click.Choice(KINDS), default="checkerboard", show_default=True, help="Of board.")
@click.option("--marker", metavar="LENGTH", help="Side of the markers of a ChArUco board.")
@click.option("--height", metavar="LENGTH", help="Of the camera above the ground: the line in metres.")
@click.option(
    "--pitch", type=click.FloatRange(-30, 90), metavar="DEG", help="Of the camera below the horizon."
)
@click.option("--lens", default="auto", show_default=True, help="Lens model of a calibration.")
@click.option(
    "--port", type=click.IntRange(0, 65535), default=PORT, show_default=True, help="Of the page; 0: any free."
)
@click.option(
    "--record",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="DIR",
    help="Record from the start, in a folder of DIR.  [default: when asked, in ./recordings]",
)
@click.option("--loop", is_flag=True, help="Play a file again and again.")
@click.option("--fast", is_flag=True, help="A file as quickly as possible, without passing frames over.")
@click.option(
    "--fps", type=click.FloatRange(min=0, min_open=True), help="Of a folder of images, or to ask for."
)
@click.option("--resolution", metavar="WxH", callback=_resolution, help="To ask a camera for: 640x480.")
@click.option("--exit", "leave", is_flag=True, help="End with the source.  [default: with Ctrl-C]")
@click.option("--no-browser", is_flag=True, help="Only say where the page is.")
@as_json
@config_option
@in_one_sentence
def camera(source: str, **options: Any) -> int:
    """Show SOURCE on a page of this computer, with what a task sees in it.

    SOURCE is the number of a camera (0), a video file, a folder of images, a pattern (left*.jpg) or an
    address (rtsp://…).  Pause, record and change the task on the page; Ctrl-C ends, and whatever was
    recorded is complete.  With --json the summary of the session is printed at the end.
    """
    from factorlab.cli.stopping import stopping
    from factorlab.live.camera import CameraSession, PageServer, summary_of, task_choices
    from vision3d.frames import open_frames

    frames = open_frames(source, loop=options["loop"], fps=options["fps"], size=options["resolution"])
    settings = _settings(options, frames.size)
    session = CameraSession(
        frames, task_choices(settings), options["task"], recordings=settings.folder, fast=options["fast"]
    )
    with stopping() as stop, ExitStack() as ending:
        ending.callback(frames.close)
        ending.callback(session.close)
        server = PageServer(session, options["port"])
        ending.callback(server.close)
        ending.callback(session.close)  # first, so that pages hear that it is over; a second time is nothing
        if options["record"] is not None:
            session.start_recording()
        session.start()
        click.echo(f"live: {server.address}  (Ctrl-C ends)", err=True)
        if not options["no_browser"]:
            click.launch(server.address)
        while not (stop.wait(0.1) or (options["leave"] and session.ended)):
            pass
    summary = summary_of(session)
    if options["as_json"]:
        print_json(summary)
    return _told(summary, quiet=options["as_json"])


def _settings(options: dict[str, Any], size: tuple[int, int]) -> TaskSettings:
    """What the tasks need to know; what is wrong with lengths and boards is the command line's fault."""
    from factorlab.live.camera import TaskSettings
    from sequential.errors import ModelError
    from vision3d.boards import board_from_text, metres
    from vision3d.camera_files.sized import read_camera_for

    dictionary, model = options["dictionary"], options["model"]
    hung = [name for name in ("height", "pitch") if options[name] is not None]
    if len(hung) == 1:
        raise click.UsageError("a line in metres takes --height and --pitch together")
    try:
        marker_m = metres(options["size"], "size of a marker")
        height_m = metres(options["height"], "height") if hung else None
        board = board_from_text(
            options["board"], kind=options["kind"], square=options["square"], marker=options["marker"],
            dictionary="4x4_50" if dictionary == "auto" else dictionary,
        )  # fmt: skip
    except ModelError as error:
        raise click.UsageError(str(error)) from error
    return TaskSettings(
        camera=None if model is None else read_camera_for(model, size, which=options["which"]),
        marker_m=marker_m,
        dictionary=dictionary,
        board=board,
        lens=options["lens"],
        height_m=height_m,
        pitch_deg=options["pitch"],
        folder=options["record"] or Path("recordings"),
        command=command_line(),
    )


def _told(summary: dict[str, Any], *, quiet: bool) -> int:
    """Say how it ended."""
    if not quiet:
        click.echo(f"{summary['frames']} frames of {summary['source']}, {summary['worked_on']} worked on")
    for one in summary["recordings"]:
        lost = f", {one['lost']} lost: the disk is too slow" if one["lost"] else ""
        click.echo(f"recorded: {one['frames']} frames in {one['folder']}{lost}", err=True)
    calibration = summary["tasks"].get("calibrate", {})
    if calibration.get("pictures") and not calibration["saved"]:
        click.echo(f"pictures of the board: {calibration['pictures']}", err=True)
    elif calibration.get("saved"):
        click.echo(f"calibration: {calibration['saved']}", err=True)
    for sentence in summary["left_out"]:
        click.echo(f"warn: {sentence}", err=True)
    faults = [summary["fault"], *(one["fault"] for one in summary["recordings"])]
    for fault in filter(None, faults):
        click.echo(f"error: {fault}", err=True)
    return DATA_ERROR if any(faults) else 0
