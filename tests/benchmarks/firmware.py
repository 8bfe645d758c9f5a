"""The firmware against its bars: instructions, cycles, bytes, errors, frames, speed, a day of samples.

`python firmware.py [--json] [--quick]`; --quick takes 20 000 samples where 100 000 are compared, and an hour
for the day.  Needs FACTORLAB_DATA (BROAD), the cross compilers and the emulators.  The figures of the
Cortex-M4 are instructions (QEMU), those of the AVR cycles (simavr); both run at 100 samples a second.  Ends
with exit code 3 when a must is missed.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from measure.figures import Figure, publish, say
from measure.firmware_boards import agreeing, avr_cycles, frames, instructions
from measure.firmware_host import DAY, SOAKED, soak, speeds

from factorlab.firmware.parity import parity, sampled
from factorlab.firmware.sizes import module_sizes
from factorlab.firmware.toolchain import missing_tools
from sequential.attitude import ErrorStateAttitude
from sequential.evaluate import attitude_error
from sequential.firmware import CErrorState
from sequential.readers import read_broad
from sequential.readers.broad import BroadTruth
from sequential.sensors import ImuRecording

QUICK = "--quick" in sys.argv[1:]
AXES = {"6d": "6-D", "6d_all": "6-D", "9d": "9-D"}
Trial = tuple[ImuRecording, BroadTruth]
Figures = dict[str, Figure]


def trials() -> list[Trial]:
    """All of BROAD that is there."""
    folder = Path(os.environ.get("FACTORLAB_DATA", "")) / "imu" / "broad"
    files = sorted(folder.glob("*.npz"))
    if not files:
        sys.exit(f"no trial of BROAD in {folder}: set FACTORLAB_DATA to the folder of the recordings")
    return [read_broad(path) for path in files]


def on_m4(every: list[Trial]) -> Figures:
    """Instructions of the float filters, over the fast rotation of trial 07."""
    recording = next(one for one, _ in every if one.name.startswith("07")).slice(0.0, 90.0)
    found: Figures = {}
    bars = {
        "mahony": {"6d": (140, 110), "9d": (300, 250), "6d_all": (None, None)},
        "error_state": {"9d": (3000, 1500), "6d": (None, None)},
    }
    said = {
        "mahony": {
            "6d": "own 108; both as published",
            "9d": "x-io Fusion 278; both with rejection and rest bias",
            "6d_all": "with rest bias and the limit on the error",
        },
        "error_state": {"9d": "VQF 20 835", "6d": ""},
    }
    for name, rows in bars.items():
        for axes, (must, aim) in rows.items():
            as_published = (name, axes) == ("mahony", "6d")
            meant = AXES[axes] + (" as published" if as_published else "")
            counts = instructions(f"{name}_f32", recording, meant)
            found[f"m4_{name}_{axes}"] = Figure(counts.mean, "instr.", said[name][axes], must, aim)
            found[f"m4_{name}_{axes}_worst"] = Figure(counts.worst, "instr.", "the longest update")
    size = module_sizes("error_state_f32", "m4")
    found["m4_error_state_text"] = Figure(size.text, "B", "VQF 10 200", 6144, 4096)
    found["m4_error_state_state"] = Figure(size.state, "B", "VQF 856", None, 300)
    found["m4_error_state_stack"] = Figure(size.stack, "B", " > ".join(size.path))
    return found


def error_state_errors(every: list[Trial]) -> Figures:
    """Single against double precision on every trial, and what it costs against the truth."""
    apart, worse = {}, {}
    for recording, truth in every:
        single, double = CErrorState().estimate(recording), ErrorStateAttitude().estimate(recording)
        between = attitude_error(single.world_q_body, double.world_q_body).errors[:, 0]
        apart[recording.name[:2]] = float(np.degrees(np.sqrt(np.mean(between**2))))
        totals = [
            attitude_error(one.world_q_body, truth.world_q_body, truth.movement).degrees[0]
            for one in (single, double)
        ]
        worse[recording.name[:2]] = totals[0] - totals[1]
    worst = max(apart, key=lambda k: apart[k])
    told = " ".join(f"{k}:{value:.4f}" for k, value in apart.items())
    lost = max(worse, key=lambda k: abs(worse[k]))
    return {
        "error_state_to_double": Figure(apart[worst], "deg", told, 0.1, 0.05),
        "error_state_rmse_change": Figure(abs(worse[lost]), "deg", f"against the truth, trial {lost}"),
    }


def on_avr(every: list[Trial]) -> Figures:
    """The fixed-point Mahony filter: longest update, errors to double, bytes."""
    longest, rms, largest, stack = {}, {}, {}, 0
    long_ones = [recording for recording, _ in every if recording.duration >= 179.0]
    for recording in long_ones[:3] if QUICK else long_ones:
        counts = avr_cycles("mahony_q", recording)
        longest[recording.name[:2]], stack = counts.worst, max(stack, counts.stack)
        one = parity("c-mahony-q", sampled(recording), magnetometer=False)
        rms[recording.name[:2]], largest[recording.name[:2]] = one.rms, one.worst
    size = module_sizes("mahony_q", "avr")
    over = f"{len(longest)} recordings of 180 s"

    def worst(values: dict[str, float], unit: str, *bars: float) -> Figure:
        key = max(values, key=lambda k: values[k])
        return Figure(values[key], unit, f"worst of {over}, trial {key}", *bars)

    return {
        "avr_mahony_cycles": worst(longest, "cycles", 5000, 4000),
        "avr_mahony_rms": worst(rms, "deg", 0.1, 0.05),
        "avr_mahony_max": worst(largest, "deg", 0.3, 0.15),
        "avr_mahony_recordings": Figure(len(longest), "", "of 180 s", None, 5, "higher"),
        "avr_mahony_flash": Figure(size.text, "B", "start, step and attitude", 4096, 2560),
        "avr_mahony_state": Figure(size.state, "B", "", 96, 64),
        "avr_mahony_stack": Figure(max(stack, size.stack), "B", "used, and by the call graph", 140, 100),
    }


def same_bits(every: list[Trial]) -> Figures:
    """Host, Cortex-M4 and AVR over the trials one after the other."""
    recordings = [recording for recording, _ in every]
    found = {}
    for name in ("mahony_q", "tilt_q", "complementary_q"):
        many = 100_000 if name == "mahony_q" and not QUICK else 20_000
        alike = agreeing(name, recordings, many)
        told = f"samples whose frames agree: {alike} of {many}"
        found[f"same_bits_{name}"] = Figure(min(alike.values()), "samples", told, 20_000, 100_000, "higher")
    return found


def on_the_line(every: list[Trial]) -> Figures:
    """Frames of the AVR image."""
    recording = next(one for one, _ in every if one.name.startswith("21"))
    quaternion = frames(recording, count=10_000)
    angles = frames(recording, mode="a", count=2000 if QUICK else 10_000)
    jitter = max(quaternion.jitter, angles.jitter)
    lost = quaternion.lost + quaternion.corrupt
    told = f"longest; mean {quaternion.latency_mean:.0f}"
    return {
        "avr_jitter": Figure(jitter, "us", "longest departure from 10 ms; ±7.5 measured before", 8, 2),
        "avr_latency_quaternion": Figure(quaternion.latency, "us", told, 500, 300),
        "avr_latency_angles": Figure(
            angles.latency, "us", f"longest; mean {angles.latency_mean:.0f}", 1000, 700
        ),
        "avr_frames_lost": Figure(lost, "frames", f"of {quaternion.count}", 0),
        "avr_frames_lost_angles": Figure(angles.lost + angles.corrupt, "frames", f"of {angles.count}", 0),
    }


def in_batches(every: list[Trial]) -> Figures:
    """CPU a sample from Python, beside the peers."""
    recording = next(one for one, _ in every if one.name.startswith("21"))
    micros = speeds(recording)
    bars: dict[str, tuple[float | None, float | None]] = {"c_mahony": (0.06, 0.035)}
    return {
        f"speed_{name}": Figure(
            value,
            "us",
            f"a sample; imufusion {micros['imufusion']:.2f} in this run",
            *bars.get(name, (None, None)),
        )
        for name, value in micros.items()
    }


def a_day(every: list[Trial]) -> Figures:
    """8.64 million samples through every filter, under UBSan."""
    recording = sampled(next(one for one, _ in every if one.name.startswith("07")))
    count, found = DAY // 24 if QUICK else DAY, {}
    for name in SOAKED:
        say(f"  {name}")
        worst, last, wrong = soak(name, recording, count)
        bar = 1e-3 if name.endswith("_q") else 1e-5
        found[f"soak_{name}_norm"] = Figure(
            worst, "", f"departure from 1 over {count} samples; last {last:.1g}", bar
        )
        found[f"soak_{name}_nan"] = Figure(wrong, "samples", f"of {count}, no overflow under UBSan", 0)
    return found


def main() -> int:
    """Measure and publish."""
    lacking = [package for target in ("m4", "avr") for package in missing_tools(target, emulate=True)]
    if lacking:
        sys.exit(f"the boards cannot be emulated here: apt install {' '.join(lacking)}")
    every, figures = trials(), {}
    parts: dict[str, Callable[[list[Trial]], Figures]] = {
        "Cortex-M4": on_m4, "error-state": error_state_errors, "AVR": on_avr, "frames": on_the_line,
        "batches": in_batches, "same bits": same_bits, "a day": a_day,
    }  # fmt: skip
    for name, part in parts.items():
        say(name)
        figures |= part(every)
    return publish(figures)


if __name__ == "__main__":
    sys.exit(main())
