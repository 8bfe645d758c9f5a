"""Run every estimator on one SLAM problem, time it, score it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.compare.verdict import Finding
from factorlab.datasets.slam import SlamDataset
from factorlab.slam.estimators import KINDS, make, require_names
from factorlab.slam.lags import STEP_NS, LagPoint, slam_lag_sweep
from factorlab.slam.loops import loop_errors_of
from factorlab.slam.scores import MapScore, Scores, map_score_of, scores_of
from sequential.errors import FactorlabError
from sequential.history import Run
from sequential.slam import SlamRun
from sequential.slam.revisits import LoopErrors

__all__ = ["SlamComparison", "SlamRow", "compare_slam"]

Progress = Callable[[str, int, int], None]
QUICK_S = 0.3  # a pass that takes longer is timed once
REPEATS = 3


@dataclass(frozen=True, slots=True, eq=False)
class SlamRow:
    """One estimator on one problem.  A solve that failed has a message and no figures."""

    name: str
    scores: Scores | None = None
    map_score: MapScore | None = None
    chi2: float | None = None
    seconds: float | None = None  # of the whole pass, without the marginal covariances of graphs
    us_per_measurement: float | None = None
    iterations: int | None = None
    converged: bool = False
    message: str = ""
    run: SlamRun | None = field(default=None, repr=False)
    trajectory: Run | None = field(default=None, repr=False)
    loops: LoopErrors | None = field(default=None, repr=False)

    @property
    def title(self) -> str:
        """The name as a table writes it."""
        return KINDS[self.name].title

    @property
    def failed(self) -> bool:
        """Whether there is no estimate."""
        return self.trajectory is None

    def to_json(self) -> dict[str, Any]:
        """Plain numbers; null where there is none."""
        scores = self.scores
        true = scores is not None and scores.against == "truth"
        rmse = None if scores is None else scores.rmse
        honesty = None if scores is None or scores.honesty is None else scores.honesty
        return {
            "rmse_m": rmse if true else None,
            "rmse_to_batch_m": None if true else rmse,
            "rotation_rmse_rad": None if scores is None else scores.rotation_rmse,
            "normalised_error": None if honesty is None else honesty.to_json(),
            "anees_per_dof": None if honesty is None else honesty.mean / honesty.expected,
            "inside_three_sigma": None if honesty is None or scores is None else list(scores.inside()),
            "loop_error": None if self.loops is None else self.loops.to_json(),
            "map": None if self.map_score is None else self.map_score.to_json(),
            "chi2": self.chi2,
            "seconds": self.seconds,
            "us_per_measurement": self.us_per_measurement,
            "latency": KINDS[self.name].latency,
            "step_worst_s": None if self.run is None else self.run.report.details.get("step_worst_s"),
            "iterations": self.iterations,
            "converged": self.converged,
            "message": self.message,
        }


@dataclass(frozen=True, slots=True, eq=False)
class SlamComparison:
    """Many estimators, one problem, one table."""

    dataset: SlamDataset
    rows: tuple[SlamRow, ...]
    findings: tuple[Finding, ...]
    seed: int
    lags: tuple[LagPoint, ...] = ()

    @property
    def name(self) -> str:
        """Name of the recording."""
        return self.dataset.name

    @property
    def all_failed(self) -> bool:
        """Whether no estimator returned an estimate."""
        return all(row.failed for row in self.rows)

    def row(self, name: str) -> SlamRow | None:
        """The row of an estimator that has a result, or None."""
        return next((row for row in self.rows if row.name == name and not row.failed), None)

    def to_json(self) -> dict[str, Any]:
        """The document of this comparison, without versions and command."""
        problem = self.dataset.problem
        return {
            "dataset": self.name,
            "title": self.dataset.title,
            "variables": {kind: len(problem.indices(kind)) for kind in problem.kinds},
            "readings": problem.count,
            "estimators": {row.name: row.to_json() for row in self.rows},
            "reference": dict(self.dataset.reference),
            "findings": [finding.to_json() for finding in self.findings],
            "lag_sweep": [point.to_json() for point in self.lags],
            "notes": list(self.dataset.notes),
            "seed": self.seed,
        }


def silent(what: str, done: int, total: int) -> None:
    """Report progress to nobody."""


def compare_slam(
    dataset: SlamDataset,
    estimators: tuple[str, ...] | None = None,
    *,
    seed: int = 0,
    lags: Sequence[float] = (),
    progress: Progress = silent,
) -> SlamComparison:
    """Run estimators side by side on one SLAM problem.

    Parameters
    ----------
    estimators : names, see `factorlab.slam.NAMES`; by default those that the dataset recommends
    seed : of the resampling behind the bootstrap bands
    lags : windows, in steps, at which a fixed-lag smoother is tried as well
    progress : called with what is being done, how much is done, and out of how much

    Raises
    ------
    DataError, ModelError
        where the problem is at fault; a solver that fails becomes a row with its message.
    """
    names = require_names(tuple(estimators) if estimators else dataset.default_estimators)
    passes = list(dict.fromkeys(KINDS[name].solves for name in names))
    solved: dict[str, SlamRun | str] = {}
    seconds: dict[str, float] = {}
    for done, name in enumerate(passes):
        progress(KINDS[name].title, done, len(passes) + 1)
        try:
            solved[name], seconds[name] = _timed(name, dataset)
        except FactorlabError as error:
            solved[name] = " ".join(str(error).split())
    progress("scores", len(passes), len(passes) + 1)
    stand_in = _stand_in(dataset, solved)
    rows = tuple(_row(name, dataset, solved, seconds, stand_in, seed) for name in names)
    from factorlab.slam.verdicts import findings_of

    swept = slam_lag_sweep(dataset, lags, stand_in, seed) if lags else ()
    return SlamComparison(dataset, rows, findings_of(dataset, rows), seed, swept)


def _timed(name: str, dataset: SlamDataset) -> tuple[SlamRun, float]:
    """A solve, and the median of the estimator's own seconds over warm solves where these are quick."""
    estimator = make(name, dataset.graph_options, covariance=_wanted(dataset), every=dataset.isam_every)
    began = time.perf_counter()
    run = estimator.solve(dataset.problem)
    times = [run.report.seconds]
    while time.perf_counter() - began < QUICK_S and len(times) < REPEATS:
        times.append(estimator.solve(dataset.problem).report.seconds)
    return run, float(np.median(times[1:] or times))


