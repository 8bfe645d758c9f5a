"""`factorlab markers`: ArUco and AprilTag markers of a picture or a video, and where they are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from factorlab.cli.faults import in_one_sentence
from factorlab.cli.marker_map import map_options, only_with_map
from factorlab.cli.recording import recording_options
from factorlab.cli.settings import as_json, check_option, command_line, config_option

__all__ = ["markers"]


@click.command(short_help="ArUco and AprilTag markers of a picture or video, with poses and odds.")
@click.argument("source", metavar="SOURCE", required=False)
@click.option(
    "--camera",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="The camera, as OpenCV, ROS, Kalibr, COLMAP or `factorlab calibrate camera` write it: for poses.",
)
@click.option("--which", metavar="NAME", help="The camera in that file, where there are several.")
@click.option("--size", metavar="LENGTH", help="Side of the black square: 50mm, 5cm, 0.05m.")
@click.option(
    "--dictionary", metavar="NAME", default="auto", show_default=True,
    help="4x4_50, 6x6_250, aruco_original, apriltag_36h11 …; auto tries every family.",
)  # fmt: skip
@click.option(
    "--track/--no-track", default=None,
    help="Follow markers from frame to frame.  [default: in videos]",
)  # fmt: skip
@as_json
@click.option(
    "-o", "--out", type=click.Path(path_type=Path), metavar="DIR",
    help="Write the report, markers.csv, poses.csv and overlay.png here.",
)  # fmt: skip
@click.option("--force", is_flag=True, help="Write over an earlier report in DIR.")
@check_option
@config_option
@map_options
@recording_options
@in_one_sentence
def markers(source: str | None, **options: Any) -> int:
    """Markers in SOURCE, a picture, a folder or pattern of pictures, or a video.

    Numbers and corners need nothing else; with --camera and --size every marker has a pose: both readings
    that its four corners allow, the covariance of each, and the odds between them. In a video the markers
    are followed, and motion decides what single frames leave open.

    With --map DIR the markers themselves are placed, relative to one of them, and the camera's way with them;
    with --imu also velocity and biases, in a world whose z points up. --demo --map DIR shows it on a
    simulated room.
    """
    if options["map_out"] is not None or options["demo"]:
        from factorlab.cli.marker_map import run_map

        return run_map(source, options)
    if source is None:
        raise click.UsageError("give SOURCE: a picture, a folder or pattern of pictures, or a video")
    only_with_map(options)
    from factorlab.cli.delivery import deliver, require_output
    from factorlab.markers import markers_document, read_markers
    from factorlab.markers.export import marker_files

    require_output(options["out"], None, force=options["force"])
    read = read_markers(source, _settings(options), say=lambda text: click.echo(text, err=True))
    return deliver(
        markers_document(read, command_line()),
        as_json=options["as_json"],
        out=options["out"],
        force=options["force"],
        check=options["check"],
        files=marker_files(read) if options["out"] is not None else None,
    )


def _settings(options: dict[str, Any]) -> Any:
    """What is asked for; lengths and names that mean nothing are the command line's fault."""
    from factorlab.markers import MarkersSettings
    from sequential.errors import FactorlabError
    from vision3d.boards import dictionary_name, metres

    if (options["camera"] is None) != (options["size"] is None):
        given, lacking = ("--size", "--camera") if options["camera"] is None else ("--camera", "--size")
        raise click.UsageError(f"poses need both: {given} goes with {lacking}")
    try:
        size_m = None if options["size"] is None else metres(options["size"], "size of a marker")
    except FactorlabError as error:
        raise click.BadParameter(str(error), param_hint="--size") from error
    try:
        name = options["dictionary"]
        dictionary = name if name == "auto" else dictionary_name(name)
    except FactorlabError as error:
        raise click.BadParameter(str(error), param_hint="--dictionary") from error
    return MarkersSettings(dictionary, options["camera"], options["which"], size_m, options["track"])
