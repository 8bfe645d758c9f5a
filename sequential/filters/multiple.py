"""The interacting multiple model estimator: a system that switches between several models."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.compile import compiled
from sequential.errors import ModelError, ShapeError
from sequential.filters.extended import ExtendedKalmanFilter, IteratedExtendedKalmanFilter
from sequential.filters.kalman import KalmanFilter, require_linear
from sequential.filters.solution import masked, require_finite, require_solved
from sequential.filters.switching import require_family, stack, transitions_of
from sequential.history import Innovations, ModeHistory, Report, Run
from sequential.model import StateSpace
from sequential.timeline import Problem, sealed

__all__ = ["InteractingMultipleModel"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class InteractingMultipleModel:
    """One filter for each model, mixed as a Markov chain switches between them (Blom, Bar-Shalom 1988).

    >>> imm = sq.InteractingMultipleModel((cruising, turning), switching_rate=0.1)  # doctest: +SKIP
    >>> run = sq.run(imm, cruising, log)  # doctest: +SKIP
    >>> run.modes.probability  # doctest: +SKIP

    Parameters
    ----------
    models : StateSpaces on one manifold with the same sensors by name; processes, noises, gates, losses and
        priors may differ.  `run` is given any one of them, by which the log is laid out
    transition : (J, J) chances of switching from row to column at every node, or the chance of staying
    switching_rate : instead, (J, J) rates per second, rows adding up to zero, or the rate of leaving: the
        choice for irregular data, since it does not matter how many nodes a second has
    initial : (J,) probabilities at the prior; equal unless given
    filter : `KalmanFilter`, `ExtendedKalmanFilter` or `IteratedExtendedKalmanFilter` for every model
    keep : for smoothers, which keep what they need themselves

    Notes
    -----
    Means are mixed in the tangent at the likeliest model, covariances carried there.  Innovations of the run
    are those of the mixture.  A reading is gated by all models together: it is taken where any model's gate
    lets it in, since the probabilities of models that saw different readings could not be compared.  A
    robust loss acts within each model; the probabilities follow the Gaussian likelihoods.

    Raises
    ------
    ModelError, ShapeError
    """

    models: Sequence[StateSpace]
    transition: ArrayLike | None = None
    switching_rate: ArrayLike | None = None
    initial: ArrayLike | None = None
    filter: Any = field(default_factory=ExtendedKalmanFilter)
    keep: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "models", tuple(self.models))
        require_family(self.models)
        if not isinstance(self.filter, KalmanFilter | ExtendedKalmanFilter | IteratedExtendedKalmanFilter):
            raise ModelError(
                f"InteractingMultipleModel mixes extended Kalman filters, got {type(self.filter).__name__}; "
                "give filter=KalmanFilter(), ExtendedKalmanFilter() or IteratedExtendedKalmanFilter()"
            )
        if self.filter.form != "joseph":
            raise ModelError(
                f"InteractingMultipleModel mixes filters of form='joseph', got form={self.filter.form!r}"
            )
        if isinstance(self.filter, KalmanFilter):
            for model in self.models:
                require_linear(model)
        transitions_of(np.arange(2), len(self.models), self.transition, self.switching_rate)
        self.chances()

    @property
    def name(self) -> str:
        """`imm_` and the name of the filter."""
        return f"imm_{self.filter.name}"

    def chances(self) -> Array:
        """(J,) probabilities at the prior."""
        count = len(self.models)
        if self.initial is None:
            return np.full(count, 1.0 / count)
        given = np.array(self.initial, dtype=np.float64)
        if given.shape != (count,):
            raise ShapeError(f"initial holds one probability for each of {count} models, got {given.shape}")
        if not (np.all(given >= 0.0) and abs(given.sum() - 1.0) < 1e-9):
            raise ModelError(f"initial probabilities are zero or more and add up to 1, got {given}")
        return given

    def solve(self, problem: Problem) -> Run:
        """Filter the whole log; mode probabilities and the models' own beliefs are in `Run.modes`.

        Raises
        ------
        ModelError, NotPositiveDefiniteError, NotFiniteError
        """
        from sequential.kernels.multiple import filter_modes

        modes, alive = stack(problem, self.models)
        base, shapes = compiled(problem.model).tables, _shapes(problem, len(self.models))
        out: Any = (*map(np.zeros, shapes[:4]), np.zeros(shapes[4], dtype=np.int64))
        probability, mean, cov = np.zeros((len(problem.t), len(self.models))), *map(np.zeros, shapes[5:7])
        residual, residual_cov = map(np.zeros, shapes[7:])
        priors = [np.stack([getattr(m.prior, what) for m in self.models]) for what in ("mean", "cov")]
        transitions = transitions_of(problem.t, len(self.models), self.transition, self.switching_rate)
        began = time.perf_counter()
        log_likelihood, failed = filter_modes(
            base, modes, problem.schedule, *map(sealed, priors), sealed(self.chances()), sealed(transitions),
            self.iterations(), out, probability, mean, cov, residual, residual_cov,
        )  # fmt: skip
        seconds = time.perf_counter() - began
        for whole in alive[0]:
            whole.raise_failures()
        require_solved(problem, failed)
        require_finite(problem, mean)
        message = " ".join(whole.message() for whole in alive[0]).strip()
        rejected = int((out[4][0] == 0).sum())
        report = Report(self.name, seconds=seconds, message=message, rejected=rejected)
        innovations = _innovations(problem, residual, residual_cov, out[4][0])
        manifold, history = problem.model.manifold, ModeHistory(probability, out[0], out[1])
        return Run(problem.t, mean, cov, manifold, innovations, log_likelihood, report, modes=history)

    def iterations(self) -> int:
        """How often the filter of each model linearises an update."""
        return max(int(getattr(self.filter, "max_iterations", 1)), 1)


def _shapes(problem: Problem, count: int) -> list[tuple[int, ...]]:
    nodes, readings = len(problem.t), len(problem.reading_t)
    n, d, widest = problem.model.manifold.size, problem.model.manifold.dim, problem.schedule.z.shape[1]
    combined = [(nodes, n), (nodes, d, d), (readings, widest), (readings, widest, widest)]
    return [*[(count, *shape) for shape in combined], (count, readings), *combined]


def _innovations(
    problem: Problem, residual: Array, cov: Array, accepted: NDArray[np.int64]
) -> Mapping[str, Innovations]:
    found = {}
    for index, (name, sensor) in enumerate(problem.model.sensors.items()):
        rows = np.flatnonzero(problem.schedule.sensor == index)
        m = sensor.manifold.dim
        found[name] = Innovations(
            problem.reading_t[rows],
            problem.reading_row[rows],
            masked(problem, rows, residual[rows, :m]),
            cov[rows, :m, :m],
            accepted[rows].astype(bool),
        )
    return found
