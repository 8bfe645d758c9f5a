"""The route for models without native factors: linearise in one compiled pass, solve with GTSAM.

A Python factor inside a C++ optimiser costs time quadratic in the number of variables.  Here each node is
one JacobianFactor that holds its move and its readings, already whitened, and the loop is ours.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.keys import STATIC, X
from factorlab.graph.solve import Solved, certain_move, newton_decrement, readable
from sequential.compile import compiled
from sequential.errors import ModelError
from sequential.model import evaluate
from sequential.smoothers.leave_one_out import require_noise
from sequential.timeline import Problem, sealed

__all__ = ["ChainGraph", "static_directions"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

HALVINGS = 12
SLACK = 1e-6  # share of the cost by which a step may raise it


def static_directions(problem: Problem) -> tuple[Ints, Ints]:
    """Tangent directions that move and those that do not, from the model's `static` names."""
    model = problem.model
    fixed = np.zeros(model.manifold.dim, dtype=bool)
    for name in model.static:
        fixed[model.manifold.tangent(name)] = True  # type: ignore[attr-defined]
    return sealed(np.flatnonzero(~fixed)), sealed(np.flatnonzero(fixed))


def require_still(problem: Problem) -> None:
    """Refuse a static part that the process noise moves: a filter would let it walk, a graph would not.

    Raises
    ------
    ModelError
    """
    model, f = problem.model, problem.model.process_functions
    d = model.manifold.dim
    if f.noise is None or not model.static:
        return
    noise = evaluate(f.noise, model.prior.mean, np.zeros(max(f.inputs, 1)), 1.0, f.params, d * d)
    for name in model.static:
        part = model.manifold.tangent(name)  # type: ignore[attr-defined]
        if noise.reshape(d, d)[part, part].any():
            msg = (
                f"{name!r} is declared static, but the process gives it noise; make that zero, or let it move"
            )
            raise ModelError(msg)


@dataclass(eq=False)
class ChainGraph:
    """A problem as a linear factor graph, relinearised at will."""

    problem: Problem

    def __post_init__(self) -> None:
        from sequential.kernels.linearize import Rows

        self.moving, self.static = static_directions(self.problem)
        require_still(self.problem)
        require_noise(self.problem, "a factor graph cannot weigh them: give them some, or use a filter")
        self.whole = compiled(self.problem.model)
        dims = np.array([s.manifold.dim for s in self.problem.model.sensors.values()] or [0])
        plan, p = self.problem.schedule, len(self.moving)
        per_reading = dims[plan.sensor] if len(plan.sensor) else np.zeros(0, dtype=np.int64)
        readings = np.concatenate([[0], np.cumsum(per_reading)])[plan.reading_ptr]
        moves = np.concatenate(
            [[0], len(self.moving) + len(self.static) + p * np.arange(len(self.problem.t))]
        )
        first = (moves + readings).astype(np.int64)
        total = int(first[-1])
        shapes = ((total, p), (total, p), (total, max(1, len(self.static))), (total,))
        self.rows = Rows(sealed(first), *(np.empty(shape) for shape in shapes))
        self.units: dict[int, Any] = {}
        self.keys = [X(k) for k in range(len(self.problem.t))]
        names = [*self.keys, STATIC] if len(self.static) else self.keys
        self.ordering = gtsam.Ordering()
        for key in names:
            self.ordering.push_back(key)

    def linearise(self, trajectory: Array) -> float:
        """Fill the rows at a trajectory (K, n); returns the cost there."""
        from sequential.kernels.linearize import linearise_chain

        prior = self.problem.model.prior
        cost, singular = linearise_chain(
            self.whole.tables, self.problem.schedule, prior.mean, prior.cov,
            np.ascontiguousarray(trajectory), self.moving, self.static, self.rows,
        )  # fmt: skip
        self.whole.raise_failures()
        if singular >= 0:
            raise certain_move(self.problem, singular)
        return float(cost)

    def linear_graph(self) -> Any:
        """The rows as a `gtsam.GaussianFactorGraph`."""
        graph = gtsam.GaussianFactorGraph()
        first, before, here, fixed, right = self.rows
        ends, static = first.tolist(), len(self.static) > 0
        make, keys = gtsam.JacobianFactor, self.keys
        for k, key in enumerate(keys):
            a, b = ends[k], ends[k + 1]
            unit = self._unit(b - a)
            if k == 0:
                fixed_part = (STATIC, fixed[a:b]) if static else ()
                graph.push_back(make(key, here[a:b], *fixed_part, right[a:b], unit))
            elif static:
                graph.push_back(
                    make(keys[k - 1], before[a:b], key, here[a:b], STATIC, fixed[a:b], right[a:b], unit)
                )
            else:
                graph.push_back(make(keys[k - 1], before[a:b], key, here[a:b], right[a:b], unit))
        return graph

    def _unit(self, rows: int) -> Any:
        if rows not in self.units:
            self.units[rows] = gtsam.noiseModel.Unit.Create(rows)
        return self.units[rows]

    def step(self, graph: Any) -> Array:
        """Solve the linear graph: (K, d) tangent steps."""
        with readable(self.problem):
            solution = graph.optimize(self.ordering)
        nodes, p = len(self.keys), len(self.moving)
        delta = np.zeros((nodes, p + len(self.static)))
        delta[:, self.moving] = solution.vector(self.keys).reshape(nodes, p)
        if len(self.static):
            delta[:, self.static] = solution.at(STATIC)
        return delta

    def solve(self, start: Array, max_iterations: int, tolerance: float, *, check: bool = True) -> Solved:
        """Gauss-Newton with step halving, from a trajectory (K, n) to the one in `Solved.values`.

        Raises
        ------
        UnderConstrainedError, NotConvergedError, ModelError
        """
        trajectory, iteration = np.array(start), 0
        for name in self.problem.model.static:
            part = self.problem.model.manifold.storage(name)  # type: ignore[attr-defined]
            trajectory[:, part] = trajectory[-1, part]
        cost = self.linearise(trajectory)
        while iteration < max_iterations:
            iteration += 1
            delta = self.step(self.linear_graph())
            trajectory, reached = self._descend(trajectory, cost, delta)
            gained, cost = cost - reached, reached
            if np.abs(delta).max() < tolerance or abs(gained) < 1e-3 * tolerance * max(1e-12, cost):
                break
        decrement = newton_decrement(self.linear_graph(), self.problem, self.ordering)
        solved = Solved(trajectory, cost, iteration, decrement)
        return solved.checked() if check else solved

    def _descend(self, trajectory: Array, cost: float, delta: Array) -> tuple[Array, float]:
        """Go by the step, halved until the cost does not rise; stay where it will not.

        A process whose noise depends on the state changes its weights with every step, which can raise the
        cost a little on the way to where Gauss-Newton rests.
        """
        scale = 1.0
        for _ in range(HALVINGS):
            trial = self.problem.model.manifold.retract(trajectory, scale * delta)
            reached = self.linearise(trial)
            if reached <= cost + SLACK * (1.0 + cost):
                return trial, reached
            scale /= 2
        return trajectory, self.linearise(trajectory)
