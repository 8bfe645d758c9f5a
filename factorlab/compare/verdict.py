"""The verdict: a few findings that say what can be believed and what to change."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from factorlab.compare.estimators import KINDS

if TYPE_CHECKING:
    from factorlab.compare.honesty import Nis, NormalisedError
    from factorlab.compare.table import Row
    from factorlab.datasets import Dataset
    from sequential.model import StateSpace

__all__ = ["Finding", "Status", "findings_of"]

Status = Literal["PASS", "WARN", "FAIL"]
Band = tuple[float, float]

TOLERABLE = 2.0  # a mean within this factor of what is expected is a warning, beyond it a failure


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

    def to_json(self) -> dict[str, Any]:
        """Plain values under the names of the fields."""
        return {name: getattr(self, name) for name in self.__slots__}


def findings_of(dataset: Dataset, model: StateSpace, rows: tuple[Row, ...]) -> tuple[Finding, ...]:
    """Findings on a table of rows: solves, innovations of a filter, honesty of the first filter and last smoother."""
    solved = [row for row in rows if not row.failed]
    found = [_failed(row) for row in rows if row.failed]
    found += [_unsettled(row) for row in solved if not row.converged]
    filters = [row for row in solved if KINDS[row.name].online]
    smoothers = [row for row in solved if not KINDS[row.name].online]
    if filters and filters[0].nis is not None:
        found += _innovations(filters[0], filters[0].nis)
    for row in (*filters[:1], *smoothers[-1:]):
        if row.normalised_error is not None:
            found.append(_honesty(row, row.normalised_error))
    return tuple(found)


def _failed(row: Row) -> Finding:
    return Finding(f"{row.title}: solve", None, None, "FAIL", row.message, "leave it out, or mend the cause", row.name)


def _unsettled(row: Row) -> Finding:
    meaning = row.message or "the iteration stopped before it settled"
    return Finding(f"{row.title}: solve", None, None, "WARN", meaning, "do not quote its figures", row.name)


def _innovations(row: Row, nis: Nis) -> list[Finding]:
    sensors = nis.sensors or {"": nis}
    return [_nis_of_sensor(row, name, one) for name, one in sensors.items()]


def _nis_of_sensor(row: Row, sensor: str, nis: Nis) -> Finding:
    ratio = nis.mean / nis.expected
    status: Status = "PASS" if nis.inside else "WARN" if 1 / TOLERABLE <= ratio <= TOLERABLE else "FAIL"
    what = f"NIS of {sensor}" if sensor else "NIS"
    meaning = _meaning(ratio, "innovations", inside=nis.inside)
    return Finding(f"{row.title}: {what}", nis.mean, nis.band95, status, meaning, _action(ratio, status), row.name)


def _honesty(row: Row, honest: NormalisedError) -> Finding:
    ratio = honest.mean / honest.expected
    low, high = honest.bootstrap_band95 or honest.band95
    fits = honest.inside or low <= honest.expected <= high
    status: Status = "PASS" if fits else "WARN" if 1 / TOLERABLE <= ratio <= TOLERABLE else "FAIL"
    against = "held-out readings" if honest.against == "held-out" else "the truth"
    meaning = _meaning(ratio, f"errors against {against}", inside=fits)
    return Finding(
        f"{row.title}: normalised error",
        honest.mean,
        honest.band95,
        status,
        meaning,
        _action(ratio, status),
        row.name,
    )


def _meaning(ratio: float, what: str, *, inside: bool) -> str:
    if inside:
        return f"{what} are as large as the covariance says"
    if ratio > 1:
        return f"{what} are {ratio**0.5:.2g}x larger than the covariance says: overconfident"
    return f"{what} are {ratio**-0.5:.2g}x smaller than the covariance says: pessimistic"


def _action(ratio: float, status: Status) -> str:
    if status == "PASS":
        return "nothing"
    if ratio > 1:
        return "raise the process or sensor noise, or fit it with --tune"
    return "lower the process or sensor noise, or fit it with --tune"
