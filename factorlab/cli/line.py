"""`factorlab line`: the line on the ground in pictures and videos."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.faults import in_one_sentence
from factorlab.cli.settings import Command, as_json, check_option, command_line, config_option, with_options

if TYPE_CHECKING:
    from factorlab.lines import LineJob
    from vision3d.camera import Camera
    from vision3d.lines import CameraMount, GroundHomography, LineSettings

__all__ = ["line"]

OPTIONS = (
    click.argument("source", metavar="SOURCE"),
    click.option("--polarity", type=click.Choice(("auto", "dark", "light")), default="auto",
                 show_default=True, help="A line darker or lighter than the ground."),
    click.option("--threshold", type=click.Choice(("adaptive", "otsu")), default="adaptive",
                 show_default=True, help="Against the ground round each pixel, or one level for all."),
    click.option("--contrast", type=click.FloatRange(0.03, 1.0), default=0.15, show_default=True,
                 metavar="SHARE", help="Least difference of line and ground, of the ground's brightness."),
    click.option("--middle", type=click.FloatRange(0, 0.95), default=0.5, show_default=True, metavar="SHARE",
                 help="The row that looks ahead, from the top."),
    click.option("--top", type=click.FloatRange(0, 0.9), metavar="SHARE",
                 help="Nothing above this share of the height is looked at.  [default: 0.35, or --middle]"),
    click.option("--width", type=(float, float), metavar="LEAST MOST",
                 help="Width of the line at the bottom, as shares of the image's.  [default: 0.012 0.5]"),
    click.option("--lane", is_flag=True, help="Look for the two sides of a lane as well."),
    click.option("--camera", "camera_file", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE",
                 help="Calibration, in any format; with --height and --pitch the answer is in metres."),
    click.option("--which", metavar="NAME", help="Camera of a file that has several: left, cam1, 2 …"),
    click.option("--height", metavar="LENGTH", help="Of the camera above the ground: 20cm."),
    click.option("--pitch", type=click.FloatRange(-30, 90), metavar="DEG",
                 help="Of the camera downwards from the horizon."),
    click.option("--roll", type=float, default=0.0, metavar="DEG", help="Of the camera about its axis."),
    click.option("--height-sigma", metavar="LENGTH", help="How well the height is known: 2mm."),
    click.option("--angle-sigma", type=click.FloatRange(0, 10), metavar="DEG",
                 help="How well the angles are known."),
    click.option("--points", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE.csv",
                 help="Marks on the ground instead: columns x_px, y_px, x_m, y_m; four or more."),
    as_json,
    click.option("-o", "--out", type=click.Path(path_type=Path), metavar="DIR",
                 help="Write the report, frames.csv and pictures or line.avi here."),
    click.option("--force", is_flag=True, help="Write over an earlier report in DIR."),
    check_option,
    config_option,
)  # fmt: skip


def line_options(command: Command) -> Command:
    """Argument and options of the command."""
    return with_options(command, OPTIONS)


@click.command(short_help="The line that a robot follows, in pictures and videos.")
@line_options
@in_one_sentence
def line(source: str, **options: Any) -> int:
    """Offset and heading of the line on the ground in SOURCE: a picture, a folder, a video, or a camera (0).

    The line is the stripe, dark or light, that runs from the bottom of the image up to its middle and stands
    out from the ground; where there is none, that is the answer, with what the picture shows instead.  With
    the calibration of the camera and where it hangs, or with marks on the ground, the answer is in metres.
    Ctrl-C ends the reading of a camera; what was read until then is reported.
    """
    from factorlab.cli.delivery import deliver, require_output
    from factorlab.cli.progress import bar
    from factorlab.cli.stopping import stopping
    from factorlab.lines import line_document, line_files, read_lines

    out = options["out"]
    require_output(out, None, force=options["force"])
    job = _job(options)
    with bar("line", shown=_on_terminal()) as progress, _video(out) as film, stopping() as stop:
        run = read_lines(source, job, progress, film.add if film else None, stop.is_set)
        files = line_files(run) if out is not None else {}
        if film is not None and not run.is_picture:
            files["line.avi"] = film.content()
    return deliver(
        line_document(run, command_line()),
        as_json=options["as_json"],
        out=out,
        force=options["force"],
        check=options["check"],
        files=files,
    )


def _on_terminal() -> bool:
    import sys

    return sys.stderr.isatty()


def _video(out: Path | None) -> Any:
    """Frames with what was found drawn in; nothing where nothing is to be written."""
    from contextlib import nullcontext

    if out is None:
        return nullcontext()
    from factorlab.lines.film import Film

    return Film()


def _job(options: dict[str, Any]) -> LineJob:
    """What the options ask for; what contradicts itself is the command line's fault."""
    from factorlab.lines import LineJob

    settings = _settings(options)
    if options["points"] is not None:
        for name in ("height", "pitch", "height_sigma", "angle_sigma"):
            if options[name] is not None:
                raise click.UsageError(
                    f"--points says where the ground is; --{name.replace('_', '-')} does too"
                )
        return LineJob(settings, lambda size: _from_points(options, size), options["lane"])
    asked = [name for name in ("height", "pitch") if options[name] is not None]
    if not asked:
        for name in ("height_sigma", "angle_sigma"):
            if options[name] is not None:
                raise click.UsageError(f"--{name.replace('_', '-')} goes with --height and --pitch")
        return LineJob(settings, lane=options["lane"])
    if len(asked) < 2 or options["camera_file"] is None:
        raise click.UsageError("metres take --camera, --height and --pitch together, or --points")
    mount, cov = _mount(options)
    return LineJob(settings, lambda size: _from_camera(options, size, mount, cov), options["lane"])


