"""What a comparison returns: one row an estimator, and the document that `--json` prints."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import Any, Protocol

from factorlab.compare.accuracy import Errors
from factorlab.compare.axes import AxisErrors
from factorlab.compare.bought import Bought
from factorlab.compare.estimators import KINDS
from factorlab.compare.honesty import Nis, NormalisedError
from factorlab.compare.lag_sweep import Lag
from factorlab.compare.resources import Resources
from factorlab.compare.verdict import Finding
from factorlab.datasets import Dataset
from factorlab.versions import versions
from sequential.history import Run
from sequential.model import StateSpace

__all__ = ["SCHEMA", "Comparison", "Row", "Tuned", "document"]

SCHEMA = 1


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """One estimator on one log.  A solve that failed has a message and no figures."""

    name: str
    errors: Errors | None = None
    normalised_error: NormalisedError | None = None
    nis: Nis | None = None
    seconds: float | None = None  # wall time of one warm solve
    us_per_measurement: float | None = None  # seconds over the number of all readings, inputs included
    iterations: int | None = None
    converged: bool = False
    message: str = ""
    run: Run | None = field(default=None, repr=False)
    axes: AxisErrors | None = field(default=None, repr=False)
    resources: Resources | None = None

    @property
    def title(self) -> str:
        """The name as a table writes it."""
        return KINDS[self.name].title

    @property
    def failed(self) -> bool:
        """Whether there is no estimate."""
        return self.run is None

    @property
    def rmse(self) -> float | None:
        """Root mean square error against whatever there is to compare with."""
        return None if self.errors is None else self.errors.rmse()

    def to_json(self) -> dict[str, Any]:
        """`held_out_rmse_m` and `rmse_m` (against the truth) are null where they do not apply."""
        against = None if self.errors is None else self.errors.against
        metres = self.errors is not None and self.errors.metres
        plain: dict[str, Any] = {
            "held_out_rmse_m": self.rmse if against == "held-out" and metres else None,
            "rmse_m": self.rmse if against == "truth" else None,
        }
        if against == "held-out" and not metres:
            plain["held_out_rmse"] = self.rmse  # in the units of the sensor that was held out
        return plain | {
            "normalised_error": None if self.normalised_error is None else self.normalised_error.to_json(),
            "nis": None if self.nis is None else self.nis.to_json(),
            "axes": None if self.axes is None else self.axes.to_json(),
            "seconds": self.seconds,
            "us_per_measurement": self.us_per_measurement,
            "resources": None if self.resources is None else self.resources.to_json(),
            "iterations": self.iterations,
            "converged": self.converged,
            "message": self.message,
        }


@dataclass(frozen=True, slots=True, eq=False)
class Tuned:
    """What tuning changed: knob by knob, before and after, with an interval where there is one."""

    initial: Mapping[str, float]
    values: Mapping[str, float]
    intervals: Mapping[str, tuple[float, float]]
    units: Mapping[str, str]
    seconds: float
    log_likelihood_before: float
    log_likelihood_after: float
    evaluations: int
    message: str = ""

    def to_json(self) -> dict[str, Any]:
        """Plain numbers under the names of the fields."""
        return {name: getattr(self, name) for name in self.__slots__}


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Many estimators, one log, one table.

    `rows` hold the tuned result where `tuned` is given, and `untuned` the result with the noise as shipped.
    `findings` are the verdict on `rows`, `lags` windows of several lengths between filter and batch.
    """

    dataset: Dataset
    model: StateSpace
    rows: tuple[Row, ...]
    findings: tuple[Finding, ...]
    readings: int
    seed: int
    untuned: tuple[Row, ...] = ()
    tuned: Tuned | None = None
    lags: tuple[Lag, ...] = ()
    bought: Bought | None = None

    @property
    def name(self) -> str:
        """Name of the recording."""
        return self.dataset.name

    @property
    def all_failed(self) -> bool:
        """Whether no estimator returned an estimate."""
        return all(row.failed for row in self.rows)

    def to_json(self) -> dict[str, Any]:
        """The document of this comparison, without versions and command (see `document`)."""
        plain: dict[str, Any] = {
            "dataset": self.name,
            "title": self.dataset.title,
            "estimators": {row.name: row.to_json() for row in self.rows},
        }
        if self.tuned is not None:
            plain["untuned"] = {row.name: row.to_json() for row in self.untuned}
            plain["tuning"] = self.tuned.to_json()
        if self.lags:
            plain["lag_sweep"] = [lag.to_json() for lag in self.lags]
        plain["bought"] = None if self.bought is None else self.bought.to_json()
        plain["findings"] = [finding.to_json() for finding in self.findings]
        return plain | {"notes": list(self.dataset.notes), "readings": self.readings, "seed": self.seed}


class Told(Protocol):
    """What a document is made of: a comparison of chains or of SLAM problems."""

    @property
    def name(self) -> str:
        """Of the recording."""
        ...

    def to_json(self) -> dict[str, Any]:
        """Without versions and command."""
        ...


def document(comparisons: Sequence[Told], command: str) -> dict[str, Any]:
    """One JSON document for one comparison, or `{"runs": {name: …}}` for several; NaN becomes null."""
    whole: dict[str, Any] = {"schema": SCHEMA}
    if len(comparisons) == 1:
        whole |= comparisons[0].to_json()
    else:
        whole["runs"] = {_key(comparison.name): comparison.to_json() for comparison in comparisons}
    whole |= {"versions": versions(), "command": command}
    return {key: strict(value) for key, value in whole.items()}


def _key(name: str) -> str:
    """`mrclam robot 1` of a recording called `mrclam-robot1`."""
    return re.sub(r"-robot(\d+)$", r" robot \1", name)


def strict(value: Any) -> Any:
    """The same value with tuples as lists and null for what JSON cannot say."""
    if isinstance(value, Mapping):
        return {str(key): strict(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [strict(item) for item in value]
    if isinstance(value, float):
        return value if isfinite(value) else None
    return value
