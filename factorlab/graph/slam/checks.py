"""What is wrong with a problem, said before or after a solve: missing variables, free ones, no frame."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from factorlab.graph.solve import WORDS
from sequential.errors import DataError, ModelError, UnderConstrainedError
from sequential.manifold import Vector
from sequential.slam import Factors, SlamProblem
from sequential.slam.beginnings import who
from sequential.slam.gauge import world_roles
from sequential.slam.models import Between

__all__ = ["check_problem", "free_variable"]

Ints = NDArray[np.int64]


def free_variable(kind: str, index: int) -> str:
    """The sentence about a variable that nothing fixes."""
    return (
        f"the graph leaves {kind}{index} ({WORDS.get(kind, 'a variable')}) free: no prior or measurement "
        "fixes it, or noises differ so much that rounding hides what does; add a prior, a measurement, or "
        "drop the variable"
    )


def check_problem(problem: SlamProblem, index: dict[str, Ints]) -> None:
    """Refuse what no solver can mend.

    Raises
    ------
    ModelError
        for readings that came without ids: a graph needs to know what they are of.
    DataError
        for a measurement of a variable that is not there, such as a loop closure to a missing pose.
    UnderConstrainedError
        for a variable with fewer numbers read than it has directions, and for variables that nothing ties to
        the world.
    """
    for group in problem.factors:
        if group.unknown is not None:
            msg = (
                f"{who(group)} came without ids of {group.slots[group.unknown]!r}, and a graph has to know "
                "which variable each measurement is of; associate them first, as EkfSlam does"
            )
            raise ModelError(msg)
    _check_missing(problem, index)
    _check_rank(problem, index)
    _check_tied(problem, index)


def _check_tied(problem: SlamProblem, index: dict[str, Ints]) -> None:
    """Every piece of the graph needs a measurement of one variable alone, unless others know the world."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    first, total = {}, 0
    for kind, known in index.items():
        first[kind], total = total, total + len(known)
    nodes = [
        [first[s] + np.searchsorted(index[s], np.asarray(g.index)[:, k]) for k, s in enumerate(g.slots)]
        for g in problem.factors
    ]
    pairs = [(one, other) for columns in nodes for one, other in pairwise(columns)]
    tail = np.concatenate([np.zeros(0, dtype=np.int64), *(one for one, _ in pairs)])
    head = np.concatenate([np.zeros(0, dtype=np.int64), *(other for _, other in pairs)])
    joined = coo_array((np.ones(len(tail)), (tail, head)), shape=(total, total))
    label = connected_components(joined, directed=False)[1]
    anchored = [label[columns[0]] for columns in nodes if len(columns) == 1]
    loose = np.flatnonzero(~np.isin(label, np.concatenate([np.zeros(0, dtype=np.int64), *anchored])))
    if len(loose) and _drifts(problem):
        kind = max((k for k in first if first[k] <= loose[0]), key=lambda k: first[k])
        count = int((label == label[loose[0]]).sum())
        msg = (
            f"nothing ties {kind}{index[kind][loose[0] - first[kind]]} and the {count - 1} variables joined "
            "to it to the world: all could be moved together; add a prior on one of them"
        )
        raise UnderConstrainedError(msg)


def _drifts(problem: SlamProblem) -> bool:
    """Whether the measurements between variables stay the same when all move together."""
    try:
        world_roles(problem)
    except ModelError:
        flat = all(isinstance(m, Vector) for m in problem.kinds.values())
        return flat and all(isinstance(g.model, Between) for g in problem.factors if len(g.slots) > 1)
    return True


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