def _wanted(dataset: SlamDataset) -> bool | tuple[str, ...]:
    """Kinds whose covariances have a use: all where a truth can judge them, else landmarks, for the map."""
    if dataset.truth is not None and dataset.aligned == "none":
        return True
    return ("l",) if "l" in dataset.problem.kinds else False


def times_of(dataset: SlamDataset, steps: NDArray[np.int64]) -> NDArray[np.int64]:
    """ns of steps; a problem without times counts a second a step."""
    if dataset.problem.t is None:
        return np.asarray(steps, dtype=np.int64) * STEP_NS
    return np.asarray(dataset.problem.t)[steps]


def timed(dataset: SlamDataset, online: Run | None) -> Run | None:
    """An online run at the times of `times_of`: without times an estimator counts steps."""
    if online is None or dataset.problem.t is not None:
        return online
    return replace(online, t=times_of(dataset, online.t))


def _stand_in(dataset: SlamDataset, solved: Mapping[str, SlamRun | str]) -> Run | None:
    """What others are measured against where there is no truth: the batch, or iSAM2 at the end."""
    if dataset.truth is not None:
        return None
    for name in ("batch", "isam2"):
        run = solved.get(name)
        if isinstance(run, SlamRun):
            return run.trajectory(times_of(dataset, run.values.index["x"]))
    return None


def _row(
    name: str,
    dataset: SlamDataset,
    solved: Mapping[str, SlamRun | str],
    seconds: Mapping[str, float],
    stand_in: Run | None,
    seed: int,
) -> SlamRow:
    kind = KINDS[name]
    run = solved[kind.solves]
    if isinstance(run, str):
        return SlamRow(name, message=run)
    final = kind.part == "final" or run.online is None
    path = run.trajectory(times_of(dataset, run.values.index["x"])) if final else timed(dataset, run.online)
    assert path is not None  # noqa: S101 - an online estimator keeps what it believed
    scored = scores_of(dataset, path, stand_in, seed, "the batch")
    chi2 = run.report.details.get("chi2") if kind.part == "final" else None
    return SlamRow(
        name,
        scored,
        map_score_of(dataset, run),
        chi2,
        seconds[kind.solves],
        1e6 * seconds[kind.solves] / dataset.problem.count,
        run.report.iterations,
        run.report.converged,
        run.report.message,
        run,
        path,
        loop_errors_of(dataset, run, path),
    )
