"""Judging an estimate and reading a file need no compiler."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("room", ["sequential.evaluate", "sequential.readers"])
def test_importing_a_room_loads_no_compiler(room):
    script = f"import json, sys, {room}; print(json.dumps(sorted(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    loaded = {name.split(".")[0] for name in json.loads(done.stdout)}
    assert not {"numba", "llvmlite", "scipy", "gtsam"} & loaded
