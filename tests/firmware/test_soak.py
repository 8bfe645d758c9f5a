"""Hours of samples through every filter: no NaN, no drift of the length, and UBSan sees no overflow.

A million samples here, and the 8.64 million of a day at 100 Hz with --full.
"""

import subprocess
from pathlib import Path

import numpy as np
import pytest
from attitude_worlds import seen, swinging
from c_structs import CORE
from core_modules import filters, objects

from factorlab.firmware.instructions import imu_f32, imu_q
from sequential.attitude import attitude_from_angles

SOAK = Path(__file__).resolve().parents[1] / "benchmarks" / "measure" / "soak.c"
HOURS, DAY = 1_000_000, 8_640_000
FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fsanitize=undefined", "-fno-sanitize-recover=all", "-w")


@pytest.fixture(scope="module", name="core")
def watched_core(c_compiler, tmp_path_factory):
    folder = tmp_path_factory.mktemp("soak")
    return folder, objects(c_compiler, folder, *FLAGS[1:])


@pytest.fixture(scope="module", name="recording")
def a_motion_with_noise_and_bias():
    t, angles = swinging(120.0)
    rng = np.random.default_rng(2)
    return seen(t, attitude_from_angles(angles), bias=(0.01, -0.02, 0.015), rng=rng)


@pytest.mark.slow
@pytest.mark.parametrize("module", filters())
def test_hours_of_samples(module, core, recording, c_compiler, request):
    folder, compiled = core
    fixed = module.endswith("_q")
    target, samples = folder / module, folder / f"{module}.bin"
    samples.write_bytes((imu_q if fixed else imu_f32)(recording).tobytes())
    named = (f"-DSOAK_MODULE={module}", f'-DSOAK_HEADER="{module}.h"', f"-DSOAK_FIXED={int(fixed)}")
    subprocess.run(
        [c_compiler, *FLAGS, *named, f"-I{CORE}", str(SOAK), *compiled, "-lm", "-o", str(target)], check=True
    )
    count = DAY if request.config.getoption("--full") else HOURS
    done = subprocess.run([target, samples, str(count)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    worst, last, wrong = map(float, done.stdout.split())
    assert wrong == 0
    assert worst < (1e-4 if fixed else 5e-7)
    assert last < (1e-4 if fixed else 5e-7)
