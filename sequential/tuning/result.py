"""What every way of tuning returns: values with their intervals, and whether they made the filter honest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite, log10
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.model import StateSpace
from sequential.tuning.verdict import Verdict

__all__ = ["Z95", "Tuning"]

Z95 = 1.96  # half a 95 % interval of the normal distribution, in standard deviations
TITLES = {
    "ml": "maximum likelihood of the innovations",
    "nis": "mean NIS brought to what is expected",
    "em": "expectation-maximisation",
    "als": "autocovariance least squares",
    "still": "a recording at rest",
}


@dataclass(frozen=True, slots=True, eq=False)
class Tuning:
    """What tuning found.

    Parameters
    ----------
    values, initial : by knob name; `initial` lacks a knob of which nothing was declared
    log_likelihood_before, log_likelihood_after : of the innovations, without a prior; NaN where unknown
    evaluations : filter passes, those for the uncertainty included
    seconds : wall time
    message : what went less than well, in a sentence; empty is good news
    decades : standard deviation of log10(value), by knob name, from the curvature at the optimum; NaN where
        that is not a maximum in every direction
    converged : the search met its tolerances
    method : "ml", "nis", "em", "als" or "still"
    units : by knob name
    limits : 95 % intervals that do not come from `decades`; an end of 0 or infinity is open
    matrices : whole covariances that were estimated, by name
    unidentified : knobs of which the readings say less than was assumed beforehand
    notes : sentences about what was done on the way, such as readings left out
    before, after : verdicts on the innovations, None where there was no filter to judge
    model : with the new values; None for a recording at rest
    """

    values: Mapping[str, float]
    initial: Mapping[str, float]
    log_likelihood_before: float
    log_likelihood_after: float
    evaluations: int
    seconds: float
    message: str = ""
    decades: Mapping[str, float] = field(default_factory=dict)
    converged: bool = True
    method: str = "ml"
    units: Mapping[str, str] = field(default_factory=dict)
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    matrices: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    unidentified: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    before: Verdict | None = None
    after: Verdict | None = None
    model: StateSpace | None = None

    def factor(self, name: str) -> float:
        """By how much a knob was turned; NaN where nothing was declared before."""
        before = self.initial.get(name, 0.0)
        return self.values[name] / before if before else float("nan")

    def interval(self, name: str, sigmas: float = Z95) -> tuple[float, float]:
        """Interval of a value, 95 % unless told otherwise.

        From the curvature it is symmetric on the logarithmic scale; limits found otherwise are stretched on
        that scale.
        """
        value = self.values[name]
        if name in self.limits:
            low, high = self.limits[name]
            if sigmas == Z95 or value <= 0.0:
                return low, high
            down = (low / value) ** (sigmas / Z95) if low > 0 else 0.0
            return value * down, value * (high / value) ** (sigmas / Z95)
        wide = 10.0 ** (sigmas * self.decades.get(name, float("nan")))
        return value / wide, value * wide

    @property
    def verdict(self) -> str:
        """What tuning changed, as a sentence: before, after, and what may not be believed."""
        told = []
        if self.before is not None:
            told.append(f"before: {self.before.sentence}")
        if self.after is not None:
            told.append(f"after: {self.after.sentence}")
        told += [self.message] if self.message else []
        told += [self.doubt(name) for name in self.unidentified]
        return ". ".join(told) or "no filter was judged"

    def doubt(self, name: str) -> str:
        """The sentence about a knob that the readings do not determine."""
        low, high = self.interval(name)
        if name in self.limits and (low == 0.0) != (not isfinite(high)):
            open_end = f"anything below {high:.3g}" if low == 0.0 else f"anything above {low:.3g}"
            return f"{name} is not identified: {open_end} fits these readings as well"
        return (
            f"{name} is not identified by these readings: its value rests on what was assumed beforehand, "
            f"{self.initial.get(name, self.values[name]):.3g}, give or take its prior"
        )

    def to_json(self) -> dict[str, Any]:
        """Plain numbers under the names of the fields; intervals are 95 % ones."""
        return {
            "method": self.method,
            "knobs": {name: self._knob(name) for name in self.values},
            "matrices": {name: matrix.tolist() for name, matrix in self.matrices.items()},
            "log_likelihood_before": self.log_likelihood_before,
            "log_likelihood_after": self.log_likelihood_after,
            "evaluations": self.evaluations,
            "seconds": self.seconds,
            "converged": self.converged,
            "message": self.message,
            "notes": list(self.notes),
            "before": None if self.before is None else self.before.to_json(),
            "after": None if self.after is None else self.after.to_json(),
            "verdict": self.verdict,
        }

    def _knob(self, name: str) -> dict[str, Any]:
        known = self.factor(name)
        return {
            "before": self.initial.get(name),
            "after": self.values[name],
            "factor": known if isfinite(known) else None,
            "interval95": list(self.interval(name)),
            "unit": self.units.get(name, ""),
            "identified": name not in self.unidentified,
        }

    def __str__(self) -> str:
        """A small table and the verdict."""
        lines = [f"{TITLES.get(self.method, self.method)}, {self.evaluations} filter passes"]
        for name, value in self.values.items():
            low, high = self.interval(name)
            was = f"{self.initial[name]:.4g} -> " if name in self.initial else ""
            lines.append(
                f"  {name}: {was}{value:.4g} [{low:.3g}, {high:.3g}] {self.units.get(name, '')}".rstrip()
            )
        return "\n".join([*lines, *self.notes, self.verdict])


def log_sigma(low: float, high: float) -> float:
    """Standard deviation of log10 behind a 95 % interval with two finite ends."""
    return log10(high / low) / (2.0 * Z95) if low > 0 and isfinite(high) else float("nan")
