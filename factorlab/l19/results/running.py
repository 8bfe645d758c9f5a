"""The examples as child processes, a few at a time; one that fails is an outcome like the others."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

from factorlab.l19.results.claims import Claim, read_claims
from factorlab.l19.results.course import COURSE, item_of
from factorlab.report.document import Table
from sequential.errors import DataError, FileFormatError

__all__ = ["Outcome", "run_scripts", "scripts_of"]

LIMIT_S = 300.0


@dataclass(frozen=True, slots=True)
class Outcome:
    """What one example has left, what went wrong (empty where nothing did), and its words' first line."""

    script: Path
    claims: tuple[Claim, ...] = ()
    tables: tuple[Table, ...] = ()
    pictures: tuple[Path, ...] = ()
    fault: str = ""
    seconds: float = 0.0
    title: str = ""

    @property
    def item(self) -> str:
        """The id of the course in the script's name."""
        return item_of(self.script.name) or ""

    @property
    def headline(self) -> Claim | None:
        """The first claim that is judged, else the first."""
        return next((one for one in self.claims if one.judged), next(iter(self.claims), None))

    @property
    def good(self) -> bool:
        """Whether it ran to its end, claims something, and every claim is in its band."""
        return not self.fault and bool(self.claims) and all(claim.holds for claim in self.claims)


def scripts_of(folder: Path, only: Sequence[str] = ()) -> list[Path]:
    """The examples of the course in its order; `only` names ids or beginnings of them (TP4: a to d).

    Raises
    ------
    DataError
        where the folder has none, or `only` names what the course has not.
    """
    known = {item.id.upper() for item in COURSE}
    asked = [one.strip().upper() for one in only if one.strip()]
    for one in asked:
        if not any(name.startswith(one) for name in known):
            raise DataError(f"--only {one} : ce cours ne connaît que {', '.join(i.id for i in COURSE)}")
    scripts = [path for path in sorted(folder.glob("[0-9][0-9]_*.py")) if item_of(path.name)]
    if not scripts:
        raise DataError(f"{folder} : aucun exemple du cours ici ; donnez leur dossier avec --cours")
    return [path for path in scripts if not asked or _asked(str(item_of(path.name)).upper(), asked)]


def _asked(item: str, asked: Sequence[str]) -> bool:
    # "TP4" asks for TP4a to TP4d, as no item is called TP4
    return any(item == one or item.rstrip("ABCD") == one for one in asked)


def _unheard(outcome: Outcome, done: int, total: int) -> None:
    """Tell nobody."""


def run_scripts(
    scripts: Sequence[Path],
    out: Path,
    *,
    arguments: Mapping[str, Sequence[str]] | None = None,
    jobs: int = 2,
    progress: Callable[[Outcome, int, int], None] = _unheard,
) -> list[Outcome]:
    """Run every script with `-o out`, `jobs` at a time; outcomes in the order of the scripts.

    Parameters
    ----------
    arguments : further arguments of a script by its name
    progress : called with each outcome as it comes, how many are done and out of how many
    """
    out.mkdir(parents=True, exist_ok=True)
    given = dict(arguments or {})
    found: dict[Path, Outcome] = {}
    pool = ThreadPoolExecutor(max_workers=max(1, jobs))
    try:
        waiting = [pool.submit(_run, path, out, given.get(path.name, ())) for path in scripts]
        for done, future in enumerate(as_completed(waiting), start=1):
            outcome = future.result()
            found[outcome.script] = outcome
            progress(outcome, done, len(scripts))
    finally:
        pool.shutdown(cancel_futures=True)
    return [found[path] for path in scripts]


def _run(script: Path, out: Path, arguments: Sequence[str]) -> Outcome:
    began = perf_counter()
    try:
        done = subprocess.run(  # noqa: S603 - the course's own examples, or those of the folder asked for
            [sys.executable, str(script.resolve()), *arguments, "-o", str(out.resolve())],
            cwd=out,  # what an example writes stays out of the tree
            env=_surroundings(),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            encoding="utf-8",
            errors="replace",
            timeout=LIMIT_S,
            check=False,
        )
        fault = "" if done.returncode == 0 else _fault(done.stderr, done.returncode)
    except subprocess.TimeoutExpired:
        fault = f"pas fini après {LIMIT_S:.0f} s"
    seconds = perf_counter() - began
    claims: tuple[Claim, ...] = ()
    tables: tuple[Table, ...] = ()
    try:
        claims, tables = read_claims(out / f"{script.stem}.jsonl")
    except FileFormatError as error:
        fault = fault or str(error)
    pictures = tuple(sorted(out.glob(f"{script.stem}*.png")))
    return Outcome(script, claims, tables, pictures, fault, seconds, _title(script))


def _title(script: Path) -> str:
    """The first line of the script's docstring, empty where there is none."""
    try:
        words = ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""
    except (SyntaxError, ValueError):
        return ""
    return words.partition("\n")[0]


def _surroundings() -> dict[str, str]:
    """The environment, with this very package first and no threads of linear algebra."""
    root = str(Path(__file__).resolve().parents[3])
    path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    quiet = {"MPLBACKEND": "Agg", "PYTHONPATH": path, "PYTHONUTF8": "1"}
    return {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", **os.environ, **quiet}


def _fault(stderr: str, code: int) -> str:
    """The last line of what it said, which is the exception's."""
    lines = [line.strip() for line in stderr.splitlines() if line.strip()]
    # "AssertionError: …", "sequential.errors.DataError: …": the sentence is what a student needs
    return re.sub(r"^[\w.]+Error: ", "", lines[-1]) if lines else f"s'est arrêté avec le code {code}"
