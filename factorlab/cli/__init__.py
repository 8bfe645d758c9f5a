"""The command line: one file a command, heavy libraries imported when a command runs.

Exit codes: 0 ok, 1 the data are at fault, 2 the command line is, 3 (only with --check) a check failed.
"""

import click

from factorlab.cli.attitude import attitude
from factorlab.cli.calibrate import calibrate
from factorlab.cli.camera import camera
from factorlab.cli.characterize import characterize
from factorlab.cli.cloud import cloud
from factorlab.cli.compare import compare
from factorlab.cli.demo import demo
from factorlab.cli.doctor import doctor
from factorlab.cli.firmware import firmware
from factorlab.cli.info import info
from factorlab.cli.l19 import l19
from factorlab.cli.line import line
from factorlab.cli.live import live
from factorlab.cli.markers import markers
from factorlab.cli.match import match
from factorlab.cli.objects import objects
from factorlab.cli.record import record
from factorlab.cli.sfm import sfm
from factorlab.cli.sheet import sheet
from factorlab.cli.stereo import stereo
from factorlab.cli.tune import tune
from factorlab.cli.undistort import undistort

__all__ = ["main"]


def show_version(context: click.Context, parameter: click.Parameter, wanted: bool) -> None:
    """Print the version and stop."""
    if wanted:
        from factorlab.versions import version_of

        click.echo(f"factorlab {version_of('factorlab', 'source tree')}")
        context.exit()


@click.group(name="factorlab", context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--version",
    is_flag=True,
    expose_value=False,
    is_eager=True,
    callback=show_version,
    help="Print it.",
)
def main() -> None:
    """From a raw sensor log to a tuned, consistency-checked estimate.

    Start with `factorlab demo`; then give `factorlab compare` a dataset or a log of your own.
    """


for command in (
    demo,
    compare,
    tune,
    characterize,
    calibrate,
    attitude,
    firmware,
    record,
    line,
    live,
    camera,
    undistort,
    stereo,
    markers,
    match,
    objects,
    sfm,
    cloud,
    l19,
    sheet,
    info,
    doctor,
):
    main.add_command(command)
