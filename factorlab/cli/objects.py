"""`factorlab objects`: what is in a picture, by colour or by a network."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.faults import in_one_sentence
from factorlab.cli.settings import as_json, check_option, command_line, config_option

if TYPE_CHECKING:
    from factorlab.objects import Found, NetworkSettings
    from vision3d.objects import ColourRange

__all__ = ["objects"]

LAYOUTS = ("yolo", "yolov5", "final", "ssd", "ssd-pair", "mask")
OF_COLOUR = ("sample", "space", "open_px", "close_px")
OF_NETWORK = (
    "layout",
    "names",
    "size",
    "scale",
    "mean",
    "deviation",
    "bgr",
    "stretch",
    "confidence",
    "overlap",
)


@click.command(short_help="Objects in a picture, by colour or network.")
@click.argument("source", metavar="IMAGE", type=click.Path(path_type=Path))
@click.option(
    "--color", "--colour", "colour", metavar="RANGE", help="red, green … or hsv:170-8,110-255,60-255."
)
@click.option("--sample", metavar="L,T,W,H", help="Learn the colour from this box: left, top, width, height.")
@click.option("--space", type=click.Choice(("hsv", "lab")), help="Of the colour learnt.  [default: hsv]")
@click.option(
    "--open", "open_px", type=click.IntRange(1), metavar="PX", help="Remove what is thinner.  [default: 3]"
)
@click.option(
    "--close", "close_px", type=click.IntRange(1), metavar="PX", help="Fill what is narrower.  [default: 5]"
)
@click.option(
    "--min-area", type=click.IntRange(1), default=50, show_default=True, metavar="PX", help="Least pixels."
)
@click.option(
    "--onnx", type=click.Path(path_type=Path), metavar="MODEL", help="A detector, or a map of classes."
)
@click.option("--layout", type=click.Choice(LAYOUTS), help="Family of its outputs.  [default: guessed]")
@click.option(
    "--names", type=click.Path(path_type=Path), metavar="FILE", help="Names of its classes, one a line."
)
@click.option("--size", metavar="WxH", help="Of its input.  [default: as the file says, else 640x640]")
@click.option(
    "--scale", type=click.FloatRange(0, min_open=True), metavar="S", help="Of levels.  [default: 1/255]"
)
@click.option("--mean", metavar="A,B,C", help="Taken off each channel, after scaling.  [default: 0,0,0]")
@click.option("--deviation", metavar="A,B,C", help="Dividing each channel.  [default: 1,1,1]")
@click.option("--bgr", is_flag=True, help="The network wants blue first.")
@click.option("--stretch", is_flag=True, help="Fill its input whatever the picture's shape.")
@click.option("--confidence", type=click.FloatRange(0, 1), metavar="P", help="Least score.  [default: 0.25]")
@click.option(
    "--overlap", type=click.FloatRange(0, 1), metavar="P", help="Of two boxes at most.  [default: 0.45]"
)
@as_json
@click.option(
    "-o", "--out", type=click.Path(path_type=Path), metavar="DIR", help="Write report, table and pictures."
)
@click.option("--force", is_flag=True, help="Write over an earlier report in DIR.")
@check_option
@config_option
@in_one_sentence
def objects(source: Path, colour: str | None, onnx: Path | None, **options: Any) -> int:
    """Objects in IMAGE: of one colour, or of the classes of a network in an ONNX file.

    --color takes a name or a range of hue (0-179, in steps of 2°; 170-8 goes through red), saturation and
    value (0-255); --sample learns one from a piece of the object.  --onnx runs YOLO and SSD detectors and
    maps of classes; what the file says of its size and classes is used.
    """
    from factorlab.cli.delivery import deliver, require_output
    from factorlab.objects import object_files, objects_document
    from vision3d.images import read_image

    _require_one_way(colour, onnx, options)
    require_output(options["out"], None, force=options["force"])
    image = read_image(source, colour=True)
    if onnx is None:
        found = _by_colour(source.name, image, colour, options)
    else:
        from factorlab.objects import by_network

        found = by_network(source.name, image, onnx, _network(options))
    return deliver(
        objects_document(found, command_line()),
        as_json=options["as_json"],
        out=options["out"],
        force=options["force"],
        check=options["check"],
        files=object_files(found) if options["out"] is not None else None,
    )


def _require_one_way(colour: str | None, onnx: Path | None, options: dict[str, Any]) -> None:
    ways = [
        name
        for name, given in (("--color", colour), ("--sample", options["sample"]), ("--onnx", onnx))
        if given
    ]
    if len(ways) != 1:
        what = f"{' and '.join(ways)} contradict each other" if ways else "how shall objects be told?"
        raise click.UsageError(f"{what}; give one of --color RANGE, --sample L,T,W,H and --onnx MODEL")
    for name in OF_COLOUR if onnx is not None else OF_NETWORK:
        if options[name]:
            option = name.removesuffix("_px")
            raise click.UsageError(f"--{option} goes with {'--color' if onnx is not None else '--onnx'}")
    if options["space"] and not options["sample"]:
        raise click.UsageError(
            "--space goes with --sample; a range names its space itself, as in lab:20..80,*,*"
        )


def _by_colour(name: str, image: Any, colour: str | None, options: dict[str, Any]) -> Found:
    from factorlab.objects import by_colour, colour_of
    from sequential.errors import DataError
    from vision3d.objects import learn_colour

    wanted: ColourRange
    if colour is not None:
        try:
            wanted = colour_of(colour)
        except DataError as error:
            raise click.BadParameter(str(error), param_hint="--color") from error
    else:
        box = _numbers(options["sample"], 4, "--sample")
        margin = (5.0, 30.0, 40.0) if options["space"] != "lab" else (20.0, 8.0, 8.0)
        wanted = learn_colour(image, box, space=options["space"] or "hsv", margin=margin)
    return by_colour(
        name, image, wanted, name="sample" if colour is None else "" if ":" in colour else colour,
        least_area=options["min_area"], open_px=options["open_px"] or 3, close_px=options["close_px"] or 5,
    )  # fmt: skip


def _network(options: dict[str, Any]) -> NetworkSettings:
    from factorlab.objects import NetworkSettings
    from vision3d.objects import Preparation

    size = None
    if options["size"]:
        wide, high = _numbers(options["size"].lower().replace("x", ","), 2, "--size")
        size = (int(wide), int(high))
        if min(size) < 1:
            raise click.BadParameter(f"{options['size']}; expected one pixel at least", param_hint="--size")
    means = _numbers(options["mean"] or "0,0,0", 3, "--mean")
    deviations = _numbers(options["deviation"] or "1,1,1", 3, "--deviation")
    names: tuple[str, ...] = ()
    if options["names"] is not None:
        names = _lines(options["names"])
    return NetworkSettings(
        layout=options["layout"],
        names=names,
        preparation=Preparation(
            size=size,
            scale=options["scale"] or 1 / 255,
            mean=(means[0], means[1], means[2]),
            deviation=(deviations[0], deviations[1], deviations[2]),
            rgb=not options["bgr"],
            keep_shape=not options["stretch"],
        ),
        least_score=0.25 if options["confidence"] is None else options["confidence"],
        most_overlap=0.45 if options["overlap"] is None else options["overlap"],
        least_area=options["min_area"],
    )


def _numbers(text: str, count: int, option: str) -> list[float]:
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        found = []
    if len(found) != count:
        raise click.BadParameter(f"{text!r}; expected {count} numbers with commas between", param_hint=option)
    return found


def _lines(path: Path) -> tuple[str, ...]:
    """What stands on the lines of a text file, empty ones left out."""
    from sequential.errors import FileFormatError

    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise FileFormatError(f"{path} is no text in UTF-8 (byte {error.start}); save it as such") from error
    return tuple(line.strip() for line in lines if line.strip())
