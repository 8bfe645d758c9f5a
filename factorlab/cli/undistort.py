"""`factorlab undistort`: pictures and videos without the distortion of their lens."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.faults import CHECK_FAILED, in_one_sentence
from factorlab.cli.settings import as_json, command_line, config_option, print_json

if TYPE_CHECKING:
    from vision3d.camera import Camera
    from vision3d.undistort import Undistorter
    from vision3d.undistort_files import Undistorted

__all__ = ["undistort"]


@click.command(short_help="Pictures and videos without lens distortion.")
@click.argument("sources", metavar="IMAGES...", nargs=-1, required=True)
@click.option(
    "--camera",
    "camera_file",
    type=click.Path(dir_okay=False, path_type=Path),
    required=True,
    metavar="FILE",
    help="Calibration: of factorlab, OpenCV, ROS, Kalibr or COLMAP.",
)
@click.option("--which", metavar="NAME", help="Camera of a file that has several: left, cam1, 2 …")
@click.option(
    "--view",
    type=click.Choice(("inside", "all", "same")),
    default="inside",
    show_default=True,
    help="No black border; every pixel; or the same focal length.",
)
@click.option(
    "-o",
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    required=True,
    metavar="DIR",
    help="Write pictures and the camera they are of here.",
)
@click.option("--force", is_flag=True, help="Write over earlier results in DIR.")
@click.option("--check", is_flag=True, help="Exit with 3 when the distortion folds inside the image.")
@as_json
@config_option
@in_one_sentence
def undistort(sources: tuple[str, ...], **options: Any) -> int:
    """Undistort IMAGES: files, folders, patterns (left*.jpg) or videos.

    Pictures are written as PNG, videos as AVI, under their own names; beside them stands the pinhole camera
    that they are pictures of, in every format, for programs that know no distortion.
    """
    import sys

    from factorlab.cli.progress import bar
    from factorlab.report.folder import MANIFEST, require_free, whole_folder
    from vision3d.camera_files import formats_for
    from vision3d.images import image_paths
    from vision3d.undistort import Undistorter
    from vision3d.undistort_files import undistort_files

    out = options["out"]
    require_free(out, force=options["force"])
    paths = image_paths(sources)
    camera = _camera(options["camera_file"], options["which"], paths)
    undistorter = Undistorter.of(camera, view=options["view"])
    with (
        whole_folder(out, force=options["force"]) as folder,
        bar("undistort", shown=sys.stderr.isatty()) as progress,
    ):
        done = undistort_files(undistorter, paths, folder, progress=progress)
        cameras = {
            one.file_name: one.text(undistorter.target, "camera") for one in formats_for(undistorter.target)
        }
        document = _document(undistorter, options["view"], done, tuple(cameras))
        for name, text in (cameras | {MANIFEST: _json(document)}).items():
            (folder / name).write_text(text, encoding="utf-8")
    if options["as_json"]:
        print_json(document)
    else:
        _show(undistorter, done, out)
    for left in done.left_out:
        click.echo(f"left out: {left}", err=True)
    fold = camera.check_monotonic()
    if fold.inside:
        click.echo(f"warning: {fold}", err=True)
    return CHECK_FAILED if options["check"] and fold.inside else 0


def _camera(path: Path, which: str | None, paths: list[Path]) -> Camera:
    """The calibration; where the file does not say the size of its images, that of the first source."""
    from sequential.errors import FileFormatError
    from vision3d.camera_files import read_camera
    from vision3d.frames import open_frames

    try:
        return read_camera(path, which=which)
    except FileFormatError as error:
        if "how large its images are" not in str(error):
            raise
    with open_frames(paths[0]) as frames:
        return read_camera(path, which=which, size=frames.size)


def _document(
    undistorter: Undistorter, view: str, done: Undistorted, cameras: tuple[str, ...]
) -> dict[str, Any]:
    """What --json prints and report.json holds."""
    from vision3d.camera_files.own_json import camera_record

    fold = undistorter.camera.check_monotonic()
    return {
        "format": "factorlab undistortion",
        "command": command_line(),
        "view": view,
        "camera": camera_record(undistorter.camera),
        "undistorted_camera": camera_record(undistorter.target),
        "seen": float(undistorter.seen.mean()),
        "fold": {"inside": fold.inside, "lost": fold.lost, "text": str(fold)},
        "images": [{"source": source, "file": name} for source, name in done.written],
        "left_out": [{"source": left.name, "reason": left.reason} for left in done.left_out],
        "files": [*(name for _, name in done.written), *cameras],
    }


def _json(document: dict[str, Any]) -> str:
    import json

    return json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _show(undistorter: Undistorter, done: Undistorted, out: Path) -> None:
    count, lens = len(done.written), undistorter.camera.lens
    click.echo(f"undistorted {count} file{'s' if count != 1 else ''} ({lens}) into {out}")
    width, height = undistorter.target.size
    values = "  ".join(
        f"{name} {value:.2f}"
        for name, value in zip(undistorter.target.names, undistorter.target.parameters, strict=True)
    )
    click.echo(f"they are of a pinhole camera of {width}x{height} px: {values}")
    black = 100.0 * (1.0 - undistorter.seen.mean())
    if black > 0.05:
        click.echo(f"{black:.1f} % of each is black: the camera did not see it")
