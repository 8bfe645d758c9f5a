"""Loop errors in a comparison: what judges a recording with landmarks and without a truth."""

from __future__ import annotations

import numpy as np

from factorlab.compare.text import figure
from factorlab.compare.verdict import Finding, Status
from factorlab.datasets.slam import SlamDataset
from sequential.errors import FactorlabError
from sequential.history import Run
from sequential.slam import SlamProblem, SlamRun, Values
from sequential.slam.beginnings import placed
from sequential.slam.revisits import LoopErrors, largest_group, loop_errors

__all__ = ["loop_errors_of", "loop_finding"]

CLOSED = 0.1  # of the loop error of dead reckoning: beyond that the loops are not closed


def loop_errors_of(dataset: SlamDataset, run: SlamRun, path: Run) -> LoopErrors | None:
    """Of a trajectory, online or smoothed; None where there is a truth, or nothing that is seen again."""
    if dataset.truth is not None or len(path.mean) != len(run.values.index["x"]):
        return None
    return _errors(dataset.problem, Values({"x": run.values.index["x"]}, {"x": np.array(path.mean)}))


def loop_finding(dataset: SlamDataset, title: str, name: str, errors: LoopErrors) -> Finding | None:
    """The best estimate's loop error beside that of dead reckoning."""
    try:
        dead = _errors(dataset.problem, placed(dataset.problem))
    except FactorlabError:
        return None
    if dead is None:
        return None
    status: Status = "PASS" if errors.rms <= CLOSED * dead.rms else "WARN"
    meaning = (
        f"{len(errors.distance)} times a landmark is seen again after a while, {figure(errors.rms)} m (RMS) "
        f"from where the visit before had put it, {figure(errors.worst)} m at worst; by dead reckoning "
        f"{figure(dead.rms)} m"
    )
    action = (
        "" if status == "PASS" else "begin the batch with initial='incremental', or doubt the associations"
    )
    return Finding(
        f"{title}: loop error", errors.rms, (0.0, CLOSED * dead.rms), status, meaning, action, name
    )


def _errors(problem: SlamProblem, values: Values) -> LoopErrors | None:
    try:
        found = loop_errors(problem, values, largest_group(problem))
    except FactorlabError:
        return None
    return found if len(found.distance) else None
