"""Where a graph begins, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.slam import SlamProblem, Values
from sequential.slam.arrival import placed

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


def by(method: str) -> Beginning:
    """Poses by a method of `sequential.slam.initial`, other variables placed from them."""

    def begin(problem: SlamProblem) -> Values:
        from sequential.slam.initial import initial_poses

        return placed(replace(problem, start=initial_poses(problem, method)))

    return begin


METHODS = ("lago", "chordal", "tree", "odometry")
INITIAL: dict[str, Beginning] = {"steps": placed, "given": given, **{name: by(name) for name in METHODS}}


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
