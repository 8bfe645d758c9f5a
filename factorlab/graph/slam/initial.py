"""Where a graph begins, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.slam import SlamProblem, Values
from sequential.slam.beginnings import placed
from sequential.slam.initial import METHODS, initial_poses

__all__ = ["INITIAL", "given", "initial_values"]

Ints = NDArray[np.int64]
Beginning = Callable[[SlamProblem], Values]


def given(problem: SlamProblem) -> Values:
    """The problem's `start`, for every variable.

    Raises
    ------
    DataError
        naming the first variable that it lacks.
    """
    index = {kind: problem.indices(kind) for kind in problem.kinds}
    start = problem.start or Values({}, {})
    return Values(index, {kind: start.at(kind, known) for kind, known in index.items() if len(known)})


def from_poses(method: str) -> Beginning:
    """Poses by a method of `sequential.slam.initial`, everything else placed from them."""

    def begin(problem: SlamProblem) -> Values:
        poses, known = initial_poses(problem, method), problem.start or Values({}, {})
        index, rows = dict(known.index) | dict(poses.index), dict(known.rows) | dict(poses.rows)
        return placed(replace(problem, start=Values(index, rows)))

    return begin


def incremental(problem: SlamProblem) -> Values:
    """Grown as the measurements arrive, with solves on the way."""
    from factorlab.graph.slam.growing import grown

    return grown(problem)


INITIAL: dict[str, Beginning] = {
    "steps": placed,
    "given": given,
    "incremental": incremental,
    **{method: from_poses(method) for method in METHODS},
}


def initial_values(problem: SlamProblem, initial: str | Values | Beginning, index: dict[str, Ints]) -> Values:
    """Values of all variables of `index`.

    Raises
    ------
    ModelError
        for an unknown name.
    UnderConstrainedError, DataError
        where a variable has no beginning.
    """
    if isinstance(initial, Values):
        found = initial
    elif callable(initial):
        found = initial(problem)
    elif initial in INITIAL:
        found = INITIAL[initial](problem)
    else:
        msg = f"initial is one of {', '.join(INITIAL)}, a function or Values; got {initial!r}"
        raise ModelError(msg)
    return Values(dict(index), {kind: np.array(found.at(kind, known)) for kind, known in index.items()})
