"""libFuzzer on every filter of the core, on its state as well as its samples, and on what keeps no state.

A short run with a fixed seed here; `make -C firmware/check fuzz` goes on for ten minutes each.
"""

import subprocess

import pytest
from core_modules import SANITIZERS, STATE, extremes, filters, objects, program

RUNS = 6000
FLAGS = (f"-fsanitize=fuzzer-no-link,{SANITIZERS}", "-fno-sanitize-recover=all")
LINKED = (f"-fsanitize=fuzzer,{SANITIZERS}", "-fno-sanitize-recover=all")


@pytest.fixture(scope="module", name="core")
def core_for_the_fuzzer(clang, tmp_path_factory):
    folder = tmp_path_factory.mktemp("fuzzed")
    return folder, objects(clang, folder, *FLAGS)


@pytest.mark.parametrize("module", [*filters(), "functions"])
def test_no_input_makes_it_misbehave(module, core, clang, rng, tmp_path):
    folder, compiled = core
    target = program(clang, folder, module, compiled, *LINKED)
    corpus = tmp_path / "corpus"
    corpus.mkdir()
    for k in range(10):
        (corpus / f"counts-{k}").write_bytes(extremes(rng, 30))
        (corpus / f"state-{k}").write_bytes(bytes([STATE]) + rng.bytes(1000))
    done = subprocess.run(
        [target, "-seed=1", f"-runs={RUNS}", "-max_len=4096", "-len_control=0", corpus],
        capture_output=True, text=True, check=False, cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-4000:]
    assert f"Done {RUNS} runs" in done.stderr


def test_there_is_something_to_fuzz():
    assert {"complementary_f32", "tilt_f32", "mahony_f32", "error_state_f32", "mahony_q"} <= set(filters())
