"""`factorlab calibrate`: a group whose commands are imported when they are asked for."""

from __future__ import annotations

import click

from factorlab.cli.late import LateGroup

__all__ = ["calibrate"]

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
    "camera": (
        "factorlab.cli.calibrate_camera",
        "camera",
        "Camera, from pictures of a checkerboard, ChArUco or circles.",
    ),
    "stereo": (
        "factorlab.cli.calibrate_stereo",
        "stereo",
        "Two cameras and their pose, from pairs of pictures of a board.",
    ),
    "cam-imu": (
        "factorlab.cli.calibrate_cam_imu",
        "cam_imu",
        "Camera and IMU on one rig: rotation, translation, time offset, biases.",
    ),
    "ferraris": ("factorlab.cli.calibrate_field", "ferraris", "Six positions and three known turns."),
}


@click.command(
    cls=LateGroup,
    table=COMMANDS,
    short_help="Constants of a sensor from a recording, with intervals and export.",
)
def calibrate() -> None:
    """Find a sensor's constants: gain, offset, misalignment, with 95 % intervals.

    Each command prints verdicts, checks itself on parts that it left out, and with -o writes a report,
    calibration.json, calibration.h for a microcontroller and Kalibr's YAML.
    """
