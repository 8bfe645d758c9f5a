"""Every example runs, and its last lines assert what it claims; the course's claim what RESULTATS.md says."""

import os
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from factorlab.l19.results import Outcome, differences, item_of, read_claims, read_results

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples"
PARTS = {"figures.py", "claims.py"}  # what examples import is none
SCRIPTS = sorted(path for path in EXAMPLES.rglob("*.py") if path.name not in PARTS)
TOOLS = ("gcc", "avr-gcc", "simavr", "arm-none-eabi-gcc", "qemu-system-arm")
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
    if item_of(example.name):
        claims, _ = read_claims(tmp_path / "build" / "l19" / f"{example.stem}.jsonl")
        assert claims, "an example of the course states its figures through claim()"
        assert not apart_from_results(example, claims)


def apart_from_results(example, claims):
    """What differs from RESULTATS.md; where recordings or tools are missing, figures of one source only."""
    stated = [row for row in results() if row.script == example.name]
    if not os.environ.get("FACTORLAB_DATA") or not all(map(shutil.which, TOOLS)):
        both = {(one.quantity, one.source) for one in claims}
        both &= {(row.claim.quantity, row.claim.source) for row in stated}
        claims = [one for one in claims if (one.quantity, one.source) in both]
        stated = [row for row in stated if (row.claim.quantity, row.claim.source) in both]
    return differences([Outcome(example, tuple(claims))], stated)


@cache
def results():
    """The rows of the repository's own page."""
    return read_results(ROOT / "RESULTATS.md")
