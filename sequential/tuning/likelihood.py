"""How probable a filter finds the readings, as a function of the knobs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ModelError, SolverError
from sequential.history import Run
from sequential.jacobians import unchecked
from sequential.model import StateSpace
from sequential.run import Estimator
from sequential.timeline import Problem
from sequential.tuning.knobs import Knob
from sequential.tuning.robust import robust_distance

__all__ = ["Posterior", "innovation_log_likelihood"]

Array = NDArray[np.float64]


def innovation_log_likelihood(run: Run, model: StateSpace) -> float:
    """Log probability of all readings, each given those before it (Schweppe 1965).

    A reading that a gate rejected counts with the NIS of its gate: rejecting is never cheaper than using,
    so that noise cannot be made small by throwing readings away.  A reading of a sensor with a loss counts
    through that loss (`robust_distance`), so that outliers do not raise the noise of all the others.
    """
    total = run.log_likelihood
    for name, seen in run.innovations.items():
        sensor = model.sensors[name]
        if sensor.loss is not None and seen.accepted.any():
            nis, rows = seen.nis()[seen.accepted], seen.dof()[seen.accepted]
            for dim in np.unique(rows).tolist():
                own = nis[rows == dim]
                total += 0.5 * float(np.sum(own - robust_distance(sensor.loss, own, dim)))
        if sensor.gate is None or seen.accepted.all():
            continue
        from scipy.special import chdtri

        cov, m = seen.cov[~seen.accepted], seen.dof()[~seen.accepted]
        log_det = np.linalg.slogdet(cov)[1]
        worst = chdtri(m, 1.0 - sensor.gate)
        total -= 0.5 * float(np.sum(log_det + worst + m * math.log(2.0 * math.pi)))
    return total


@dataclass(eq=False)
class Posterior:
    """Log posterior of the knobs; the schedule of the log is laid out once.

    The argument u (k,) counts prior standard deviations: log10(value) = log10(initial) + decades · u.

    Parameters
    ----------
    build : from values by name to a model; sensors, state and input must not depend on the values
    problem : any model of the family, laid out on the log
    """

    build: Callable[[Mapping[str, float]], StateSpace]
    knobs: tuple[Knob, ...]
    problem: Problem
    estimator: Estimator
    evaluations: int = 0
    known: dict[bytes, float] = field(default_factory=dict)

    def values(self, u: Array) -> dict[str, float]:
        """Values by name."""
        return {
            k.name: float(k.initial * 10.0 ** (k.decades * v)) for k, v in zip(self.knobs, u, strict=True)
        }

    def run(self, u: Array) -> tuple[Run, StateSpace]:
        """The filter's run and the model of these values; raises what the filter raises."""
        with unchecked():
            model = self.build(self.values(u))
        require_same_layout(self.problem.model, model)
        self.evaluations += 1
        return self.estimator.solve(replace(self.problem, model=model)), model

    def log_likelihood(self, u: Array) -> float:
        """Of the innovations; raises what the filter raises."""
        return innovation_log_likelihood(*self.run(u))

    def __call__(self, u: Array) -> float:
        """Log posterior up to a constant; -inf where the filter fails or the likelihood is not finite."""
        key = np.asarray(u, dtype=np.float64).tobytes()
        if key not in self.known:
            try:
                value = self.log_likelihood(u) - 0.5 * float(np.dot(u, u))
            except (DataError, ModelError, SolverError):
                value = -math.inf
            self.known[key] = value if math.isfinite(value) else -math.inf
        return self.known[key]


def require_same_layout(before: StateSpace, after: StateSpace) -> None:
    """Raise `ModelError` where one schedule cannot serve both models."""
    same = (
        before.manifold == after.manifold
        and list(before.sensors) == list(after.sensors)
        and before.input == after.input
        and before.start_ns == after.start_ns
    )
    if not same:
        raise ModelError(
            "build(values) returned a model of another layout: state, sensors (and their order), input and "
            "start must not depend on the knobs"
        )
