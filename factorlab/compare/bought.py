"""What smoothing bought on one log: accuracy and honesty for waiting, time and memory; where it goes wrong.

Works on rows of any comparison: it takes plain figures, and the findings that a verdict is made of.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

__all__ = ["Bought", "Told", "bought", "reasons", "sentences"]

OVERCONFIDENT = 1.25  # normalised error per degree of freedom above which a covariance misleads
CALM, ALARMED = 0.8, 1.25  # NIS per degree of freedom: below, readings agree better than stated; above, worse
INNOVATIONS_LARGE = (
    "the innovations say so too ({:.2g} times the χ² that is expected): noise is stated too small, or the "
    "model lacks something that the readings show; --tune fits it"
)
INNOVATIONS_SMALL = (
    "the innovations do not show it ({:.2g} times the χ² that is expected): readings agree with each other "
    "and are off together, by an error that they share, such as a mount, a map, a clock, or the truth itself"
)
COLOURED = "innovations are correlated: an error that lasts counts as fresh evidence at every reading"
SMOOTHER_WORSE = (
    "the smoother is the more overconfident of the two: averaging over past and future shrinks the "
    "covariance of white errors, and leaves errors that last where they were"
)


@dataclass(frozen=True, slots=True)
class Told:
    """Figures of one estimator; None where there is nothing to compare with."""

    name: str
    title: str
    rmse: float | None
    anees_per_dof: float | None
    nis_per_dof: float | None
    us_per_measurement: float | None
    latency_s: float
    memory_kb: float

    def to_json(self) -> dict[str, Any]:
        """Plain numbers under the names of the fields."""
        return {name: getattr(self, name) for name in self.__slots__}


@dataclass(frozen=True, slots=True)
class Bought:
    """A filter beside a smoother: ratios above 1 are what the smoother does better (or costs more)."""

    filter: Told
    smoother: Told
    rmse_ratio: float | None  # filter's over smoother's
    time_ratio: float | None  # smoother's over filter's
    memory_ratio: float
    why: tuple[str, ...]  # where the filter, or the smoother, is overconfident, and why

    def to_json(self) -> dict[str, Any]:
        """Plain numbers and sentences."""
        plain = {name: getattr(self, name) for name in ("rmse_ratio", "time_ratio", "memory_ratio")}
        return {
            "filter": self.filter.to_json(),
            "smoother": self.smoother.to_json(),
            **plain,
            "why": list(self.why),
        }


class Finding(Protocol):
    """What a verdict's line has."""

    @property
    def metric(self) -> str: ...

    @property
    def status(self) -> str: ...

    @property
    def meaning(self) -> str: ...


def bought(before: Told, after: Told, findings: Sequence[Finding] = ()) -> Bought:
    """Compare a filter with a smoother on the same log."""
    return Bought(
        before,
        after,
        _ratio(before.rmse, after.rmse),
        _ratio(after.us_per_measurement, before.us_per_measurement),
        after.memory_kb / before.memory_kb,
        reasons(before, after, findings),
    )


def _ratio(a: float | None, b: float | None) -> float | None:
    return a / b if a is not None and b else None


def reasons(before: Told, after: Told, findings: Sequence[Finding] = ()) -> tuple[str, ...]:
    """Why covariances are too small, as far as readings, innovations and observability tell."""
    open_directions = [
        f"no reading shows this of the start: {one.meaning.partition(': ')[2]}; what is claimed of it comes "
        "from the prior, or from linearising at points that differ (Huang et al. 2010)"
        for one in findings
        if one.metric == "observability"
    ]
    wrong = [one for one in (before, after) if (one.anees_per_dof or 0.0) > OVERCONFIDENT]
    if not wrong:
        return tuple(open_directions)
    names = " and ".join(one.title for one in wrong)
    times = " and ".join(f"{(one.anees_per_dof or 0.0) ** 0.5:.2g}" for one in wrong)
    found = [f"{names}: errors {times} times larger than stated", *open_directions]
    nis = before.nis_per_dof
    if nis is not None and nis > ALARMED:
        found.append(INNOVATIONS_LARGE.format(nis))
    if nis is not None and nis < CALM:
        found.append(INNOVATIONS_SMALL.format(nis))
    if any("whiteness" in one.metric and one.status != "PASS" for one in findings):
        found.append(COLOURED)
    if after in wrong and (before.anees_per_dof or 0.0) < (after.anees_per_dof or 0.0):
        found.append(SMOOTHER_WORSE)
    return tuple(found)


def sentences(one: Bought, unit: str = "m") -> tuple[str, ...]:
    """The same in words: accuracy, honesty, cost."""
    from factorlab.compare.text import figure

    before, after = one.filter, one.smoother
    told = []
    if one.rmse_ratio is not None:
        what = "more accurate" if one.rmse_ratio >= 1.0 else "less accurate"
        times = one.rmse_ratio if one.rmse_ratio >= 1.0 else 1.0 / one.rmse_ratio
        told.append(
            f"Accuracy: {after.title} is {figure(times)} times {what} than {before.title} "
            f"(RMSE {figure(after.rmse)} {unit} against {figure(before.rmse)} {unit})."
        )
    if before.anees_per_dof is not None and after.anees_per_dof is not None:
        told.append(
            f"Honesty: normalised error per degree of freedom {figure(before.anees_per_dof)} for "
            f"{before.title}, {figure(after.anees_per_dof)} for {after.title}; 1 is expected."
        )
    told.append(
        f"Price: {after.title} answers up to {figure(after.latency_s)} s after the moment it speaks of, "
        f"{before.title} at once; it keeps {figure(after.memory_kb)} kB of states instead of "
        f"{figure(before.memory_kb)} kB, and takes {figure(after.us_per_measurement)} µs a reading "
        f"instead of {figure(before.us_per_measurement)} µs."
    )
    return tuple(told)
