"""Gauss-Newton and Levenberg-Marquardt over whitened rows, with SciPy's sparse factorisation."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.graph.slam.checks import free_variable
from factorlab.graph.slam.rows import Rows
from factorlab.graph.solve import Solved
from sequential.errors import UnderConstrainedError
from sequential.slam import Values

__all__ = ["Normal", "solve_rows"]

Array = NDArray[np.float64]
HALVINGS = 12
ENOUGH = 1e-9  # share of (1 + cost): a smaller promise ends the iteration
SLACK = 1e-10
FREE = 1e-11  # a pivot below this share of its column's own information is rounding
LEAST_DAMPING, MOST_DAMPING = 1e-9, 1e12


class Normal:
    """Scaled normal equations of rows, factorised.

    Raises
    ------
    UnderConstrainedError
        where a pivot vanishes; the variable is named.
    """

    def __init__(self, rows: Rows, matrix: Any, damping: float = 0.0) -> None:
        from scipy.sparse import diags_array
        from scipy.sparse.linalg import splu

        self.rows = rows
        squared = np.asarray((matrix.multiply(matrix)).sum(axis=0)).ravel()
        empty = np.flatnonzero(squared <= 0.0)
        if len(empty):
            raise self._free(int(empty[0]))
        self.scale = 1.0 / np.sqrt(squared)
        scaled = matrix @ diags_array(self.scale)
        information = (scaled.T @ scaled).tocsc()
        information.eliminate_zeros()  # weights of zero leave none, and no fill
        if damping:
            information = information + damping * diags_array(np.ones(rows.columns)).tocsc()
        try:
            self.factor = splu(
                information,
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise self._free(loosest(information)) from error
        if not damping and np.abs(self.factor.U.diagonal()).min() < FREE:
            raise self._free(loosest(information))

    def _free(self, column: int) -> UnderConstrainedError:
        return UnderConstrainedError(free_variable(*self.rows.variable(column)))

    def step(self, matrix: Any, right: Array) -> Array:
        """Solve for a step."""
        found: Array = self.scale * self.factor.solve(self.scale * (matrix.T @ right))
        return found


def loosest(information: Any) -> int:
    """The column that moves most along the direction that an information matrix says least about."""
    from scipy.sparse import eye_array
    from scipy.sparse.linalg import splu

    size = information.shape[0]
    factor = splu((information + 1e-9 * eye_array(size)).tocsc(), permc_spec="MMD_AT_PLUS_A")
    direction = np.random.default_rng(0).standard_normal(size)
    for _ in range(4):  # inverse iteration
        direction = factor.solve(direction)
        direction /= np.linalg.norm(direction)
    return int(np.argmax(np.abs(direction)))


def solve_rows(rows: Rows, start: Values, max_iterations: int, *, damped: bool = False) -> Solved:
    """Gauss-Newton with step halving, damped (Marquardt 1963) from the beginning or once halving fails.

    Raises
    ------
    UnderConstrainedError
    """
    values, damping = start, 1e-4 if damped else 0.0
    matrix, right, cost = rows.linearise(values)
    decrement, iteration = float("inf"), 0
    while iteration < max_iterations:
        iteration += 1
        normal = Normal(rows, matrix, damping)
        step = normal.step(matrix, right)
        promised = float(step @ (matrix.T @ right)) - 0.5 * float(np.square(matrix @ step).sum())
        decrement = promised if not damping else decrement
        found = _descend(rows, values, cost, step, 1 if damping else HALVINGS)
        if found is None:
            damping = max(10.0 * damping, 1e-4)
            if damping > MOST_DAMPING:
                break
            continue
        values, reached = found
        gained, settled = cost - reached, promised <= ENOUGH * (1.0 + cost)
        damping = damping / 10.0 if damping > LEAST_DAMPING else 0.0
        matrix, right, cost = rows.linearise(values)
        if settled or (abs(gained) <= ENOUGH * (1.0 + cost) and not damping):
            break
    normal = Normal(rows, matrix)
    step = normal.step(matrix, right)
    decrement = 0.5 * float(step @ (matrix.T @ right))
    return Solved(values, cost, iteration, decrement)


def _descend(rows: Rows, values: Values, cost: float, step: Array, tries: int) -> tuple[Values, float] | None:
    """Where the step leads, halved until the cost does not rise; None where it always does."""
    for half in range(tries):
        trial = rows.moved(values, step / 2**half)
        reached = rows.cost(trial)
        if reached <= cost * (1.0 + SLACK) + SLACK:
            return trial, reached
    return None
