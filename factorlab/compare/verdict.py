"""The verdict: a few findings, worst first, that say what can be believed and what to change."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from factorlab.compare.estimators import KINDS
from sequential.errors import FactorlabError
from sequential.evaluate import Blame, blame, diagnose
from sequential.evaluate.observability import show
from sequential.timeline import Problem

if TYPE_CHECKING:
    from factorlab.compare.honesty import NormalisedError
    from factorlab.compare.table import Row

__all__ = ["Finding", "Status", "findings_of"]

Status = Literal["PASS", "WARN", "FAIL"]
Band = tuple[float, float]
ORDER = {"FAIL": 0, "WARN": 1, "PASS": 2}

OVERCONFIDENT = 1.25  # errors so many times larger than stated are a failure
PESSIMISTIC = 2.0  # so many times smaller, too; in between is a warning, since it wastes but does not mislead
BLAME_RUNS = 100  # about how often the log is filtered to find the guilty noise
BLAME_S = 10.0  # and how long that may take


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the verdict: a metric beside its 95 % band, what it means, what to do."""

    metric: str
    value: float | None
    band95: Band | None
    status: Status
    meaning: str
    action: str
    estimator: str = ""
    sensor: str = ""

    def to_json(self) -> dict[str, Any]:
        """Plain values under the names of the fields."""
        return {name: getattr(self, name) for name in self.__slots__}


def findings_of(problem: Problem, rows: tuple[Row, ...]) -> tuple[Finding, ...]:
    """What a table of rows reveals.

    Failed solves, the innovations of the first filter with the noise they accuse, and whether that filter and
    the last smoother know how wrong they are.
    """
    solved = [row for row in rows if not row.failed]
    filters = [row for row in solved if KINDS[row.name].online]
    smoothers = [row for row in solved if not KINDS[row.name].online]
    found = [_failed(row) for row in rows if row.failed]
    found += [_unsettled(row) for row in solved if not row.converged]
    for row in (filters or smoothers)[:1]:
        found += _diagnosis(problem, row)
    if solved:
        found += _unseen(problem)
    found += [_honesty(row) for row in (*filters[:1], *smoothers[-1:]) if row.normalised_error is not None]
    return tuple(sorted(found, key=lambda finding: ORDER[finding.status]))


def _failed(row: Row) -> Finding:
    return Finding(
        f"{row.title}: solve", None, None, "FAIL", row.message, "leave it out, or mend the cause", row.name
    )


def _unsettled(row: Row) -> Finding:
    meaning = row.message or "the iteration stopped before it settled"
    return Finding(f"{row.title}: solve", None, None, "WARN", meaning, "do not quote its figures", row.name)


def _diagnosis(problem: Problem, row: Row) -> list[Finding]:
    """What the innovations say, in the words of `sequential.evaluate.diagnose`."""
    assert row.run is not None  # noqa: S101 - only solved rows are diagnosed
    found = []
    told = diagnose(row.run, problem.model, _guilty(problem, row))
    levels_fail = any(one.metric == "mean NIS" and one.level == "FAIL" for one in told)
    for one in told:
        if one.metric == "solve":
            continue  # told already
        of = f" of {one.sensor}" if one.sensor and one.sensor not in one.metric else ""
        metric = f"{row.title}: {one.metric}{of}"
        # a factor that the likelihood is sure of, while the innovations fit, is worth a warning
        mild = one.metric == "noise balance" and one.level == "FAIL" and not levels_fail
        level: Status = "WARN" if mild else one.level
        found.append(
            Finding(metric, one.value, one.band, level, one.meaning, one.advice, row.name, one.sensor)
        )
    return found


def _guilty(problem: Problem, row: Row) -> Blame | None:
    """Which noise is off, where finding that out does not take too long."""
    if row.seconds is None or row.seconds * BLAME_RUNS > BLAME_S:
        return None
    try:
        return blame(problem)
    except FactorlabError:
        return None


def _unseen(problem: Problem) -> list[Finding]:
    """Directions of the state that no reading shows: the prior alone decides there."""
    try:
        open_directions = show(problem).unobservable
    except FactorlabError:
        return []
    action = "trust the prior there, add a sensor that shows it, or take it out of the state"
    what = "no reading shows this of the start"
    return [
        Finding("observability", None, None, "WARN", f"{what}: {one.words}", action)
        for one in open_directions
    ]


def _honesty(row: Row) -> Finding:
    honest: NormalisedError = row.normalised_error  # type: ignore[assignment]  # the caller has looked
    factor = (honest.mean / honest.expected) ** 0.5
    low, high = honest.bootstrap_band95 or honest.band95
    fits = honest.inside or low <= honest.expected <= high
    status: Status = "FAIL" if factor > OVERCONFIDENT or factor < 1 / PESSIMISTIC else "WARN"
    status = "PASS" if fits else status
    against = "held-out readings" if honest.against == "held-out" else "the truth"
    what = f"{honest.mean:.3g} where {honest.expected:g} is expected, median {honest.median:.2g}"
    if fits and not honest.inside:
        what += f"; resampled by gaps the mean is {low:.2g} – {high:.2g}, which holds {honest.expected:g}"
    if fits:
        meaning, action = f"errors against {against} are as large as stated ({what})", ""
    elif factor > 1:
        meaning = f"errors against {against} are {factor:.2g}x larger than stated ({what}): overconfident"
        action = "do not trust the covariance; see what the innovations accuse"
    else:
        meaning = f"errors against {against} are {1 / factor:.2g}x smaller than stated ({what}): pessimistic"
        action = "the covariance is on the safe side; lower the noise if it matters"
    metric = f"{row.title}: normalised error"
    return Finding(metric, honest.mean, honest.band95, status, meaning, action, row.name)
