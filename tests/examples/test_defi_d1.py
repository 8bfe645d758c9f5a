"""The line that example D1 prints can be typed, and finds the q that the example finds by hand."""

import importlib.util
import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from factorlab.l19.challenge import public_trial
from factorlab.l19.challenge.files import TUNE, starting_files
from factorlab.l19.challenge.rivals import tuned_noise

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "l19" / "51_d1_temperature.py"


@pytest.fixture(scope="module")
def by_hand():
    spec = importlib.util.spec_from_file_location("l19_d1", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    trial = public_trial()
    return module.tune_q(trial.z, np.var(trial.z[trial.rest], ddof=1))


def test_the_command_finds_the_example_s_q(tmp_path, by_hand):
    for name, text in starting_files(public_trial()).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    words = shlex.split(TUNE)
    assert words[0] == "factorlab"
    done = subprocess.run(
        [sys.executable, "-m", *words, "--json"],
        cwd=tmp_path, env=os.environ, capture_output=True, text=True, timeout=100, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["knobs"]["q"]["after"] == pytest.approx(by_hand, rel=0.03)


def test_the_challenge_s_own_filter_has_that_q(by_hand):
    assert tuned_noise(public_trial()).q == pytest.approx(by_hand, rel=0.03)
