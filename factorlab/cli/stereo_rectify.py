"""`factorlab stereo rectify`: pairs of pictures in which a point keeps its row."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.faults import CHECK_FAILED, in_one_sentence
from factorlab.cli.settings import Command, as_json, check_option, command_line, config_option, with_options

if TYPE_CHECKING:
    from vision3d.stereo.rig import StereoRig

__all__ = ["read_rig_of", "rectify"]

FOLDER = click.Path(file_okay=False, path_type=Path)
UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}

OPTIONS: tuple[Callable[[Command], Command], ...] = (
    click.argument("sources", metavar="LEFT RIGHT", nargs=-1, required=True),
    click.option("--calib", "calibration", type=click.Path(path_type=Path), required=True, metavar="FILE",
                 help="The rig: of factorlab, OpenCV, Kalibr, ROS or Middlebury; or a folder with one."),
    click.option("--unit", type=click.Choice(tuple(UNITS)), default="m", show_default=True,
                 help="Unit of the translation in a file of OpenCV or Kalibr."),
    click.option("--alpha", type=click.FloatRange(0.0, 1.0), default=0.0, show_default=True,
                 help="0 shows no black, 1 every pixel of both cameras."),
    click.option("--size", metavar="WxH", help="Of the rectified images.  [default: as the left ones]"),
    click.option("--method", type=click.Choice(("bouguet", "fusiello")), default="bouguet", show_default=True,
                 help="Both cameras turn by half, or the left one keeps its view."),
    click.option("--own-centres", is_flag=True,
                 help="Give each image its own principal point: shows more of near things (doffs is not 0)."),
    click.option("--anaglyph", "with_anaglyph", is_flag=True,
                 help="Write pictures for red and cyan glasses too."),
    as_json,
    click.option("-o", "--out", type=FOLDER, required=True, metavar="DIR",
                 help="Write left/, right/, rows/, the rectified rig and a report here."),
    click.option("--force", is_flag=True, help="Write over earlier results in DIR."),
    check_option,
    config_option,
)  # fmt: skip


def rectify_options(command: Command) -> Command:
    """Argument and options of the command."""
    return with_options(command, OPTIONS)


@click.command(short_help="Pairs of pictures as parallel cameras would have taken them.")
@rectify_options
@in_one_sentence
def rectify(sources: tuple[str, ...], **options: Any) -> int:
    """Rectify pairs of pictures: what is in a row of the left one is in the same row of the right one.

    LEFT and RIGHT are two pictures, quoted patterns or folders, paired by name, by number or in order.
    Features matched in the results measure how well rows agree: a calibration that does not fit is told.
    """
    from factorlab.cli.delivery import show
    from factorlab.cli.progress import bar
    from factorlab.report.document import fill_folder
    from factorlab.report.folder import require_free, whole_folder
    from factorlab.stereo.pairing import pair_names, split_sides
    from factorlab.stereo.rectified_document import RectifyJob, rectified_document, rectified_files
    from sequential.errors import DataError
    from vision3d.images import image_paths
    from vision3d.stereo import rectify as rectification_of
    from vision3d.stereo.rectify_files import rectify_files

    out = options["out"]
    require_free(out, force=options["force"])
    if len(sources) < 2:
        raise click.UsageError("LEFT and RIGHT are two pictures, patterns or folders; only one was given")
    left, right = (image_paths(one) for one in split_sides(sources))
    pairing = pair_names([path.name for path in left], [path.name for path in right])
    if not pairing.pairs:
        raise DataError("no left picture has a right one")
    pairs = [(left[i], right[j]) for i, j in pairing.pairs]
    rig = read_rig_of(
        options["calibration"], _size_of_first([one for one, _ in pairs]), UNITS[options["unit"]]
    )
    pair = rectification_of(
        rig, alpha=options["alpha"], size=_size(options["size"]) or rig.left.size, method=options["method"],
        zero_disparity=not options["own_centres"],
    )  # fmt: skip
    with whole_folder(out, force=options["force"]) as folder:
        with bar("rectify", shown=sys.stderr.isatty()) as progress:
            done = rectify_files(
                pair, pairs, folder, with_anaglyph=options["with_anaglyph"], progress=progress
            )
        job = RectifyJob(pair, done, options["calibration"], folder)
        document = rectified_document(job, command_line())
        fill_folder(document, folder, rectified_files(job))
    for one in done.left_out:
        click.echo(f"left out: {one}", err=True)
    for side, alone, paths in (("right", pairing.left_alone, left), ("left", pairing.right_alone, right)):
        for k in alone:
            click.echo(f"left out: {paths[k].name}: there is no {side} picture to it", err=True)
    show(document, as_json=options["as_json"])
    click.echo(f"report: {out / 'report.html'}", err=options["as_json"])
    return CHECK_FAILED if options["check"] and document.failed else 0


def read_rig_of(path: Path, size: tuple[int, int], unit_m: float) -> StereoRig:
    """The rig of a file; where that does not say the size of its images, that of the pictures.

    Raises
    ------
    DataError
        where it cannot be read, or is of another size than the pictures and of another shape.
    """
    from sequential.errors import DataError
    from vision3d.stereo import read_rig

    rig = read_rig(path, size=size, unit_m=unit_m)
    if rig.left.size == size:
        return rig
    ratios = size[0] / rig.left.size[0], size[1] / rig.left.size[1]
    calibrated, given = (f"{width}x{height} px" for width, height in (rig.left.size, size))
    if abs(ratios[0] / ratios[1] - 1.0) > 0.01 or rig.left.size != rig.right.size:
        raise DataError(
            f"{path} is of images of {calibrated}, and the pictures have {given}; they were cut, or are "
            "another camera's: use pictures as they were calibrated"
        )
    click.echo(f"{path} is of images of {calibrated} and the pictures have {given}: it is scaled", err=True)
    return rig.resized(size)


def _size_of_first(paths: list[Path]) -> tuple[int, int]:
    """(width, height) of the first picture that can be read."""
    from sequential.errors import DataError
    from vision3d.images import read_image

    faults = []
    for path in paths:
        try:
            height, width = read_image(path).shape
        except DataError as error:
            faults.append(error)
        else:
            return width, height
    raise faults[0]


def _size(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(part.strip().isdigit() and int(part) > 0 for part in parts):
        raise click.BadParameter(f"{text} is no size; write it as 640x480", param_hint="--size")
    return int(parts[0]), int(parts[1])
