"""Where every variable of a problem begins, quickly: for a batch that has no estimates on the way.

For every variable the first measurement that determines it is chosen, and the choices are followed at once:
chains of relative poses by pointer jumping, so that ten thousand poses take a dozen vectorised rounds.  What
no single measurement determines goes to `sequential.slam.placing`, one variable at a time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError, UnderConstrainedError
from sequential.manifold import Array
from sequential.slam.estimate import Values
from sequential.slam.models.groups import compose, inverse
from sequential.slam.models.relative import Between
from sequential.slam.placing import place_all
from sequential.slam.problem import Factors, SlamProblem

__all__ = ["Able", "Beginning", "in_order", "placed", "who"]

Ints = NDArray[np.int64]
Variable = tuple[str, int]


@dataclass(frozen=True, slots=True)
class Beginning:
    """How a variable is begun: by which measurement, as which of its slots."""

    group: int
    row: int
    slot: int


def who(group: Factors) -> str:
    """What a message calls a group."""
    return group.name or type(group.model).__name__


def in_order(problem: SlamProblem) -> tuple[Ints, Ints, Ints]:
    """Step, group and row of every measurement, in the order of steps, groups and rows; (M,) each."""
    steps = np.concatenate([np.zeros(0, dtype=np.int64), *problem.steps])
    groups = np.repeat(np.arange(len(problem.factors)), [len(group) for group in problem.factors])
    rows = np.concatenate([np.zeros(0, dtype=np.int64), *(np.arange(len(g)) for g in problem.factors)])
    order = np.lexsort((rows, groups, steps))
    return steps[order], groups[order], rows[order]


class Able:
    """Whether the model of a group can place one of its slots at all; found out when first asked."""

    def __init__(self, problem: SlamProblem) -> None:
        self.problem = problem
        self.known: dict[tuple[int, int], bool] = {}

    def __call__(self, g: int, slot: int) -> bool:
        """Of group number g."""
        if (g, slot) not in self.known:
            self.known[g, slot] = _able(self.problem.factors[g], slot)
        return self.known[g, slot]


def _able(group: Factors, slot: int) -> bool:
    known = [None if k == slot else m.identity()[None] for k, m in enumerate(group.model.manifolds)]
    for row in {0, len(group) // 2, len(group) - 1}:
        try:
            group.model.place(slot, np.asarray(group.z)[row : row + 1], *known)
        except ModelError:
            continue
        return True
    return False


def needs_several(problem: SlamProblem) -> bool:
    """Whether there is a kind of landmark that no single measurement places."""
    able, met, placeable = Able(problem), set(), set()
    for g, group in enumerate(problem.factors):
        for slot, kind in enumerate(group.slots):
            if len(group) and kind not in problem.moving:
                met.add(kind)
                if group.unknown == slot or able(g, slot):
                    placeable.add(kind)
    return bool(met - placeable)


def placed(problem: SlamProblem) -> Values:
    """Values of all variables: those of `problem.start`, others by the first measurements that place them.

    Raises
    ------
    UnderConstrainedError
        naming a variable that no measurements determine.
    """
    begun = _beginnings(problem)
    found = None if begun is None else _values(problem, begun)
    if found is not None and all(np.isfinite(rows).all() for rows in found.rows.values()):
        return found
    placing = place_all(problem)
    if placing.waiting:
        (kind, i), count = next(iter(placing.waiting.items()))
        what = (
            "the only measurement that names it does not say"
            if count == 1
            else (f"{count} measurements that name it do not say, even together,")
        )
        msg = (
            f"nothing says where {kind}{i} is to begin: {what} enough, or from variables that are not known "
            "either; give it a value in problem.start, or add a prior or more measurements"
        )
        raise UnderConstrainedError(msg)
    return placing.values()


def _values(problem: SlamProblem, begun: dict[Variable, Beginning]) -> Values | None:
    """What the beginnings lead to; None where a measurement does not determine its variable after all."""
    index = {kind: problem.indices(kind) for kind in problem.kinds}
    rows = {kind: np.full((len(index[kind]), problem.kinds[kind].size), np.nan) for kind in problem.kinds}
    if problem.start is not None:
        for kind, known in index.items():
            has = problem.start.has(kind, known)
            if has.any():
                rows[kind][has] = problem.start.at(kind, known[has])
    try:
        _follow(problem, index, rows, begun)
    except ModelError:
        return None
    for kind in index:
        rows[kind] = problem.kinds[kind].normalize(rows[kind]) if len(rows[kind]) else rows[kind]
    return Values(index, rows)


def _beginnings(problem: SlamProblem) -> dict[Variable, Beginning] | None:
    """How each variable without a start is begun; None where single measurements do not suffice."""
    known: set[Variable] = set()
    if problem.start is not None:
        known = {(kind, i) for kind, index in problem.start.index.items() for i in index.tolist()}
    columns = [np.asarray(group.index).tolist() for group in problem.factors]
    capable = Able(problem)
    begun: dict[Variable, Beginning] = {}
    waiting: list[tuple[int, int]] = []
    _, groups, rows = in_order(problem)
    order = list(zip(groups.tolist(), rows.tolist(), strict=True))
    while order:
        count, waiting = len(begun), []
        for g, row in order:
            group = problem.factors[g]
            missing = [
                (k, (slot, i))
                for k, (slot, i) in enumerate(zip(group.slots, columns[g][row], strict=True))
                if k != group.unknown and (slot, i) not in known
            ]
            if len(missing) == 1 and group.unknown is None and capable(g, missing[0][0]):
                slot, variable = missing[0]
                begun[variable] = Beginning(g, row, slot)
                known.add(variable)
            elif missing:
                waiting.append((g, row))
        if len(begun) == count:
            break
        order = waiting
    whole = {(kind, i) for kind in problem.kinds for i in problem.indices(kind).tolist()}
    return begun if whole <= known else None


def _follow(
    problem: SlamProblem, index: dict[str, Ints], rows: dict[str, Array], begun: dict[Variable, Beginning]
) -> None:
    """Fill rows by the beginnings: relative poses by pointer jumping, all others in vectorised rounds."""
    links: dict[str, list[tuple[int, int, int, int, int]]] = {kind: [] for kind in index}
    others: list[tuple[str, int, Beginning]] = []
    place = {kind: {i: n for n, i in enumerate(known.tolist())} for kind, known in index.items()}
    for (kind, i), beginning in begun.items():
        group = problem.factors[beginning.group]
        if isinstance(group.model, Between) and len(set(group.slots)) == 1:
            ends = np.asarray(group.index)[beginning.row]
            parent = place[kind][int(ends[1 - beginning.slot])]
            links[kind].append((place[kind][i], parent, beginning.group, beginning.row, beginning.slot))
        else:
            others.append((kind, i, beginning))
    chains = {kind: _Chain(problem, kind, found) for kind, found in links.items() if found}
    while True:
        for kind, chain in chains.items():
            chain.carry(rows[kind])
        if not others:
            break
        others = _round(problem, place, rows, others)


class _Chain:
    """Variables of one kind that are begun by relative poses: a forest, each node with its parent."""

    def __init__(self, problem: SlamProblem, kind: str, links: list[tuple[int, int, int, int, int]]) -> None:
        self.manifold = problem.kinds[kind]
        table = np.array(links)
        self.nodes, parent = table[:, 0], table[:, 1]
        count = int(table[:, :2].max()) + 1
        self.root = np.arange(count)
        self.relative = np.tile(self.manifold.identity(), (count, 1))
        self.root[self.nodes] = parent
        for g in np.unique(table[:, 2]):
            for slot in (0, 1):
                here = table[(table[:, 2] == g) & (table[:, 4] == slot)]
                z = np.asarray(problem.factors[g].z)[here[:, 3]]
                self.relative[here[:, 0]] = z if slot == 1 else inverse(self.manifold, z)
        while (above := self.root[self.root]).tolist() != self.root.tolist():
            self.relative = compose(self.manifold, self.relative[self.root], self.relative)
            self.root = above

    def carry(self, rows: Array) -> None:
        """Fill every node whose root is known."""
        roots = rows[self.root[self.nodes]]
        ready = np.isfinite(roots).all(axis=1) & ~np.isfinite(rows[self.nodes]).all(axis=1)
        here = self.nodes[ready]
        if len(here):
            rows[here] = compose(self.manifold, roots[ready], self.relative[here])


def _round(
    problem: SlamProblem,
    place: dict[str, dict[int, int]],
    rows: dict[str, Array],
    others: list[tuple[str, int, Beginning]],
) -> list[tuple[str, int, Beginning]]:
    """Place whatever has all its neighbours, one call for each group and slot; returns what still waits."""
    batches: dict[tuple[int, int], list[tuple[str, int, Beginning]]] = {}
    for item in others:
        batches.setdefault((item[2].group, item[2].slot), []).append(item)
    waiting: list[tuple[str, int, Beginning]] = []
    for (g, missing), items in batches.items():
        group = problem.factors[g]
        which = np.array([item[2].row for item in items])
        index = np.asarray(group.index)[which]
        values: list[Array | None] = [
            None if k == missing else rows[slot][[place[slot][i] for i in index[:, k].tolist()]]
            for k, slot in enumerate(group.slots)
        ]
        known = [value for value in values if value is not None]
        ready = np.ones(len(items), dtype=bool)
        for value in known:
            ready &= np.isfinite(value).all(axis=1)
        if ready.any():
            found = group.model.place(
                missing,
                np.asarray(group.z)[which[ready]],
                *(None if value is None else value[ready] for value in values),
            )
            slot = group.slots[missing]
            rows[slot][[place[slot][i] for i in index[ready, missing].tolist()]] = found
        waiting += [item for item, is_ready in zip(items, ready.tolist(), strict=True) if not is_ready]
    if len(waiting) == len(others):
        raise ModelError("a measurement left the variable that it was to begin unknown")
    return waiting
