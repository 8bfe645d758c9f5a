"""A student's file written down and checked."""

import textwrap

import pytest

from factorlab.l19.exercises.checking import check_path


class Checked:
    """The verdict of a file with one exercise, to ask questions of."""

    def __init__(self, verdict):
        self.file = verdict
        self.verdict = verdict.exercises[0].verdict
        self.findings = verdict.exercises[0].findings

    def of(self, status):
        return [finding for finding in self.findings if finding.status == status]

    @property
    def causes(self):
        return {finding.cause for finding in self.of("FAIL")}

    def __repr__(self):
        rows = [f"{f.status} {f.check}: {f.said} {f.cause} {f.expected} {f.got}" for f in self.findings]
        return "\n".join([self.verdict, str(self.file.stopped), *rows])


@pytest.fixture
def checked(tmp_path):
    def of(text, name="copie.py"):
        path = tmp_path / name
        path.write_text(textwrap.dedent(text), encoding="utf-8")
        (verdict,) = check_path(path)
        return Checked(verdict)

    return of


@pytest.fixture
def changed(checked):
    """Check a right solution with some of its lines changed."""

    def of(solution, *changes):
        for before, after in changes:
            assert before in solution, f"{before!r} stands in the solution"
            solution = solution.replace(before, after)
        return checked(solution)

    return of
