"""What is wrong with a problem, said before or after a solve: missing variables, free ones, no frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from factorlab.graph.solve import WORDS
from sequential.errors import DataError, UnderConstrainedError
from sequential.slam import Factors, SlamProblem

__all__ = ["check_problem", "free_variable", "who"]

Ints = NDArray[np.int64]


def who(group: Factors) -> str:
    """What a message calls a group."""
    return group.name or type(group.model).__name__


def free_variable(kind: str, index: int) -> str:
    """The sentence about a variable that nothing fixes."""
    name = f"{kind}{index} ({WORDS.get(kind, 'a variable')})" if kind else "some variable"
    return (
        f"the graph leaves {name} free: no prior or measurement fixes it, or noises differ so much that "
        "rounding hides what does; add a prior, a measurement, or drop the variable"
    )


def check_problem(problem: SlamProblem, index: dict[str, Ints]) -> None:
    """Refuse what no solver can mend.

    Raises
    ------
    DataError
        for a measurement of a variable that is not there, such as a loop closure to a missing pose.
    UnderConstrainedError
        for a variable with fewer numbers read than it has directions.
    """
    _check_missing(problem, index)
    _check_rank(problem, index)


def _check_missing(problem: SlamProblem, index: dict[str, Ints]) -> None:
    for kind in problem.moving:
        known = index.get(kind, np.zeros(0, dtype=np.int64))
        given = problem.start is not None and kind in problem.start.index
        if given or len(known) < 2:
            continue
        gaps = np.flatnonzero(np.diff(known) > 1) + 1
        for lone in known[gaps].tolist():
            readers = [
                (group, row)
                for group in problem.factors
                for k, slot in enumerate(group.slots)
                if slot == kind and k != group.unknown
                for row in np.flatnonzero(np.asarray(group.index)[:, k] == lone).tolist()
            ]
            if len(readers) == 1:
                group, row = readers[0]
                raise DataError(missing_variable(group, row, kind, lone))


def missing_variable(group: Factors, row: int, kind: str, index: int) -> str:
    """The sentence about a measurement of something that is not there."""
    names = [f"{slot}{i}" for slot, i in zip(group.slots, np.asarray(group.index)[row].tolist(), strict=True)]
    what = WORDS.get(kind, "a variable")
    return (
        f"measurement {row} of {who(group)} joins {' and '.join(names)}, but {what} {kind}{index} is not "
        f"there: nothing else names it or {kind}{index - 1}; mend the number, or drop the measurement"
    )


def _check_rank(problem: SlamProblem, index: dict[str, Ints]) -> None:
    for kind, known in index.items():
        count = np.zeros(len(known), dtype=np.int64)
        for group in problem.factors:
            m = group.model.measured.dim
            for k, slot in enumerate(group.slots):
                if slot == kind and k != group.unknown and len(group):
                    np.add.at(count, np.searchsorted(known, np.asarray(group.index)[:, k]), m)
        short = np.flatnonzero(count < problem.kinds[kind].dim)
        if len(short):
            name, d = f"{kind}{known[short[0]]}", problem.kinds[kind].dim
            more = f" (and {len(short) - 1} more)" if len(short) > 1 else ""
            msg = (
                f"{name} ({WORDS.get(kind, 'a variable')}) has {d} directions and only {count[short[0]]} "
                f"numbers are read that name it{more}; add a prior or a measurement, or drop it"
            )
            raise UnderConstrainedError(msg)
