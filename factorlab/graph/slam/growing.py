"""A start for the batch, grown as the measurements arrive: place, and solve whenever the news is surprising.

Dead reckoning drifts without bound, and a graph begun from it at the end of a long way ends in a poor
minimum.  Between two solves here the drift is small; so is each correction, and Gauss-Newton makes it.  iSAM2
does the same at every step; a few dozen solves of everything so far come to the same place in a fraction of
its time.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import SolverError
from sequential.model import Loss
from sequential.slam import SlamProblem, Values
from sequential.slam.placing import Arrivals, Placing
from sequential.slam.revisits import chosen

__all__ = ["grown"]

Ints = NDArray[np.int64]
SURPRISE = 400.0  # χ² of a measurement over its freedom, where the variables it joins had begun before
APART = 5  # steps between two solves at least, and a twentieth of the way so far
ITERATIONS, LAST_ITERATIONS = 3, 20


def grown(problem: SlamProblem, loss: Loss | None = None) -> Values:
    """Values of all variables that measurements determine."""
    placing = Placing(problem)
    taken: list[list[int]] = [[] for _ in problem.factors]
    solved, surprised = 0, False
    for k in range(placing.steps):
        arrived = placing.step(k)
        for number, row in arrived.ready:
            taken[number].append(row)
        surprised = surprised or _surprising(placing, arrived)
        last = k == placing.steps - 1
        if (surprised and k - solved >= max(APART, k // 20)) or last:
            _solve(placing, taken, loss, LAST_ITERATIONS if last else ITERATIONS)
            solved, surprised = k, False
    if placing.begin_poorly():
        everything = [list(range(len(group))) for group in problem.factors]
        _solve(placing, everything, loss, LAST_ITERATIONS)
    return placing.values()


def _surprising(placing: Placing, arrived: Arrivals) -> bool:
    """Whether a measurement of variables that had begun before is far from what they say."""
    new, moving = set(arrived.begun), placing.problem.moving
    by_group: dict[int, list[int]] = {}
    for number, row in arrived.ready:
        by_group.setdefault(number, []).append(row)
    for number, rows in by_group.items():
        group = placing.problem.factors[number]
        index = np.asarray(group.index)[rows]
        still = [
            not any((kind, i) in new and kind not in moving for kind, i in zip(group.slots, one, strict=True))
            for one in index.tolist()
        ]
        index, at = index[still], np.array(rows)[still]
        if not len(at):
            continue
        values = [
            np.stack([placing.at(kind, i) for i in index[:, k].tolist()])
            for k, kind in enumerate(group.slots)
        ]
        error = group.model.errors(np.asarray(group.z)[at], *values)
        weighed = np.linalg.solve(group.covs()[at], error[..., None])[..., 0]
        if (np.einsum("ni,ni->n", error, weighed) > SURPRISE * error.shape[1]).any():
            return True
    return False


def _solve(placing: Placing, taken: list[list[int]], loss: Loss | None, iterations: int) -> None:
    """Solve what has arrived so far, and go on from there."""
    from factorlab.graph.slam.batch import BatchSlam

    problem = placing.problem
    groups = [
        chosen(group, np.array(rows)) for group, rows in zip(problem.factors, taken, strict=True) if rows
    ]
    so_far = replace(problem, factors=tuple(groups), start=None)
    solver = BatchSlam(placing.values(), loss=loss, covariance=False, check=False, max_iterations=iterations)
    try:
        found = solver.solve(so_far).values
    except SolverError:  # a native camera refuses points that a step has put behind it; ours waits
        damped = replace(solver, method="levenberg_marquardt", route="batched")
        found = damped.solve(so_far).values
    for kind, index in found.index.items():
        for i, row in zip(index.tolist(), found.rows[kind], strict=True):
            placing.correct(kind, i, row)
