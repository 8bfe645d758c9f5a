"""All measurements at once: the maximum a posteriori values of every variable."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.slam.checks import check_problem
from factorlab.graph.slam.initial import initial_values
from factorlab.graph.slam.lowering import native_factors
from factorlab.graph.slam.marginals import marginals
from factorlab.graph.slam.marker_graph import MarkerGraph, marker_graph
from factorlab.graph.slam.rows import Rows
from factorlab.graph.slam.sparse import solve_rows
from factorlab.graph.slam.variables import insert_values, read_values, type_of
from factorlab.graph.solve import Solved, damped, newton_decrement, optimise, readable
from sequential.errors import ModelError
from sequential.history import Report
from sequential.model import Loss
from sequential.slam import SlamProblem, SlamRun, Values
from sequential.slam.models import MarkerCorners

__all__ = ["BatchSlam", "NativeGraph", "native_graph"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
METHODS = ("gauss_newton", "levenberg_marquardt", "dogleg")
ROUTES = ("auto", "native", "batched")


@dataclass(frozen=True, slots=True)
class BatchSlam:
    """Every variable of a `SlamProblem` at once.

    Parameters
    ----------
    initial : where to begin: `"steps"`, each variable placed by the first measurement that determines it;
        `"given"`, the problem's `start`; `"incremental"`, the same with solves on the way;
        `"lago"`, `"chordal"`, `"tree"` or `"odometry"`, poses by
        `sequential.slam.initial` and the rest placed from them; a function of the problem; or `Values`
    method : `"gauss_newton"`, which goes over to Levenberg-Marquardt where the cost would rise;
        `"levenberg_marquardt"`, or `"dogleg"`
    loss : robust loss of groups that bring none of their own; priors are never doubted
    covariance : marginals of all kinds, of the named kinds, or none; not part of the reported seconds
    route : `"native"` GTSAM factors, `"batched"` vectorised rows, or `"auto"`: native where every model can
    max_iterations : of the optimiser
    check : raise where the solver has not settled

    Raises
    ------
    ModelError
        for an unknown method or route.
    """

    initial: str | Values | Callable[[SlamProblem], Values] = "steps"
    method: str = "gauss_newton"
    loss: Loss | None = None
    covariance: bool | tuple[str, ...] = True
    route: str = "auto"
    max_iterations: int = 100
    check: bool = True
    name: str = "batch"

    def __post_init__(self) -> None:
        for field, value, known in (("method", self.method, METHODS), ("route", self.route, ROUTES)):
            if value not in known:
                msg = f"{field} is one of {', '.join(known)}, got {value!r}"
                raise ModelError(msg)

    def solve(self, problem: SlamProblem) -> SlamRun:
        """Begin, solve, check.

        Raises
        ------
        DataError
            for a measurement of a variable that is not there.
        UnderConstrainedError, NotConvergedError, ModelError
        """
        index = {kind: known for kind in problem.kinds if len(known := problem.indices(kind))}
        check_problem(problem, index)
        began = time.perf_counter()
        start = initial_values(problem, self.initial, index)
        placed = time.perf_counter()
        graph = None if self.route == "batched" else native_graph(problem, self.loss)
        if graph is None and self.route == "native":
            msg = "this problem has a model without a native GTSAM factor; use route='batched' or 'auto'"
            raise ModelError(msg)
        if graph is None:
            built, solved = self._batched(problem, start, index)
        else:
            built, solved = self._native(graph, start, index)
        finished = time.perf_counter()
        clock = {"initial_s": placed - began, "build_s": built - placed, "solve_s": finished - built}
        return self._run(problem, solved, index, clock, native=graph is not None)

    def _native(
        self, native: NativeGraph | MarkerGraph, start: Values, index: dict[str, Ints]
    ) -> tuple[float, Solved]:
        values, graph = native.insert(start), native.graph
        built = time.perf_counter()
        if self.method == "gauss_newton":
            order = native.ordering(values)
            solved = optimise(graph, values, None, self.max_iterations, check=False, ordering=order)
        else:
            with readable():
                found, cost, steps = (damped if self.method == "levenberg_marquardt" else dogleg)(
                    graph, values, self.max_iterations
                )
            solved = Solved(found, cost, steps, newton_decrement(graph.linearize(found)))
        back = native.read(solved.values, index)
        return built, Solved(back, solved.cost, solved.iterations, solved.decrement)

    def _batched(self, problem: SlamProblem, start: Values, index: dict[str, Ints]) -> tuple[float, Solved]:
        rows = Rows(problem, index, self.loss)
        built = time.perf_counter()
        return built, solve_rows(rows, start, self.max_iterations, damped=self.method != "gauss_newton")

    def _run(
        self,
        problem: SlamProblem,
        solved: Solved,
        index: dict[str, Ints],
        clock: dict[str, float],
        *,
        native: bool,
    ) -> SlamRun:
        if self.check:
            solved.checked()
        details = {
            **clock,
            "chi2": 2.0 * solved.cost,
            "newton_decrement": solved.decrement,
            "measurements": float(problem.count),
            "native": float(native),
        }
        report = Report(
            self.name,
            solved.settled,
            solved.iterations,
            seconds=sum(clock.values()),
            cost=solved.cost,
            message=solved.message(),
            details=details,
        )
        covs = marginals(problem, solved.values, asked=self.covariance, loss=self.loss)
        return SlamRun(solved.values, covs, dict(problem.kinds), report)


class NativeGraph:
    """A problem as a native graph, variable for variable."""

    def __init__(self, problem: SlamProblem, graph: Any) -> None:
        self.problem, self.graph = problem, graph

    def ordering(self, values: Any) -> Any:
        """Whatever GTSAM finds."""
        return None

    def insert(self, values: Values) -> Any:
        """As `gtsam.Values`."""
        return insert_values(self.problem, values)

    def read(self, source: Any, index: dict[str, Ints]) -> Values:
        """Back to ours."""
        return read_values(self.problem, source, index)


def native_graph(problem: SlamProblem, loss: Loss | None = None) -> NativeGraph | MarkerGraph | None:
    """The measurements as a `gtsam.NonlinearFactorGraph`, or None where a piece has no native form."""
    if any(type_of(problem.kinds[kind]) is None for kind in problem.kinds):
        return None
    if any(isinstance(group.model, MarkerCorners) for group in problem.factors):
        return marker_graph(problem, loss)
    graph = gtsam.NonlinearFactorGraph()
    for group in problem.factors:
        factors = native_factors(group, loss)
        if factors is None:
            return None
        for factor in factors:
            graph.push_back(factor)
    return NativeGraph(problem, graph)


def dogleg(graph: Any, start: Any, max_iterations: int) -> tuple[Any, float, int]:
    """Powell's dogleg by GTSAM."""
    parameters = gtsam.DoglegParams()
    parameters.setMaxIterations(max_iterations)
    parameters.setRelativeErrorTol(1e-9)
    parameters.setAbsoluteErrorTol(1e-9)
    optimizer = gtsam.DoglegOptimizer(graph, start, parameters)
    values = optimizer.optimize()
    return values, optimizer.error(), optimizer.iterations()
