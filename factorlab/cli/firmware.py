"""`factorlab firmware`: a group whose commands are imported when they are asked for."""

from __future__ import annotations

import click

from factorlab.cli.late import LateGroup

__all__ = ["firmware"]

COMMANDS = {
    "build": ("factorlab.cli.firmware_build", "build", "An image for a board: filter, driver, serial line."),
    "emulate": ("factorlab.cli.firmware_emulate", "emulate", "Run an image on a recording, without a board."),
    "verify": ("factorlab.cli.firmware_verify", "verify", "The C filters against the Python ones."),
}


@click.command(
    cls=LateGroup, table=COMMANDS, short_help="The attitude filter on a board: build, emulate, verify."
)
def firmware() -> None:
    """The attitude filters in C on a Cortex-M4 (single precision) and on an AVR (fixed point).

    The sources are in firmware/; building and emulating take Debian's cross compilers and emulators, and a
    command that misses one says which package brings it.
    """
