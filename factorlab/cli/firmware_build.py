"""`factorlab firmware build`: an image for a board."""

from __future__ import annotations

import shlex
from pathlib import Path

import click

from factorlab.cli.faults import in_one_sentence
from factorlab.cli.settings import as_json, config_option, print_json

__all__ = ["build"]


@click.command(short_help="An image for a board.")
@click.option(
    "--target", type=click.Choice(["m4", "avr"]), required=True, help="Cortex-M4F, or ATmega328P at 16 MHz."
)
@click.option(
    "--board",
    type=click.Choice(["qemu", "stm32f4", "atmega328p"]),
    help="For m4: qemu (the emulator) or stm32f4.  [default: qemu]",
)
@click.option(
    "--filter", "name", metavar="NAME", help="mahony_f32, mahony_q …  [default: mahony_f32; avr: mahony_q]"
)
@click.option(
    "--constants",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="CALIB.json",
    help="Calibration to compile in, from `factorlab calibrate`.  [default: the data sheet's gains]",
)
@click.option(
    "-o", "--out", type=click.Path(file_okay=False, path_type=Path), metavar="DIR",
    help="Folder of the image.  [default: build/firmware/TARGET-FILTER]",
)  # fmt: skip
@as_json
@config_option
@in_one_sentence
def build(
    target: str, board: str | None, name: str | None, constants: Path | None, out: Path | None, as_json: bool
) -> int:
    """Build firmware.elf: the sensor's driver, one filter, the serial line.

    The image says in its boot frame which filter and which calibration it holds.  To flash: `make flash` in
    firmware/ports/avr or firmware/ports/cortex_m4 (README.md there has the wiring).
    """
    from factorlab.firmware.build import DEFAULT_FILTER, FLASH
    from factorlab.firmware.build import build as build_image
    from sequential.sensors import ImuCalibration

    calibration = None if constants is None else ImuCalibration.load(constants)
    folder = out or Path("build", "firmware", f"{target}-{name or DEFAULT_FILTER[target]}")
    made = build_image(target, folder, filter=name, board=board, calibration=calibration)
    flash, ram = FLASH[made.board]
    if as_json:
        sizes = {name: getattr(made, name) for name in ("text", "data", "bss", "flash", "ram")}
        said = {name: getattr(made, name) for name in ("target", "board", "filter")}
        paths = {"image": str(made.path), "map": str(made.map)}
        named = None if constants is None else str(constants)
        print_json({"schema": 1, **paths, **said, "calibration": named, "bytes": sizes})
        return 0
    click.echo(f"image   {made.path}")
    click.echo(f"filter  {made.filter} for {made.board}")
    click.echo(f"flash   {made.flash} B of {flash} ({made.flash / flash:.1%})")
    click.echo(f"RAM     {made.ram} B of {ram} ({made.ram / ram:.1%}), without the stack")
    if made.board != "qemu":
        click.echo(f"write   {shlex.join([*made.make, 'flash'])}")
    return 0
