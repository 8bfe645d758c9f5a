"""Q by the NIS: turn the process noise until innovations are as large as the filter says."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, FactorlabError, ModelError
from sequential.evaluate.bootstrap import block_bootstrap
from sequential.filters import ExtendedKalmanFilter
from sequential.history import Run
from sequential.log import SensorLog
from sequential.model import StateSpace
from sequential.run import Estimator
from sequential.timeline import prepare
from sequential.tuning.knobs import Knob
from sequential.tuning.likelihood import Posterior, innovation_log_likelihood
from sequential.tuning.result import Tuning, log_sigma
from sequential.tuning.robust import bounded_nis
from sequential.tuning.tune import require_knobs
from sequential.tuning.verdict import judge

__all__ = ["tune_by_nis"]

Array = NDArray[np.float64]
STRIDE = 0.5  # decades between the values that are tried until one is on the other side
REACH = 4.0  # decades: beyond this factor nothing is looked for
TINY = 1e-30  # stands for a NIS of nothing where logarithms are taken
CLOSE = 1e-3  # decades to which a crossing is found


def tune_by_nis(
    build: Callable[[Mapping[str, float]], StateSpace],
    knobs: Sequence[Knob],
    log: SensorLog,
    *,
    turn: Sequence[str] | None = None,
    sensors: Sequence[str] | None = None,
    estimator: Estimator | None = None,
    rng: np.random.Generator | None = None,
    max_gap: float | None = None,
) -> Tuning:
    """Multiply some knobs by one factor until the mean NIS is one per degree of freedom.

    With R known (from a recording at rest, say) this sets Q: too small a Q makes surprises that are too
    large.  The NIS of a sensor with a loss or a gate is bounded by it, so that outliers do not set Q.

    Parameters
    ----------
    build : from values by name to a model whose layout does not depend on them
    knobs : all that `build` wants
    turn : names of those to multiply, the process noise; all of them unless given
    sensors : whose innovations are looked at; all of them unless given
    estimator : a recursive filter; `ExtendedKalmanFilter()` unless given
    rng : resamples the NIS for the interval; seeded with zero unless given

    Raises
    ------
    ModelError
        where a name is not known, or the builder changes the layout.
    DataError, ModelError, SolverError
        what the estimator raises at the initial values.

    Notes
    -----
    Bar-Shalom, Li, Kirubarajan 2001, section 5.4, turned into a root of log NIS over the log of the factor.
    The interval holds the factors whose mean NIS lies inside the block bootstrap band about its expectation;
    where no factor reaches it, `converged` is False and `message` says on which side all of them are.
    """
    names = require_knobs(knobs)
    turned = list(names if turn is None else turn)
    if unknown := [name for name in turned if name not in names]:
        raise ModelError(f"no knob is called {unknown[0]!r}; there are {', '.join(names)}")
    if not turned:
        raise ModelError(f"tune_by_nis needs a knob to turn, one of {', '.join(names)}")
    began = time.perf_counter()
    initial = {knob.name: knob.initial for knob in knobs}
    problem = prepare(build(initial), log, None, max_gap)
    if sensors is not None and (wrong := [name for name in sensors if name not in problem.model.sensors]):
        raise ModelError(f"the model has no sensor {wrong[0]!r}; it has {', '.join(problem.model.sensors)}")
    posterior = Posterior(build, tuple(knobs), problem, estimator or ExtendedKalmanFilter())
    moves = np.array([1.0 / knob.decades if knob.name in turned else 0.0 for knob in knobs])
    search = _Search(posterior, moves, None if sensors is None else list(sensors))
    first, declared = posterior.run(0.0 * moves)
    best, message = search.crossing(0.0)
    last, tuned = posterior.run(best * moves)
    ends = (
        search.limits(best, last, tuned, rng or np.random.default_rng(0)) if not message else (-REACH, REACH)
    )
    limits = {name: _limits(initial[name], ends) for name in turned}
    open_ends = tuple(n for n in turned if limits[n][0] == 0.0 or not math.isfinite(limits[n][1]))
    values = posterior.values(best * moves)
    return Tuning(
        values=values,
        initial=initial,
        log_likelihood_before=innovation_log_likelihood(first, declared),
        log_likelihood_after=innovation_log_likelihood(last, tuned),
        evaluations=posterior.evaluations,
        seconds=time.perf_counter() - began,
        message=message,
        decades={name: log_sigma(*limits[name]) if name in limits else float("nan") for name in names},
        converged=not message,
        method="nis",
        units={knob.name: knob.unit for knob in knobs},
        limits=limits | {name: (initial[name], initial[name]) for name in names if name not in limits},
        unidentified=() if message else open_ends,
        notes=_notes([name for name in names if name not in turned]),
        before=judge(first.innovations, declared.sensors),
        after=judge(last.innovations, tuned.sensors),
        model=tuned,
    )


def _notes(held: list[str]) -> tuple[str, ...]:
    return (f"held as they were: {', '.join(held)}",) if held else ()


def _limits(initial: float, ends: tuple[float, float]) -> tuple[float, float]:
    """Values at two factors in decades; beyond reach an end is open."""
    low = initial * 10.0 ** ends[0] if ends[0] > -REACH else 0.0
    return low, initial * 10.0 ** ends[1] if ends[1] < REACH else math.inf


@dataclass(eq=False)
class _Search:
    """Log of the mean NIS per degree of freedom over the log of the factor."""

    posterior: Posterior
    moves: Array
    sensors: list[str] | None
    known: dict[float, float] = field(default_factory=dict)

    def level(self, decades: float) -> float:
        """log10 of the mean NIS; NaN where the filter fails."""
        if decades not in self.known:
            try:
                run, model = self.posterior.run(decades * self.moves)
                nis, rows = self.squares(run, model)
                value = math.log10(max(float(nis.sum() / rows.sum()), TINY))
            except (FactorlabError, np.linalg.LinAlgError):
                value = math.nan
            self.known[decades] = value
        return self.known[decades]

    def squares(self, run: Run, model: StateSpace) -> tuple[Array, Array]:
        """NIS and degrees of freedom (M,) of the readings looked at, in the order of their stamps."""
        chosen = self.sensors or list(run.innovations)
        each = [run.innovations[name] for name in chosen]
        t = np.concatenate([seen.t for seen in each])
        if not len(t):
            raise DataError(f"there is no reading of {', '.join(chosen)} whose NIS could be looked at")
        order = np.argsort(t, kind="stable")
        nis = np.concatenate([bounded_nis(run.innovations[n], model.sensors[n]) for n in chosen])
        rows = np.concatenate([seen.dof() for seen in each]).astype(np.float64)
        return nis[order], rows[order]

    def crossing(self, target: float, start: float = 0.0) -> tuple[float, str]:
        """Decades at which the level is `target`, and what is wrong where there are none."""
        here = self.level(start)
        if math.isnan(here):
            return start, "the filter fails at the initial values"
        side = 1.0 if here > target else -1.0  # more process noise, smaller NIS
        inside, ahead = start, start
        while abs(ahead + side * STRIDE) <= REACH + 1e-9:
            ahead += side * STRIDE
            value = self.level(ahead)
            if math.isnan(value):
                break
            if (value - target) * side <= 0.0:
                return self._between(inside, ahead, target), ""
            inside = ahead
        reached = 10.0 ** self.level(inside)
        word, way, advice = (
            (
                "above",
                "up",
                "R is too small, or outliers make the NIS: give the sensor a gate or a loss",
            )
            if side > 0
            else ("below", "down", "R is too large: take it from a recording at rest")
        )
        return start, (
            f"no value reaches the expected NIS: it stays {word} ({reached:.3g} of what is expected) with "
            f"the process noise turned {way} by {10.0 ** abs(inside):.3g}; {advice}"
        )

    def _between(self, a: float, b: float, target: float) -> float:
        """Root between two values of the factor, by false position with bisection (Illinois)."""
        fa, fb = self.level(a) - target, self.level(b) - target
        while abs(b - a) > CLOSE:
            middle = (a * fb - b * fa) / (fb - fa) if fb != fa else 0.5 * (a + b)
            low, high = min(a, b), max(a, b)
            margin = 0.05 * (high - low)
            middle = float(np.clip(middle, low + margin, high - margin))
            value = self.level(middle) - target
            if math.isnan(value):
                break
            if abs(value) < 1e-6:
                return middle
            if value * fa > 0.0:
                a, fa, fb = middle, value, 0.5 * fb
            else:
                b, fb, fa = middle, value, 0.5 * fa
        return 0.5 * (a + b)

    def limits(
        self, best: float, run: Run, model: StateSpace, rng: np.random.Generator
    ) -> tuple[float, float]:
        """Decades between which the mean NIS lies inside the bootstrap band about its expectation."""
        nis, rows = self.squares(run, model)
        size = max(1, round(len(nis) ** (1.0 / 3.0)))
        blocks = np.arange(len(nis)) // size
        if blocks[-1] < 2:
            return -REACH, REACH
        band = block_bootstrap(nis / rows.mean(), blocks, rng)
        low, high = (math.log10(max(end / band.value, 1e-3)) for end in (band.low, band.high))
        upper, lower = self.crossing(low, best), self.crossing(high, best)
        return -REACH if lower[1] else lower[0], REACH if upper[1] else upper[0]
