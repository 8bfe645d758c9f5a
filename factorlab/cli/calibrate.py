"""`factorlab calibrate`: a group whose commands are imported when they are asked for."""

from __future__ import annotations

from importlib import import_module

import click

__all__ = ["calibrate"]

# command: module and attribute, and the line of `calibrate --help`, which so costs no import
COMMANDS = {
    "accel": (
        "factorlab.cli.calibrate_imu",
        "accel",
        "Accelerometer, from many positions or from six.",
    ),
    "gyro": ("factorlab.cli.calibrate_imu", "gyro", "Gyro: bias at rest, scale from turns of known angle."),
    "imu": ("factorlab.cli.calibrate_imu", "imu", "Both, from one multi-position recording."),
    "mag": ("factorlab.cli.calibrate_field", "mag", "Magnetometer, from turns in every direction."),
    "range": ("factorlab.cli.calibrate_field", "range_sensor", "Distance sensor v = a/(d+b)+c."),
    "ferraris": ("factorlab.cli.calibrate_field", "ferraris", "Six positions and three known turns."),
}


class LateGroup(click.Group):
    """A group that imports a command when it runs, or when its own help is shown."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order of the table."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command itself; None where there is none of that name."""
        if cmd_name not in COMMANDS:
            return None
        module, attribute, _ = COMMANDS[cmd_name]
        command: click.Command = getattr(import_module(module), attribute)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The list of `--help`, without importing what it names."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, line) for name, (_, _, line) in COMMANDS.items()])


@click.command(cls=LateGroup, short_help="Constants of a sensor from a recording, with intervals and export.")
def calibrate() -> None:
    """Find a sensor's constants: gain, offset, misalignment, with 95 % intervals.

    Each command prints verdicts, checks itself on parts that it left out, and with -o writes a report,
    calibration.json, calibration.h for a microcontroller and Kalibr's YAML.
    """
