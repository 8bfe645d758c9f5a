"""`factorlab doctor`: whether everything is here that a run needs."""

from __future__ import annotations

import os
import platform
from pathlib import Path

import click

from factorlab.cli.faults import DATA_ERROR, in_one_sentence
from factorlab.cli.settings import as_json, print_json

__all__ = ["doctor"]


@click.command(short_help="Versions, data and browser found on this machine.")
@as_json
@in_one_sentence
def doctor(as_json: bool) -> int:
    """Say what is installed, where the recordings are, and what is missing (exit code 1)."""
    from factorlab.versions import versions

    found = versions()
    missing = [name for name, version in found.items() if version == "missing"]
    places = {"platform": platform.platform(), "cores": str(os.cpu_count()), **_places()}
    if as_json:
        print_json({"schema": 1, "versions": found, "places": places, "missing": missing})
    else:
        for name, value in {**found, **places}.items():
            click.echo(f"{name:<16} {value}")
        if missing:
            click.echo(f"missing: pip install {' '.join(missing)}")
    return DATA_ERROR if missing else 0


def _places() -> dict[str, str]:
    from factorlab.datasets.wheel import gtsam_data
    from sequential.errors import DataError

    try:
        wheel = str(gtsam_data())
    except DataError as error:
        wheel = str(error)
    data = os.environ.get("FACTORLAB_DATA")
    folder = data or "not set: mrclam is not available"
    if data and not Path(data).is_dir():
        folder = f"{data} is not a folder"
    return {"kitti, plaza": wheel, "FACTORLAB_DATA": folder, **_boards(), **_peers()}


def _boards() -> dict[str, str]:
    """What building, emulating and recording from a board take; none of it is needed for anything else."""
    from factorlab.firmware.toolchain import TARGETS, missing_tools
    from factorlab.versions import version_of
    from sequential.firmware import missing

    found = {"C filters": missing() or "compiled"}
    for target in TARGETS:
        lacking = missing_tools(target, emulate=True)
        found[f"firmware {target}"] = (
            f"apt install {' '.join(lacking)}" if lacking else "compiler and emulator"
        )
    port = version_of("pyserial", "")
    return {**found, "serial ports": f"pyserial {port}" if port else "pip install 'factorlab[live]'"}


def _peers() -> dict[str, str]:
    """Packages that some commands can use besides, and what brings them."""
    from factorlab.versions import version_of

    extras = {"open3d": "cloud", "poselib": "poselib"}
    return {name: version_of(name, f"pip install 'factorlab[{extra}]'") for name, extra in extras.items()}
