"""The filters of the core, found by their headers, and programs that run them under the sanitizers."""

import re
import subprocess
from pathlib import Path

import numpy as np
from c_structs import CORE

CHECK = CORE.parent / "check"
SANITIZERS = "address,undefined,float-cast-overflow"
ANY_SAMPLE = {"complementary_f32", "tilt_f32", "mahony_f32"}
"""Filters whose attitude stays a rotation whatever bits a sample has; the other headers bound them."""
COUNTS, SAMPLES, STATE = 0, 1, 2
"""What an input of fuzz_filter.c is made of, by its first byte."""


def filters() -> list[str]:
    """Names of the modules that have a state and a step, with their suffix."""
    found = set()
    for header in CORE.glob("*.h"):
        found |= set(
            re.findall(r"^void (\w+)_step\(struct \1_state \*", header.read_text(), flags=re.MULTILINE)
        )
    return sorted(found)


def objects(compiler: str, folder: Path, *flags: str) -> list[str]:
    """Every file of the core, compiled with these flags into a folder."""
    sources = [str(one) for one in sorted(CORE.glob("*.c"))]
    command = [compiler, "-std=c99", "-g", "-O1", "-ffp-contract=off", *flags, f"-I{CORE}", "-c", *sources]
    subprocess.run(command, check=True, cwd=folder)
    return [str(folder / f"{Path(one).stem}.o") for one in sources]


def program(compiler: str, folder: Path, module: str, core: list[str], *flags: str) -> Path:
    """fuzz_filter.c of one module, or fuzz_functions.c for the name `functions`."""
    target = folder / module
    source, own = CHECK / "fuzz_functions.c", []
    if module != "functions":
        source = CHECK / "fuzz_filter.c"
        own = [
            f'-DFILTER_HEADER="{module}.h"',
            f"-DMODULE={module}",
            f"-DFIXED_POINT={int(module[-1] == 'q')}",
            f"-DANY_SAMPLE={int(module in ANY_SAMPLE)}",
        ]
    command = [compiler, "-std=c99", "-g", "-O1", *flags, *own, f"-I{CORE}", str(source), *core, "-lm", "-o",
               str(target)]  # fmt: skip
    subprocess.run(command, check=True)
    return target


def counts_input(counts: np.ndarray, trouble: np.ndarray) -> bytes:
    """An input of counts (N, 9) of gyro, accelerometer and magnetometer, with a byte of trouble each (N,)."""
    rows = np.zeros(len(counts), np.dtype([("counts", "<i2", 9), ("trouble", "u1")]))
    rows["counts"], rows["trouble"] = counts, trouble
    return bytes([COUNTS]) + rows.tobytes()


def samples_input(module: str, samples: np.ndarray, dt: np.ndarray) -> bytes:
    """An input of samples (N, 9) in SI, quantised where the module takes integers, dt (N,) in seconds."""
    if module.endswith("_q"):
        rows = np.zeros(len(samples), np.dtype([("gyro", "<i4", 3), ("narrow", "<i2", 6), ("periods", "u1")]))
        wide = np.nan_to_num(samples.astype(np.float64))
        rows["gyro"] = np.clip(np.rint(wide[:, :3] * 2**24), -(2**31), 2**31 - 1)
        rows["narrow"] = np.clip(np.rint(wide[:, 3:] * 2**8), -(2**15), 2**15 - 1)
        rows["periods"] = np.clip(np.rint(dt * 100), 0, 255)
    else:
        rows = np.zeros(len(samples), np.dtype([("sample", "<f4", 9), ("dt", "<f4")]))
        rows["sample"], rows["dt"] = samples, dt
    return bytes([SAMPLES]) + rows.tobytes()


def extremes(rng: np.random.Generator, rows: int = 400) -> bytes:
    """An input of counts that are mostly at the ends of their range, with every kind of trouble."""
    ends = np.array([-32768, -32767, -1, 0, 1, 32767])
    counts = ends[rng.integers(0, len(ends), (rows, 9))]
    return counts_input(counts, rng.integers(0, 256, rows).astype(np.uint8))