def _settings(options: dict[str, Any]) -> LineSettings:
    from sequential.errors import FactorlabError
    from vision3d.lines import LineSettings

    middle = options["middle"]
    given = {"width": options["width"]} if options["width"] is not None else {}
    top = options["top"] if options["top"] is not None else min(0.35, middle)
    try:
        return LineSettings(
            polarity=options["polarity"],
            threshold=options["threshold"],
            contrast=options["contrast"],
            middle=middle,
            top=top,
            **given,
        )
    except FactorlabError as error:
        raise click.UsageError(str(error)) from error


def _mount(options: dict[str, Any]) -> tuple[CameraMount, Any]:
    """Where the camera hangs, and the covariance of that."""
    import numpy as np

    from sequential.errors import FactorlabError
    from vision3d.boards import metres
    from vision3d.lines import CameraMount

    try:
        height = metres(options["height"], "height")
        sigma_m = metres(options["height_sigma"], "height") if options["height_sigma"] else 0.0
    except FactorlabError as error:
        raise click.BadParameter(str(error), param_hint="--height") from error
    mount = CameraMount(height, np.radians(options["pitch"]), np.radians(options["roll"]))
    angle = np.radians(options["angle_sigma"] or 0.0)
    return mount, np.diag(np.square([angle, angle, angle, sigma_m, sigma_m, sigma_m]))


def _camera(options: dict[str, Any], size: tuple[int, int]) -> Camera:
    """The calibration, which must be that of the images."""
    from vision3d.camera_files.sized import read_camera_for

    return read_camera_for(options["camera_file"], size, which=options["which"])


def _from_camera(
    options: dict[str, Any], size: tuple[int, int], mount: CameraMount, cov: Any
) -> GroundHomography:
    from vision3d.lines import GroundHomography

    return GroundHomography.from_camera(_camera(options, size), mount, cov)


def _from_points(options: dict[str, Any], size: tuple[int, int]) -> GroundHomography:
    from factorlab.lines.marks import read_marks
    from vision3d.lines import GroundHomography

    pixels, ground = read_marks(options["points"])
    camera = None if options["camera_file"] is None else _camera(options, size)
    return GroundHomography.from_points(pixels, ground, camera=camera)
