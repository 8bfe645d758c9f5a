"""`factorlab firmware emulate`: an image run on a recording, without a board."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from factorlab.cli.faults import in_one_sentence
from factorlab.cli.recording import opened, recording_options
from factorlab.cli.settings import as_json, check_option, command_line, config_option

__all__ = ["emulate"]


@click.command(short_help="Run an image on a recording, without a board.")
@click.argument("source", metavar="LOG")
@click.option(
    "--target",
    type=click.Choice(["m4", "avr"]),
    required=True,
    help="Cortex-M4F (QEMU), or ATmega328P (simavr).",
)
@click.option(
    "--filter", "name", metavar="NAME", help="mahony_f32, mahony_q …  [default: mahony_f32; avr: mahony_q]"
)
@click.option(
    "--mode",
    type=click.Choice(["quaternion", "angles", "text"]),
    default="quaternion",
    show_default=True,
    help="What the board sends.",
)
@click.option(
    "--constants",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="CALIB.json",
    help="Calibration to compile in; LOG then holds readings as the sensor gave them.",
)
@click.option("--seconds", type=click.FloatRange(min=1), metavar="S", help="Only the beginning of LOG.")
@recording_options
@as_json
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Write the report, orientation.csv, orientation.tum, timing.csv and the board's bytes here.",
)
@click.option("--force", is_flag=True, help="Write over an earlier report in DIR.")
@check_option
@config_option
@in_one_sentence
def emulate(source: str, target: str, **options: Any) -> int:
    """Run firmware on LOG as if its MPU-6050 had read it: trajectory, cycles, latency, jitter, losses.

    The image that a board would carry runs whole: driver, filter, serial line.  On the AVR every cycle is
    counted; QEMU counts the Cortex-M4's instructions.  LOG is a file, or a recording such as broad:07.
    """
    from factorlab.attitude import Reference
    from factorlab.cli.delivery import deliver
    from factorlab.firmware.trial import run_trial
    from factorlab.firmware.trial_page import trial_document
    from sequential.sensors import ImuCalibration

    given = {key: options[key] for key in ("kind", "units", "columns", "rate")}
    found, _ = opened(source, only=("accel", "gyro"), **given)
    recording, constants, truth = found.recording, options["constants"], None
    if found.truth is not None:
        truth = Reference(found.truth.world_q_body, found.truth.movement)
    if options["seconds"] is not None:
        recording = recording.slice(0.0, options["seconds"])
        if truth is not None:
            truth = Reference(truth.world_q_body[: len(recording)], truth.where[: len(recording)])
    trial = run_trial(
        recording,
        target,
        filter=options["name"],
        mode=options["mode"][0],
        calibration=None if constants is None else ImuCalibration.load(constants),
        truth=truth,
    )
    document = trial_document(trial, recording.name, command=command_line())
    chosen = {key: options[key] for key in ("as_json", "out", "force", "check")}
    return deliver(document, files=_files(trial) if options["out"] else {}, **chosen)


def _files(trial: Any) -> dict[str, str | bytes]:
    """Orientation, timing and bytes."""
    import io

    import numpy as np

    from factorlab.attitude import orientation_csv, orientation_tum

    one = trial.emulation
    columns = [one.sample_s, one.first_byte_s, 1e6 * one.latency, one.update_cycles]
    text = io.StringIO()
    header = "sample_s,first_byte_s,latency_us,update_cycles"
    np.savetxt(text, np.column_stack(columns), fmt="%.9g", delimiter=",", header=header, comments="")
    return {
        "orientation.csv": orientation_csv(trial.board),
        "orientation.tum": orientation_tum(trial.board),
        "timing.csv": text.getvalue(),
        "serial.bin": one.data,
    }
