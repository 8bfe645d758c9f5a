"""The core under the address and undefined-behaviour sanitizers: recordings, extremes, wound-up states."""

import subprocess

import numpy as np
import pytest
from core_modules import SANITIZERS, STATE, extremes, filters, objects, program, samples_input
from float_filters import recorded_table

from sequential.readers import read_broad

FLAGS = (f"-fsanitize={SANITIZERS}", "-fno-sanitize-recover=all")


@pytest.fixture(scope="module", name="core")
def sanitized_core(c_compiler, tmp_path_factory):
    folder = tmp_path_factory.mktemp("sanitized")
    return folder, objects(c_compiler, folder, *FLAGS)


@pytest.fixture(params=filters(), name="run")
def a_sanitized_filter(request, core, c_compiler):
    """A function that runs one filter on inputs and fails where a sanitizer speaks."""
    folder, compiled = core
    target = program(c_compiler, folder, request.param, compiled, *FLAGS, "-DWITH_MAIN")

    def run(*inputs):
        paths = []
        for k, words in enumerate(inputs):
            paths.append(folder / f"{request.param}-{k}.bin")
            paths[-1].write_bytes(words)
        done = subprocess.run([target, *paths], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr

    run.module = request.param
    return run


@pytest.mark.parametrize("trial", ["07", "21", "29"])
def test_recordings(run, trial, data_dir):
    (path,) = (data_dir / "imu" / "broad").glob(f"{trial}_*.npz")
    samples, dt = recorded_table(read_broad(path)[0], None)
    run(samples_input(run.module, samples[::3], 3 * dt[::3]))


def test_extremes(run, rng):
    run(*(extremes(rng) for _ in range(50)))


def test_states_of_any_bits(run, rng):
    run(*(bytes([STATE]) + rng.bytes(int(rng.integers(100, 4000))) for _ in range(200)))


def test_a_sensor_that_is_stuck_at_the_end_of_its_range(run):
    stuck = np.tile([34.9, -34.9, 34.9, 156.0, 156.0, -156.0, 127.0, 127.0, 127.0], (20_000, 1))
    run(samples_input(run.module, stuck, np.full(len(stuck), 0.01)))


def test_the_sanitizers_find_what_is_put_there(c_compiler, tmp_path):
    """A test that cannot fail shows nothing: the flags do stop at an overflow."""
    wrong = tmp_path / "wrong.c"
    wrong.write_text(
        "int main(int n, char **v) { volatile int most = 2147483647; (void)v; return (n + most) & 1; }\n"
    )
    subprocess.run([c_compiler, "-w", *FLAGS, wrong, "-o", tmp_path / "wrong"], check=True)
    done = subprocess.run([tmp_path / "wrong"], capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "signed integer overflow" in done.stderr
