"""`factorlab stereo depth`: how far everything is, from two pictures."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.faults import in_one_sentence
from factorlab.cli.settings import Command, as_json, check_option, command_line, config_option, with_options

if TYPE_CHECKING:
    from factorlab.stereo.depth_job import DepthSettings
    from factorlab.stereo.depth_pairs import StereoPair

__all__ = ["depth"]

MATCHERS = ("semi-global", "sgbm", "sgbm-3way", "sgbm-hh", "bm")
FILE = click.Path(dir_okay=False, path_type=Path)


class Pixels(click.ParamType[int | None]):
    """A whole number of pixels, or `auto`."""

    name = "px"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int | None:
        """The number; None for `auto`."""
        if value in (None, "auto"):
            return None
        try:
            return int(value)
        except ValueError:
            self.fail(f"{value!r} is neither a whole number of pixels nor auto", param, ctx)


OPTIONS = (
    click.argument("left", metavar="[LEFT]", required=False),
    click.argument("right", metavar="[RIGHT]", required=False),
    click.option("--calib", type=click.Path(path_type=Path), metavar="FILE",
                 help="The rig: our JSON, Middlebury's calib.txt, OpenCV, Kalibr or ROS; without it there is "
                      "disparity, but no depth."),
    click.option("--rectified", is_flag=True, help="The pictures have been rectified with that rig already."),
    click.option("--demo", is_flag=True,
                 help="Middlebury's motorcycle, which scikit-image carries; a rendered room without it."),
    click.option("--matcher", type=click.Choice(MATCHERS), default="semi-global", show_default=True,
                 help="semi-global is ours, the others are OpenCV's."),
    click.option("--max-disparity", type=Pixels(), metavar="PX", help="Largest disparity.  [default: auto]"),
    click.option("--min-disparity", type=Pixels(), metavar="PX", help="Smallest disparity.  [default: auto]"),
    click.option("--paths", type=click.Choice(("4", "8")), default="8", show_default=True,
                 help="Directions along which costs are summed; 4 takes half the time."),
    click.option("--fill/--no-fill", default=True, show_default=True,
                 help="Give pixels without a match the disparity of what lies behind."),
    click.option("--most", "most_m", type=click.FloatRange(min=0, min_open=True), metavar="M",
                 help="Leave out of the cloud what is farther."),
    click.option("--ground/--no-ground", default=True, show_default=True, help="Look for planes."),
    click.option("--truth", type=FILE, metavar="FILE",
                 help="A true disparity to compare with: .npy, .npz, .pfm or .png, 0 where unknown."),
    click.option("--truth-scale", type=click.FloatRange(min=0, min_open=True), default=1.0, metavar="N",
                 help="Numbers of that file a pixel: 256 for KITTI's PNG."),
    as_json,
    click.option("-o", "--out", type=click.Path(path_type=Path), metavar="DIR",
                 help="Write the report, disparity, depth and cloud.ply here."),
    click.option("--force", is_flag=True, help="Write over an earlier report in DIR."),
    check_option,
    config_option,
)  # fmt: skip


def depth_options(command: Command) -> Command:
    """Arguments and options of the command."""
    return with_options(command, OPTIONS)


@click.command(short_help="Disparity, depth and a cloud of points from two pictures.")
@depth_options
@in_one_sentence
def depth(left: str | None, right: str | None, **options: Any) -> int:
    """Disparity, depth with its standard deviation, a cloud and the ground, from the pictures LEFT and RIGHT.

    With --calib the pictures are rectified first, unless they are already: Middlebury's calib.txt says so
    itself, --rectified says it of others.  Without --calib they must be rectified, and there is no depth.
    """
    from factorlab.cli.delivery import deliver, require_output
    from factorlab.cli.progress import bar
    from factorlab.stereo.depth_document import depth_document
    from factorlab.stereo.depth_files import depth_files
    from factorlab.stereo.depth_job import measure_depth

    out = options["out"]
    require_output(out, None, force=options["force"])
    settings, pair = _settings(options), _pair(left, right, options)
    with bar("depth", shown=sys.stderr.isatty()) as progress:
        run = measure_depth(pair, settings, progress)
    return deliver(
        depth_document(run, command_line()),
        as_json=options["as_json"],
        out=out,
        force=options["force"],
        check=options["check"],
        files=depth_files(run) if out is not None else None,
    )


def _pair(left: str | None, right: str | None, options: dict[str, Any]) -> StereoPair:
    """The pictures that are asked for; what contradicts itself is the command line's fault."""
    from factorlab.stereo.depth_pairs import demo_pair, pair_from_files

    if options["demo"]:
        for given, name in ((left, "LEFT"), (options["calib"], "--calib"), (options["truth"], "--truth")):
            if given is not None:
                raise click.UsageError(f"--demo brings pictures, calibration and truth; leave out {name}")
        return demo_pair()
    if left is None or right is None:
        raise click.UsageError("give two pictures, LEFT and RIGHT, or --demo")
    if options["rectified"] and options["calib"] is None:
        raise click.UsageError("--rectified goes with --calib; without it pictures must be rectified")
    return pair_from_files(left, right, options["calib"], options["truth"], options["truth_scale"])


def _settings(options: dict[str, Any]) -> DepthSettings:
    from factorlab.stereo.depth_job import DepthSettings
    from sequential.errors import FactorlabError
    from vision3d.stereo import StereoSettings

    try:
        stereo = StereoSettings(
            matcher=options["matcher"], least_px=options["min_disparity"], most_px=options["max_disparity"],
            paths=8 if options["paths"] == "8" else 4, fill=options["fill"],
        )  # fmt: skip
    except FactorlabError as error:
        raise click.UsageError(str(error)) from error
    most = options["most_m"] if options["most_m"] is not None else float("inf")
    return DepthSettings(stereo, options["rectified"], most, options["ground"])
