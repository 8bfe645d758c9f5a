"""What the C core does on this computer: its speed beside a plain loop and imufusion; a day of samples."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from pathlib import Path

import imufusion
import numpy as np

from factorlab.firmware.instructions import imu_f32, imu_q
from sequential.attitude import Mahony
from sequential.firmware import CMahony, source_folder
from sequential.sensors import ImuRecording

from .timing import cpu_seconds

__all__ = ["DAY", "SOAKED", "plain_loop", "soak", "speeds"]

HERE = Path(__file__).parent
DAY = 8_640_000  # samples: 24 h at 100 Hz
SOAKED = (
    "mahony_f32", "tilt_f32", "complementary_f32", "error_state_f32", "mahony_q", "tilt_q", "complementary_q",
)  # fmt: skip
PEER_SAMPLES = 20_000
SANITIZED = ("-fsanitize=undefined", "-fno-sanitize-recover=all")


def _compiler() -> str:
    found = shutil.which("gcc") or shutil.which("cc")
    if found is None:
        raise SystemExit("the figures need a C compiler: install gcc")
    return found


def plain_loop(folder: Path) -> ctypes.CDLL:
    """plain_mahony.c, compiled for any machine of this kind."""
    library = folder / "plain.so"
    flags = ("-std=c99", "-O3", "-fno-math-errno", "-shared", "-fPIC")
    subprocess.run([_compiler(), *flags, str(HERE / "plain_mahony.c"), "-o", str(library), "-lm"], check=True)
    return ctypes.CDLL(str(library))


def speeds(recording: ImuRecording) -> dict[str, float]:
    """Microseconds of CPU a sample, 6-D, in one run: ours in C and in Python, a plain C loop, imufusion."""
    count = len(recording)
    path, dt = np.empty((count, 4)), ctypes.c_double(1.0 / recording.rate)
    with tempfile.TemporaryDirectory() as name:
        loop = plain_loop(Path(name)).plain_mahony
        loop.restype = None
        arrays = [ctypes.c_void_p(one.ctypes.data) for one in (recording.gyro, recording.accel, path)]
        works = {
            "c_mahony": lambda: CMahony(magnetometer=False).estimate(recording),
            "python_mahony": lambda: Mahony(magnetometer=False).estimate(recording),
            "plain_c": lambda: loop(ctypes.c_long(count), dt, *arrays),
            "imufusion": lambda: _imufusion(recording),
        }
        seconds = cpu_seconds(works, rounds=9)
    samples = dict.fromkeys(works, count) | {"imufusion": PEER_SAMPLES}
    return {name: 1e6 * spent / samples[name] for name, spent in seconds.items()}


def _imufusion(recording: ImuRecording) -> np.ndarray:
    """One call a sample: it has no batch."""
    ahrs = imufusion.Ahrs()
    settings = imufusion.AhrsSettings()
    settings.sample_rate = recording.rate
    ahrs.set_settings(settings)
    gyro, accel = recording.gyro[:PEER_SAMPLES], recording.accel[:PEER_SAMPLES]
    for w, a in zip(gyro, accel, strict=True):
        ahrs.update_no_magnetometer(w, a)
    return ahrs.get_quaternion()


def soak(module: str, recording: ImuRecording, count: int = DAY) -> tuple[float, float, int]:
    """Run a filter for a day, under UBSan.

    Returns
    -------
    the largest departure of the quaternion's length from 1, that of the last, attitudes that held no number
    """
    core = source_folder() / "core"
    fixed = module.endswith("_q")
    defined = [f"-DSOAK_MODULE={module}", f'-DSOAK_HEADER="{module}.h"', f"-DSOAK_FIXED={int(fixed)}"]
    with tempfile.TemporaryDirectory() as name:
        program, samples = Path(name) / "soak", Path(name) / "samples"
        flags = ("-std=c99", "-O2", "-ffp-contract=off", *SANITIZED, f"-I{core}")
        sources = map(str, (HERE / "soak.c", *sorted(core.glob("*.c"))))
        subprocess.run([_compiler(), *flags, *defined, *sources, "-o", str(program), "-lm"], check=True)
        (imu_q if fixed else imu_f32)(recording).tofile(samples)
        said = subprocess.run([program, samples, str(count)], capture_output=True, text=True, check=False)
    if said.returncode:
        return np.inf, np.inf, count
    worst, last, wrong = said.stdout.split()
    return float(worst), float(last), int(wrong)
