"""Which noise is wrong?  Each is multiplied by one factor in turn, and the readings say which factor helps.

Overconfident innovations alone do not tell a process noise that is too small from a sensor noise that is:
both make S too small.  Their correlation and the state's weight differ, and the likelihood sees that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from sequential.errors import FactorlabError
from sequential.evaluate.rescale import Scaling, accepted_only, log_likelihood, scalings
from sequential.history import Run
from sequential.run import Estimator
from sequential.timeline import Problem

__all__ = ["Blame", "Candidate", "blame"]

WORTH = 6.0  # nats: below it a factor is not worth mentioning (2·6 is beyond the 0.999 quantile of χ²₁)
CLEAR = 3.0  # nats: by this the best must beat the best of another family, odds of 20 to 1
TOGETHER = "every noise"
COARSE = 0.5  # decades between the first factors that are tried
FINE = 0.02  # decades to which the best factor is found


@dataclass(frozen=True, slots=True)
class Candidate:
    """The best factor on the standard deviations of one noise, the others as they are.

    `gain` in log likelihood (nats), `nis` the mean NIS of each sensor with that factor.
    """

    name: str
    family: str
    factor: float
    gain: float
    nis: Mapping[str, float]

    @property
    def off(self) -> str:
        """`about 15x too small`, or `too large`: said of standard deviations."""
        size, word = (self.factor, "small") if self.factor >= 1.0 else (1.0 / self.factor, "large")
        return f"about {size:.2g}x too {word}"


@dataclass(frozen=True, slots=True)
class Blame:
    """All candidates, best first, and whether one of them stands out."""

    candidates: tuple[Candidate, ...]
    guilty: Candidate | None
    clear: bool
    runs: int  # how many times the log was filtered

    @property
    def verdict(self) -> str:
        """One sentence."""
        best = self.candidates[0]
        if self.guilty is None:
            return (
                "the noises are in balance: no single factor on one of them raises the log likelihood "
                f"by more than {max(best.gain, 0.0):.1f}"
            )
        gain = f"{best.name} {best.off}: that factor raises the log likelihood by {best.gain:.0f}"
        rival = self.rival
        if rival is None:
            return gain
        other = f"{rival.name} x {rival.factor:.2g} by {max(rival.gain, 0.0):.0f}"
        return f"{gain}, {other}" if self.clear else f"{gain}, {other}: the readings cannot tell them apart"

    @property
    def rival(self) -> Candidate | None:
        """The best candidate of another family than the best of all."""
        best = self.candidates[0]
        return next((c for c in self.candidates if c.family != best.family), None)


def blame(problem: Problem, estimator: Estimator | None = None, decades: float = 2.0) -> Blame:
    """Find the noise whose one factor explains the readings best.

    Parameters
    ----------
    problem : the model laid out on the log, as from `prepare(model, log)`
    estimator : a filter; the extended Kalman filter by default.  It runs some twenty times per noise, on
        the readings that it accepts with the model as declared
    decades : factors from 10^-decades to 10^decades are tried

    Notes
    -----
    The log likelihood is that of the innovations (Schweppe 1965).  Heavy tails are outliers to it: look at
    the share of the few largest before believing a small factor.
    """
    if estimator is None:
        from sequential.filters import ExtendedKalmanFilter

        estimator = ExtendedKalmanFilter()
    first = estimator.solve(problem)
    search = _Search(accepted_only(problem, first), estimator, decades)
    found = [search.best(scaling) for scaling in scalings(problem.model)]
    found.append(search.together())
    ranked = tuple(sorted(found, key=lambda c: -c.gain))
    best = ranked[0]
    rival = next((c for c in ranked if c.family != best.family), None)
    clear = rival is None or best.gain - rival.gain >= CLEAR
    return Blame(ranked, best if best.gain >= WORTH else None, clear, search.runs)


class _Search:
    """One problem, filtered again and again."""

    def __init__(self, problem: Problem, estimator: Estimator, decades: float) -> None:
        self.problem, self.estimator, self.decades = problem, estimator, decades
        self.runs = 1
        self.base = estimator.solve(problem)
        self.level = _likelihood(self.base, 1.0)

    def evaluate(self, scaling: Scaling, exponent: float) -> tuple[float, Run | None, float]:
        """Log likelihood, run and unit at a factor of 10^exponent; -inf where the filter cannot go on."""
        self.runs += 1
        try:
            model, unit = scaling.apply(self.problem.model, 10.0**exponent)
            run = self.estimator.solve(replace(self.problem, model=model))
        except (FactorlabError, np.linalg.LinAlgError):
            return -np.inf, None, 1.0
        value = _likelihood(run, unit)
        return (value, run, unit) if np.isfinite(value) else (-np.inf, None, 1.0)

    def best(self, scaling: Scaling) -> Candidate:
        """Try factors half a decade apart, then close in on the best by golden sections."""
        grid = np.arange(-self.decades, self.decades + COARSE / 2.0, COARSE)
        known = {0.0: self.level}
        for exponent in grid[grid != 0.0]:
            known[float(exponent)] = self.evaluate(scaling, float(exponent))[0]
        top = max(known, key=lambda e: known[e])
        low, high = max(top - COARSE, -self.decades), min(top + COARSE, self.decades)
        golden = (5.0**0.5 - 1.0) / 2.0
        while high - low > FINE:
            left, right = high - golden * (high - low), low + golden * (high - low)
            for exponent in (left, right):
                if exponent not in known:
                    known[exponent] = self.evaluate(scaling, exponent)[0]
            low, high = (low, right) if known[left] >= known[right] else (left, high)
        top = max(known, key=lambda e: known[e])
        value, run, unit = self.evaluate(scaling, top)
        if run is None:
            return Candidate(scaling.name, scaling.family, 1.0, 0.0, _nis(self.base, 1.0))
        return Candidate(scaling.name, scaling.family, 10.0**top, value - self.level, _nis(run, unit))

    def together(self) -> Candidate:
        """Every covariance by one factor: the estimates stay, and the factor has a closed form."""
        seen = self.base.innovations.values()
        count = sum(int(i.dof().sum()) for i in seen)
        total = sum(float(i.nis().sum()) for i in seen)
        factor = (total / count) ** 0.5 if count and total > 0.0 else 1.0
        gain = _likelihood(self.base, factor) - self.level
        return Candidate(TOGETHER, TOGETHER, factor, gain, _nis(self.base, factor))


def _likelihood(run: Run, unit: float) -> float:
    return sum(log_likelihood(innovations, unit) for innovations in run.innovations.values())


def _nis(run: Run, unit: float) -> dict[str, float]:
    return {
        name: float(i.nis().mean()) / unit**2 if len(i.t) else float("nan")
        for name, i in run.innovations.items()
    }
