"""Every C filter against its Python model on recordings, and the emulated boards against this computer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from factorlab.firmware.emulation import mpu6050_counts
from factorlab.firmware.parity import Parity, parity, sampled
from factorlab.firmware.targets import TargetParity, every_target
from sequential.sensors import ImuErrors, ImuRecording, simulate_imu, tumble

__all__ = ["Verification", "simulated", "verify"]


@dataclass(frozen=True, slots=True, eq=False)
class Verification:
    """What was compared.

    Parameters
    ----------
    filters : C against Python, a row a filter, recording and number of axes
    targets : emulated boards against this computer
    """

    filters: tuple[Parity, ...]
    targets: tuple[TargetParity, ...]


def verify(
    recordings: Sequence[ImuRecording],
    *,
    samples: int = 2000,
    emulate: bool = True,
    say: Callable[[str], None] | None = None,
) -> Verification:
    """Compare everything on these recordings.

    What runs in fixed point is given a board's 100 samples a second, what runs in single precision the
    recording as it is.

    Parameters
    ----------
    samples : of the first recording, that the emulated boards run on
    emulate : also compare the boards
    say : is told what comes next

    Raises
    ------
    DataError, ToolMissingError
        where a recording lacks a sensor, or the C core is not compiled.
    """
    from factorlab.attitude import available

    told = say or (lambda _: None)
    there = [name for name in available() if name.startswith("c-")]
    rows = []
    for recording in recordings:
        told(f"C against Python on {recording.name}")
        slow = sampled(recording)
        for name in there:
            given = slow if name.endswith("-q") else recording
            axes = (True, False) if recording.mag is not None else (False,)
            rows += [parity(name, given, magnetometer=magnetometer) for magnetometer in axes]
    targets: tuple[TargetParity, ...] = ()
    if emulate:
        told("emulated boards against this computer")
        targets = every_target(mpu6050_counts(recordings[0])[:samples])
    return Verification(tuple(rows), targets)


def simulated() -> ImuRecording:
    """A minute of rest, turns and sways, for whoever has no recording at hand."""
    rng = np.random.default_rng(5)
    errors = ImuErrors(gyro_bias=(0.01, -0.02, 0.015), mag_sigma=0.5, gyro_lsb=1e-3, accel_lsb=2.4e-3)
    return simulate_imu(tumble(60.0, rng, rest=4.0, angle=0.4), rng, errors=errors).recording
