"""Every example runs, and its last lines assert what it claims."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
PARTS = {"figures.py", "claims.py"}  # what examples import is none
SCRIPTS = sorted(path for path in EXAMPLES.rglob("*.py") if path.name not in PARTS)
LIMIT_S = 300


@pytest.mark.parametrize(
    "example", [pytest.param(path, id=str(path.relative_to(EXAMPLES))) for path in SCRIPTS]
)
def test_example_runs(example, tmp_path):
    done = subprocess.run(
        [sys.executable, example],
        cwd=tmp_path,  # what an example writes stays out of the tree
        env={**os.environ, "MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
