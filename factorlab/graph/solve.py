"""Solving, and checking what was solved: GTSAM's complaints become sentences."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import gtsam

from factorlab.graph.keys import name_of
from sequential.errors import ModelError, NotConvergedError, SolverError, UnderConstrainedError
from sequential.timeline import Problem

__all__ = ["Solved", "certain_move", "newton_decrement", "optimise", "readable"]

ENOUGH = 1e-9  # share of (1 + cost): a smaller promise ends Gauss-Newton
ROUNDING = 1e-10
SETTLED = 1e-3  # share of (1 + cost) that one more Gauss-Newton step may still promise
WORDS = {
    "x": "the pose",
    "v": "the velocity",
    "b": "the IMU bias",
    "l": "the landmark",
    "s": "the static part",
}


def under_constrained(text: str, problem: Problem | None) -> str:
    """A sentence from GTSAM's message about an indeterminate system."""
    found = re.search(r"Symbol: (\w)(\d+)", text)
    if not found:
        key = re.search(r"variable\s+(\d+)", text)
        name = name_of(int(key.group(1))) if key else "some variable"
    else:
        name = "".join(found.groups())
    letter, digits = name[0], name[1:]
    what = WORDS.get(letter, "a variable")
    when = ""
    if problem is not None and digits.isdigit() and int(digits) < len(problem.t) and letter in "xvb":
        when = f" at {problem.t[int(digits)] * 1e-9:.3f} s"
    return (
        f"the graph leaves {name} ({what}{when}) free: no prior or measurement fixes it, or noises differ "
        "so much that rounding hides what does; add a prior, an absolute sensor, or process noise that "
        "ties it to its neighbours"
    )


def certain_move(problem: Problem, node: int) -> ModelError:
    """The error for a move without noise: a graph weighs each one by the inverse of its covariance."""
    return ModelError(
        f"the process noise up to node {node} ({problem.t[node] * 1e-9:.3f} s) is singular, so a graph "
        "cannot weigh that step; declare parts that do not move as static=(…), or give the others some noise"
    )


@contextmanager
def readable(problem: Problem | None = None) -> Iterator[None]:
    """Translate GTSAM's RuntimeErrors inside the block into the project's errors."""
    try:
        yield
    except RuntimeError as error:
        text = str(error)
        if "ndeterminant" in text or "underconstrained" in text:
            raise UnderConstrainedError(under_constrained(text, problem)) from error
        if "does not exist" in text:
            found = re.search(r'key "(\w+)"', text)
            name = found.group(1) if found else "a variable"
            msg = f"a factor names {name}, which has no initial value; insert one, or drop the factor"
            raise SolverError(msg) from error
        msg = f"GTSAM could not solve the graph: {text.strip().splitlines()[0]}"
        raise SolverError(msg) from error


@dataclass(frozen=True, slots=True)
class Solved:
    """Values at the optimum and how they were reached."""

    values: Any
    cost: float
    iterations: int
    decrement: float  # what one more Gauss-Newton step promises to take off the cost

    @property
    def settled(self) -> bool:
        """Whether one more step promises next to nothing."""
        return self.decrement <= SETTLED * (1.0 + self.cost)

    def message(self) -> str:
        """What is wrong, or nothing."""
        if self.settled:
            return ""
        return (
            f"the solver stopped after {self.iterations} iterations at cost {self.cost:.6g}, and one more "
            f"step would take off {self.decrement:.3g}; raise max_iterations or mend the start"
        )

    def checked(self) -> Solved:
        """The same; raises `NotConvergedError` unless settled."""
        if not self.settled:
            raise NotConvergedError(self.message())
        return self


def priced_step(linear: Any, *ordering: Any) -> tuple[Any, float]:
    """The Gauss-Newton step of a linear graph, and the cost that it promises to take off."""
    step = linear.optimize(*ordering)
    return step, float(linear.error(gtsam.VectorValues.Zero(step)) - linear.error(step))


def newton_decrement(linear: Any, problem: Problem | None = None, *ordering: Any) -> float:
    """Cost that one more Gauss-Newton step promises to take off; it does not depend on units.

    Solving for that step also proves full rank: Levenberg-Marquardt returns happily from a graph that
    leaves a variable free, with a gauge of its own making.

    Raises
    ------
    UnderConstrainedError
    """
    with readable(problem):
        return priced_step(linear, *ordering)[1]


def optimise(
    graph: Any,
    start: Any,
    problem: Problem | None = None,
    max_iterations: int = 50,
    *,
    check: bool = True,
    ordering: Any = None,
) -> Solved:
    """Gauss-Newton, and Levenberg-Marquardt from where it began if the cost would not fall.

    `ordering` is of the elimination, for a graph whose structure is known; GTSAM finds one otherwise.

    Raises
    ------
    UnderConstrainedError, NotConvergedError, SolverError
    """
    with readable(problem):
        solved = gauss_newton(graph, start, max_iterations, *([] if ordering is None else [ordering]))
        if solved is None:
            values, cost, iterations = damped(graph, start, max_iterations)
            solved = Solved(values, cost, iterations, newton_decrement(graph.linearize(values), problem))
    return solved.checked() if check else solved


def gauss_newton(graph: Any, values: Any, max_iterations: int, *ordering: Any) -> Solved | None:
    """Gauss-Newton until a step promises next to nothing; None where a step would raise the cost.

    The loop is ours and all the work GTSAM's: each solve proves full rank and prices its own step, so that
    no further solve is needed to judge the result.
    """
    cost, decrement, iteration = graph.error(values), float("inf"), 0
    while iteration < max_iterations and decrement > ENOUGH * (1.0 + cost):
        step, decrement = priced_step(graph.linearize(values), *ordering)
        values = values.retract(step)
        before, cost = cost, graph.error(values)
        iteration += 1
        if not cost <= before * (1.0 + ROUNDING) + ROUNDING:
            return None
    return Solved(values, cost, iteration, decrement)


def damped(graph: Any, start: Any, max_iterations: int) -> tuple[Any, float, int]:
    """Levenberg-Marquardt."""
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setMaxIterations(max_iterations)
    parameters.setRelativeErrorTol(1e-9)
    parameters.setAbsoluteErrorTol(1e-9)
    optimizer = gtsam.LevenbergMarquardtOptimizer(graph, start, parameters)
    values = optimizer.optimize()
    return values, optimizer.error(), optimizer.iterations()
