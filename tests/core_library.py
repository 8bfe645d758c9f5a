"""The fixed-point modules of the firmware, compiled for this machine and called from the tests."""

import ctypes
import subprocess
from pathlib import Path

import numpy as np

CORE = Path(__file__).resolve().parents[1] / "firmware" / "core"
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Werror", "-ffp-contract=off")
Axes, Axes16 = ctypes.c_int32 * 3, ctypes.c_int16 * 3


class ImuQ(ctypes.Structure):
    """Struct imu_q."""

    _fields_ = (("gyro", Axes), ("accel", Axes16), ("mag", Axes16))


class ImuRaw(ctypes.Structure):
    """Struct imu_raw."""

    _fields_ = (("accel", Axes16), ("gyro", Axes16), ("mag", Axes16))


class AffineQ(ctypes.Structure):
    """Struct affine_q."""

    _fields_ = (("matrix", Axes * 3), ("shift", Axes))


def compiled(compiler, folder, *sources, text=""):
    """A library of these files of core/, and of C that calls them in loops, with overflow as an error."""
    folder = Path(folder)
    (folder / "loops.c").write_text(text + "\n", encoding="utf-8")
    library = folder / "core.so"
    command = [compiler, "-std=c99", "-O2", "-shared", "-fPIC", *WARNINGS, "-fsanitize=undefined",
               "-fno-sanitize-recover=all", "-static-libubsan", f"-I{CORE}"]  # fmt: skip
    files = [*(CORE / name for name in sources), folder / "loops.c"]
    subprocess.run([*command, *files, "-o", library, "-lm"], check=True)
    return ctypes.CDLL(str(library))


def pointer(array):
    """To the numbers of an array that is contiguous."""
    assert array.flags.c_contiguous
    return array.ctypes.data_as(ctypes.c_void_p)  # which keeps the array alive


def samples_q(gyro, accel, mag=None):
    """(N,) records of struct imu_q from SI (N, 3), rounded to its units."""
    records = np.zeros(len(gyro), dtype=[("gyro", "<i4", 3), ("accel", "<i2", 3), ("mag", "<i2", 3)])
    records["gyro"] = np.clip(np.round(gyro * 2.0**24), -(2**31), 2**31 - 1)
    for name, values in (("accel", accel), ("mag", mag)):
        if values is not None:
            known = np.isfinite(values).all(axis=1)[:, None]
            scaled = np.round(np.where(known, values, 0.0) * 256)
            records[name] = np.clip(scaled, -(2**15), 2**15 - 1)
    return records
