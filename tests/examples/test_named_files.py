"""Whoever names a file of the course names one that exists."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
NAMED = re.compile(r"\b\d\d_[a-z]+\d?[a-z]?_\w+\.py\b")
TEXTS = sorted(
    path
    for folder in ("docs", "examples", "factorlab", "firmware")
    for path in (ROOT / folder).rglob("*")
    if path.suffix in {".md", ".py"}
)


@pytest.fixture(scope="module")
def named():
    """Names of course files, with the texts that mention them."""
    found = {}
    for path in [*TEXTS, ROOT / "README.md"]:
        for name in NAMED.findall(path.read_text(encoding="utf-8")):
            found.setdefault(name, set()).add(str(path.relative_to(ROOT)))
    return found


def test_files_of_the_course_that_are_named_exist(named):
    assert len(named) > 30
    there = {path.name for path in (ROOT / "examples" / "l19").glob("*.py")}
    assert {name: where for name, where in named.items() if name not in there} == {}
