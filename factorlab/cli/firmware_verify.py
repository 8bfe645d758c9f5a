"""`factorlab firmware verify`: the C filters against the Python ones, the boards against this computer."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from factorlab.cli.faults import in_one_sentence
from factorlab.cli.recording import opened, recording_options
from factorlab.cli.settings import as_json, check_option, command_line, config_option

__all__ = ["verify"]


@click.command(short_help="The C filters against the Python ones.")
@click.argument("sources", metavar="[LOG]...", nargs=-1)
@click.option("--no-emulation", is_flag=True, help="Compare with Python only; takes no cross compiler.")
@click.option(
    "--samples",
    type=click.IntRange(min=10),
    default=2000,
    show_default=True,
    help="Of the first LOG, that emulated boards run on.",
)
@recording_options
@as_json
@click.option("-o", "--out", type=click.Path(path_type=Path), metavar="DIR", help="Write the report here.")
@click.option("--force", is_flag=True, help="Write over an earlier report in DIR.")
@check_option
@config_option
@in_one_sentence
def verify(sources: tuple[str, ...], **options: Any) -> int:
    """Hold every C filter to its Python model, and the emulated boards to this computer.

    Single precision: one step from an equal state to 1e-6, and whole recordings.  Fixed point: 0.1° root mean
    square, 0.3° at most, and the same bits on Cortex-M4 and AVR.  Without a LOG a simulated minute is used.
    """
    from factorlab.cli.delivery import deliver
    from factorlab.firmware import verify as comparing
    from factorlab.firmware.budget import memory_table
    from factorlab.firmware.verify_page import verification_document

    given = {key: options[key] for key in ("kind", "units", "columns", "rate")}
    recordings = [opened(one, only=("accel", "gyro"), **given)[0].recording for one in sources]
    found = comparing.verify(
        recordings or [comparing.simulated()],
        samples=options["samples"],
        emulate=not options["no_emulation"],
        say=lambda text: click.echo(text, err=True),
    )
    document = verification_document(found, memory=memory_table(), command=command_line())
    return deliver(document, **{key: options[key] for key in ("as_json", "out", "force", "check")})
