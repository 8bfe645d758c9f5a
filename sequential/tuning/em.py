"""Expectation-maximisation: whole noise covariances from a smoother, each step likelier."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FactorlabError, ModelError, NotPositiveDefiniteError
from sequential.filters import ExtendedKalmanFilter
from sequential.jacobians import unchecked
from sequential.log import SensorLog
from sequential.manifold import Product
from sequential.model import Gaussian, StateSpace
from sequential.models import Independent
from sequential.smoothers.pairs import SmoothedPairs, smoothed_pairs
from sequential.timeline import Problem, prepare
from sequential.tuning.em_result import Fit, as_tuning
from sequential.tuning.moments import Moments, moments, process_noise, scale_of
from sequential.tuning.result import Tuning
from sequential.tuning.scaling import process_parts, with_noise_cov, with_parts_scaled
from sequential.tuning.structure import Structure, fitted

__all__ = ["expectation_maximization"]

Array = NDArray[np.float64]
Prior = Literal["held", "mean", "both"]
SLACK = 1e-9  # relative: a likelihood that falls by no more than this has not fallen


def expectation_maximization(
    model: StateSpace,
    log: SensorLog,
    *,
    process: Structure = None,
    sensors: Mapping[str, Structure] | Structure = None,
    prior: Prior = "held",
    iterations: int = 300,
    tolerance: float = 1e-3,
    estimator: Any = None,
    intervals: bool = True,
    max_gap: float | None = None,
) -> Tuning:
    """Estimate the noise of process and sensors together, F and H held.

    Exact for linear models: every iteration raises the likelihood.  Curved models are linearised by filter
    and smoother; the iterations end where that no longer raises it.  `Tuning.model` has the new noise,
    `Tuning.matrices` the covariances, `Tuning.values` their standard deviations.

    Parameters
    ----------
    process : which entries of the process noise change: None (those that are not zero as declared), "full",
        "diagonal", "scale" (one factor), "held", or a mask (d, d) made of blocks.  A process that is declared
        by something else than a matrix (densities of its own) takes one factor, an `Independent` one for
        each of its parts
    sensors : the same for noise_cov, by sensor or for all
    prior : "held", "mean", or "both" (mean and covariance; one recording says little about the latter)
    iterations, tolerance : stop after so many, or when the log likelihood gains less than this in one
    estimator : a filter with a `keep` setting; `ExtendedKalmanFilter()` unless given
    intervals : 95 % ones, from the curvature of the likelihood; about as many filter passes as twice the
        square of the number of standard deviations
    max_gap : longest pause of the input stream that is bridged, s

    Raises
    ------
    ModelError
        for a structure that is none, a sensor with a gate or a loss (the noise of readings that are left out
        or weighed down has no exact update; `tune` takes them), or nothing to estimate.
    DataError, ModelError, SolverError
        what the estimator raises.

    Notes
    -----
    Shumway and Stoffer 1982, An approach to time series smoothing and forecasting using the EM algorithm;
    Dempster, Laird, Rubin 1977.  Intervals between nodes may vary: a density D adds D·dt, and each node tells
    of D by E[w wᵀ]/dt; a factor s on any Q by tr(Q⁺ E[w wᵀ]).  Components that are missing are completed by
    their expectation given those present, readings that are missing say nothing.
    """
    began = time.perf_counter()
    recursive = estimator or ExtendedKalmanFilter()
    require_plain(model)
    chosen = {name: sensors.get(name) if isinstance(sensors, Mapping) else sensors for name in model.sensors}
    if isinstance(sensors, Mapping) and (unknown := [n for n in sensors if n not in model.sensors]):
        raise ModelError(f"the model has no sensor {unknown[0]!r}; it has {', '.join(model.sensors)}")
    problem = prepare(model, log, None, max_gap)
    plan = _Plan.of(problem, process, chosen, prior)
    with unchecked():
        problem = replace(problem, model=plan.projected(model))
    history: list[float] = []
    best, message = problem, ""
    for turn in range(iterations + 1):
        try:
            pairs = smoothed_pairs(problem, recursive)
        except FactorlabError as error:
            if not history:
                raise
            message = f"stopped after {turn - 1} iterations: {error}"
            break
        level = pairs.forward.log_likelihood
        gain = level - history[-1] if history else np.inf
        if gain < -SLACK * max(1.0, abs(level)):
            message = f"stopped after {turn - 1} iterations: the linearised step lowered the likelihood"
            break
        history.append(level)
        best = problem
        if gain < tolerance:
            break
        if turn == iterations:
            message = f"still gaining {gain:.2g} in log likelihood after {iterations} iterations"
            break
        try:
            with unchecked():
                problem = replace(problem, model=plan.maximised(problem, pairs))
        except NotPositiveDefiniteError as error:  # readings without any scatter leave no noise at all
            message = f"stopped after {turn} iterations: {error}"
            break
    fit = Fit(model, best.model, tuple(history), message, plan.notes, plan.form)
    return as_tuning(fit, best, recursive, intervals=intervals, began=began)


def require_plain(model: StateSpace) -> None:
    """Raise `ModelError` where a sensor has a gate or a loss."""
    for name, sensor in model.sensors.items():
        what = "a gate" if sensor.gate is not None else "a loss" if sensor.loss is not None else ""
        if what:
            raise ModelError(
                f"sensor {name!r} has {what}, and this method takes its readings for Gaussian; "
                "use tune(), which counts them through it, or declare the sensor without"
            )


@dataclass(frozen=True, slots=True, eq=False)
class _Plan:
    """What changes from one iteration to the next."""

    form: str  # "density", "Q", "scale" or "held"
    field: str
    process: Structure
    sensors: Mapping[str, Structure]
    prior: Prior
    notes: tuple[str, ...]

    @classmethod
    def of(
        cls, problem: Problem, process: Structure, sensors: Mapping[str, Structure], prior: Prior
    ) -> _Plan:
        if prior not in {"held", "mean", "both"}:
            raise ModelError(f"prior is 'held', 'mean' or 'both', got {prior!r}")
        notes = []
        form, field = _form(problem, process)
        asked = not isinstance(process, str) or process not in {"scale", "held"}
        if form == "scale" and asked and process is not None:
            notes.append("the process noise is no matrix per second or per step: one factor was estimated")
        if form == "held" and not (isinstance(process, str) and process == "held"):
            notes.append(
                f"the process was held: nothing says how to scale a {type(problem.model.process).__name__}"
            )
        own = dict(sensors)
        if problem.noise.given is not None:
            own_noise = ~np.isnan(problem.noise.given[:, 0, 0])
            for index, name in enumerate(problem.model.sensors):
                if own_noise[problem.noise.sensor == index].any():
                    own[name] = "held"
                    notes.append(f"readings of {name} bring their own noise_cov, which was held")
        if (
            form == "held"
            and all(isinstance(s, str) and s == "held" for s in own.values())
            and prior == "held"
        ):
            raise ModelError("there is nothing to estimate: process, sensors and prior are all held")
        return cls(form, field, process, own, prior, tuple(notes))

    def projected(self, model: StateSpace) -> StateSpace:
        """The declared noise without what its structure forbids: from there on the likelihood only rises."""
        sensors = {}
        for name, sensor in model.sensors.items():
            cov = np.asarray(sensor.noise_cov)
            own = fitted(self.sensors[name], cov, cov, f"noise_cov of {name!r}")
            sensors[name] = with_noise_cov(sensor, own)
        process: Any = model.process
        if self.form in {"density", "Q"}:
            declared = _matrix(process, self.field, model.manifold.dim)
            own = fitted(self.process, declared, declared, "the process noise")
            process = replace(process, **{self.field: own})
        return replace(model, process=process, sensors=sensors)

    def maximised(self, problem: Problem, pairs: SmoothedPairs) -> StateSpace:
        """The model whose noise makes the smoothed states most probable."""
        found, model = moments(problem, pairs), problem.model
        sensors = {}
        for name, sensor in model.sensors.items():
            declared, second = np.asarray(sensor.noise_cov), found.readings[name]
            if len(second):
                fitting = fitted(self.sensors[name], declared, second.mean(axis=0), f"noise_cov of {name!r}")
                sensor = with_noise_cov(sensor, fitting)  # noqa: PLW2901 - the same sensor, another noise
            sensors[name] = sensor
        process = self._process(problem, pairs, found)
        return replace(model, process=process, sensors=sensors, prior=self._prior(model, pairs))

    def _process(self, problem: Problem, pairs: SmoothedPairs, found: Moments) -> Any:
        own = problem.model.process
        if self.form == "held" or not len(found.dt):
            return own
        if self.form == "scale":
            return with_parts_scaled(own, _factors(problem, process_noise(problem, pairs), found.process))
        declared = _matrix(own, self.field, problem.model.manifold.dim)
        second = found.process / (found.dt[:, None, None] if self.form == "density" else 1.0)
        fitting = fitted(self.process, declared, second.mean(axis=0), "the process noise")
        return replace(own, **{self.field: fitting})  # type: ignore[type-var]

    def _prior(self, model: StateSpace, pairs: SmoothedPairs) -> Gaussian:
        if self.prior == "held":
            return model.prior
        return Gaussian(pairs.mean[0], model.prior.cov if self.prior == "mean" else pairs.cov[0])


def _factors(problem: Problem, noise: Array, second: Array) -> dict[str, float]:
    """The factor on σ of each part of the process, by the directions of the state that it moves."""
    own, manifold, found = problem.model.process, problem.model.manifold, {}
    for name in process_parts(own):
        rows = slice(0, manifold.dim)
        if isinstance(own, Independent) and isinstance(manifold, Product):
            rows = manifold.tangent(name.partition(" ")[2])
        found[name] = scale_of(noise[:, rows, rows], second[:, rows, rows]) ** 0.5
    return found


def _matrix(process: Any, field: str, dim: int) -> Array:
    given = np.asarray(getattr(process, field), dtype=np.float64)
    return given * np.eye(dim) if given.ndim == 0 else np.diag(given) if given.ndim == 1 else given


def _form(problem: Problem, process: Structure) -> tuple[str, str]:
    """How the process noise is declared, and in which field."""
    own = problem.model.process
    if isinstance(process, str) and process == "held":
        return "held", ""
    single = bool((np.diff(problem.schedule.step_ptr)[1:] == 1).all())
    for field, form in (("density", "density"), ("noise_density", "density"), ("Q", "Q")):
        given = getattr(own, field, None)
        if given is not None and np.ndim(given) <= 2 and single and not isinstance(own, Mapping):
            return form, field
    return ("scale", "") if process_parts(own) else ("held", "")
