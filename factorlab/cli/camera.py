"""`factorlab camera`: what a calibration file says, and the same for another program."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.faults import CHECK_FAILED, in_one_sentence
from factorlab.cli.settings import as_json, config_option, print_json

if TYPE_CHECKING:
    from vision3d.camera import Camera
    from vision3d.camera_summary import CameraSummary

__all__ = ["camera", "tell_cameras"]

FORMATS = ("json", "opencv", "ros", "kalibr", "colmap")


@click.command(short_help="What a camera file says; convert it.")
@click.argument("source", metavar="FILE", type=click.Path(dir_okay=False, path_type=Path))
@click.option("--which", metavar="NAME", help="Camera of a file that has several: left, cam1, 2 …")
@click.option("--size", metavar="WxH", help="Of the images, where the file does not say it: 640x480.")
@click.option(
    "--to",
    "target",
    type=click.Choice(FORMATS),
    help="Format of -o.  [default: by its name]",
)
@click.option(
    "-o",
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write the camera here: .json, .yml OpenCV, .yaml ROS, camchain.yaml Kalibr, .txt COLMAP.",
)
@click.option("--force", is_flag=True, help="Write over an earlier file.")
@click.option("--check", is_flag=True, help="Exit with 3 when the distortion folds inside the image.")
@as_json
@config_option
@in_one_sentence
def camera(source: Path, **options: Any) -> int:
    """Describe the camera in FILE, and write it for another program.

    FILE is of factorlab, OpenCV, ROS, Kalibr, COLMAP or ORB-SLAM: the command finds out.  It tells angles of
    view, how far the distortion bends, and whether it folds inside the image.
    """
    from sequential.errors import DataError
    from vision3d.camera_files import read_camera, read_cameras, write_camera

    size, which, out = _size(options["size"]), options["which"], options["out"]
    if out is None and which is None:
        found = read_cameras(source, size=size)
    else:
        found = {which or "camera": read_camera(source, which=which, size=size)}
    if out is not None:
        if out.exists() and not options["force"]:
            raise DataError(f"{out} is there already; choose another name, or use --force")
        write_camera(next(iter(found.values())), out, options["target"])
    bad = tell_cameras(found, as_json=options["as_json"])
    if out is not None:
        click.echo(f"written: {out}", err=options["as_json"])
    return CHECK_FAILED if options["check"] and bad else 0


def tell_cameras(cameras: dict[str, Camera], *, as_json: bool) -> bool:
    """Print what cameras are like; whether the distortion of one folds inside its image."""
    from vision3d.camera_summary import summarise

    found = {name: summarise(one) for name, one in cameras.items()}
    if as_json:
        print_json({"schema": 1, "cameras": {name: _record(name, one) for name, one in found.items()}})
    else:
        for name, one in found.items():
            title, *rest = one.lines()
            click.echo(f"{name}: {title}" if len(found) > 1 else title)
            for line in rest:
                click.echo(f"  {line}")
    return any(one.fold.inside for one in found.values())


def _record(name: str, one: CameraSummary) -> dict[str, Any]:
    import math

    from vision3d.camera_files import formats_for
    from vision3d.camera_files.own_json import camera_record

    def number(value: float) -> float | None:
        return float(value) if math.isfinite(value) else None

    return camera_record(one.camera, name) | {
        "view_deg": {
            side: number(math.degrees(getattr(one, f"{side}_rad"))) for side in ("across", "down", "corner")
        },
        "pixel_deg": number(math.degrees(one.pixel_rad)),
        "off_centre_px": one.off_centre_px.tolist(),
        "bend_px": number(one.bend_px),
        "fold": {
            "inside": one.fold.inside,
            "radius_px": number(one.fold.radius_px),
            "lost": one.fold.lost,
            "text": str(one.fold),
        },
        "formats": [form.name for form in formats_for(one.camera)],
    }


def _size(text: str | None) -> tuple[int, int] | None:
    import re

    if text is None:
        return None
    if (found := re.fullmatch(r"(\d+)\s*[x×,]\s*(\d+)", text.strip().lower())) is None:
        raise click.BadParameter(
            f"{text!r} is no size; write WIDTHxHEIGHT, as in 640x480", param_hint="--size"
        )
    return int(found[1]), int(found[2])
