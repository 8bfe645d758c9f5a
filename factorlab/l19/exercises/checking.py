"""A student's file against the exercises that it answers: one verdict an exercise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from factorlab.l19.exercises.fault import Fault
from factorlab.l19.exercises.finding import FAIL, PASS, WARN, Finding
from factorlab.l19.exercises.student import StudentRun, run_student
from factorlab.l19.exercises.survey import EXERCISES, Survey, survey

__all__ = ["ExerciseVerdict", "FileVerdict", "check_file", "check_path"]

END = "aller jusqu'au bout"
JOB = "factorlab.l19.exercises.judging:judge"


@dataclass(frozen=True)
class ExerciseVerdict:
    """The findings of one exercise, in the order of its checks."""

    exercise: str
    findings: tuple[Finding, ...]

    @property
    def verdict(self) -> str:
        """FAIL where a check does not hold, WARN where one holds with a remark, else PASS."""
        statuses = {finding.status for finding in self.findings}
        return next((word for word in (FAIL, WARN) if word in statuses), PASS)

    def of(self, status: str) -> list[Finding]:
        """The findings with this status."""
        return [finding for finding in self.findings if finding.status == status]


@dataclass(frozen=True)
class FileVerdict:
    """What a file answers, and how well.

    Parameters
    ----------
    path : Path
    exercises : tuple of ExerciseVerdict
    syntax : Fault, optional
        The line where the file is no Python.
    stopped : Fault, optional
        The line where running the file stopped; names before it are checked.
    printed : str
        The beginning of what the file printed.
    """

    path: Path
    exercises: tuple[ExerciseVerdict, ...]
    syntax: Fault | None = None
    stopped: Fault | None = None
    printed: str = ""

    @property
    def failed(self) -> bool:
        """Whether something has to be mended."""
        return self.syntax is not None or any(one.verdict == FAIL for one in self.exercises)

    def to_json(self) -> dict[str, Any]:
        """The whole verdict, as a dictionary for JSON."""
        return {
            "file": str(self.path),
            "verdict": FAIL if self.failed else PASS,
            "syntax": None if self.syntax is None else self.syntax.to_json(),
            "stopped": None if self.stopped is None else self.stopped.to_json(),
            "exercises": [
                {"exercise": e.exercise, "verdict": e.verdict, "findings": [f.to_json() for f in e.findings]}
                for e in self.exercises
            ],
            "printed": self.printed,
        }


def check_path(path: Path, *, limit_s: float = 120.0) -> list[FileVerdict]:
    """Check a file, or every file of a folder that defines names of an exercise.

    Raises
    ------
    DataError
        where there is no such file, or where nothing in it belongs to an exercise.
    """
    from sequential.errors import DataError

    if not path.exists():
        raise DataError(f"{path} n'existe pas ; vérifiez le nom et le dossier")
    if path.is_dir():
        surveys = [survey(file, imported=False) for file in sorted(path.glob("*.py"))]
        found = [one for one in surveys if one.exercises or one.fault]
        if not found:
            raise DataError(f"aucun fichier de {path} ne définit un nom des exercices E1 à E4")
        return [check_file(one, limit_s=limit_s) for one in found]
    one = survey(path)
    if not (one.exercises or one.fault):
        hints = " ; ".join(one.hints())
        wanted = " ; ".join(f"{exercise} : {', '.join(names)}" for exercise, names in EXERCISES.items())
        said = f"{path} ne définit aucun nom des exercices ({wanted})"
        raise DataError(f"{said}. Peut-être : {hints}" if hints else said)
    return [check_file(one, limit_s=limit_s)]


def check_file(found: Survey, *, limit_s: float = 120.0) -> FileVerdict:
    """Run a file in a process of its own and judge the exercises that it answers."""
    if found.fault is not None:
        return FileVerdict(found.path, (), syntax=found.fault)
    arguments = {
        "path": str(found.path.resolve()),
        "exercises": {exercise: list(names) for exercise, names in found.offers.items()},
    }
    run = run_student(found.path, JOB, arguments, limit_s=limit_s)
    exercises = tuple(ExerciseVerdict(e, _findings(found, run, e)) for e in found.exercises)
    return FileVerdict(found.path, exercises, None, run.stopped, run.printed)


def _findings(found: Survey, run: StudentRun, exercise: str) -> tuple[Finding, ...]:
    """What the checks found; then names that are missing, and how the process ended before its time."""
    rows = [Finding(**event) for event in run.events if event["exercise"] == exercise]
    for name, hint in found.missing(exercise).items():
        said = f"`{name}` manque{hint}."
        rows = [replace(row) for row in rows if row.check != name]
        rows.append(Finding(exercise, name, FAIL, f"le nom {name}", said))
    if run.fault is not None:
        said = f"La vérification s'est arrêtée là : {run.fault.said}."
        fault = run.fault
        if fault.line is None and fault.kind not in {"durée", "mort"}:
            said = f"Le vérificateur s'est trompé, et non vous ({fault.kind}) : signalez-le avec ce fichier."
        rows.append(Finding(exercise, "fin", FAIL, END, said, line=fault.line, code=fault.code))
    if not rows:
        rows.append(Finding(exercise, "fin", FAIL, END, "Aucune vérification n'a pu se faire."))
    return tuple(rows)
