"""What the emulated boards do: instructions, cycles, bytes, frames, and the same bits as this computer."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from factorlab.firmware.avr import emulate_avr
from factorlab.firmware.budget import STEPS
from factorlab.firmware.build import build
from factorlab.firmware.cycles import CycleCounts, count_cycles
from factorlab.firmware.emulation import Emulation, mpu6050_counts
from factorlab.firmware.instructions import InstructionCounts, count_instructions, imu_f32, imu_q
from factorlab.firmware.parity import sampled
from factorlab.firmware.targets import target_parity
from sequential.sensors import ImuRecording

__all__ = ["Frames", "agreeing", "avr_cycles", "frames", "instructions"]

START = 20  # frames: the first ones say where the timer began


@dataclass(frozen=True)
class Frames:
    """Timing of an image's frames, microseconds, and losses."""

    jitter: float
    latency: float
    latency_mean: float
    lost: int
    corrupt: int
    count: int


def instructions(module: str, recording: ImuRecording, axes: str) -> InstructionCounts:
    """Every update over a recording at 100 Hz, on the Cortex-M4F; axes as in firmware/budget.csv."""
    given = sampled(recording)
    given = given if axes == "9-D" else replace(given, mag=None)
    samples = imu_q(given) if module.endswith("_q") else imu_f32(given)
    return count_instructions(module, samples, rate=100.0, step=STEPS.get((module, axes)))


def avr_cycles(module: str, recording: ImuRecording) -> CycleCounts:
    """Every update over a recording at 100 Hz, on the ATmega328P."""
    return count_cycles(module, imu_q(replace(sampled(recording), mag=None)))


def frames(recording: ImuRecording, *, mode: str = "q", count: int) -> Frames:
    """Run the AVR image on a recording, again and again up to `count` samples, and time its frames."""
    counts = np.resize(mpu6050_counts(recording), (count, 7))
    with tempfile.TemporaryDirectory() as name:
        emulation = emulate_avr(build("avr", Path(name), filter="mahony_q").path, counts, mode=mode)
    return _timed(emulation)


def _timed(emulation: Emulation) -> Frames:
    latency, jitter = 1e6 * emulation.latency[START:], 1e6 * emulation.jitter[START:]
    return Frames(
        float(np.nanmax(np.abs(jitter))),
        float(np.nanmax(latency)),
        float(np.nanmean(latency)),
        emulation.lost,
        emulation.corrupt,
        len(emulation.frames),
    )


def agreeing(module: str, recordings: list[ImuRecording], count: int) -> dict[str, int]:
    """By target: samples whose frames are those of this computer, bit for bit, of `count`."""
    counts = np.concatenate([mpu6050_counts(one) for one in recordings])[:count]
    found = {}
    for target in ("m4", "avr"):
        one = target_parity(module, target, counts)
        found[target] = len(counts) - (one.differing if one.differing is not None else len(counts))
    return found
