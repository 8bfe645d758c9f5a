"""Measurements without a native factor inside an engine that grows: linearised by us, and anew when needed.

Each becomes a `LinearContainerFactor`, which is C++ through and through.  An engine relinearises its own
factors by its threshold; these are taken out and put back by the same threshold, all of a group in one
vectorised pass.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.slam.rows import GroupRows
from factorlab.graph.slam.variables import SHIFT, keys_of, read_all, require_type
from sequential.model import Loss
from sequential.slam import SlamProblem

__all__ = ["Containers"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Measurement = tuple[int, int]  # group, row
ABSENT = -1


class Containers:
    """The measurements of some groups as linear containers, and where each was linearised.

    Parameters
    ----------
    problem : measurements
    groups : which have no native factor
    loss : of groups that bring none of their own
    """

    def __init__(self, problem: SlamProblem, groups: list[int], loss: Loss | None = None) -> None:
        self.problem, self.groups = problem, groups
        self.rows = {g: GroupRows(problem.factors[g], loss) for g in groups}
        self.index = {g: np.asarray(problem.factors[g].index) for g in groups}
        self.about: dict[int, list[Array]] = {}
        self.place: dict[int, Ints] = {}  # number of the factor in the engine, or ABSENT
        self.types = {kind: require_type(m, kind) for kind, m in problem.kinds.items()}
        self.units: dict[int, Any] = {}
        for g in groups:
            group, count = problem.factors[g], len(problem.factors[g])
            self.about[g] = [np.full((count, m.size), np.nan) for m in group.model.manifolds]
            self.place[g] = np.full(count, ABSENT)

    def make(self, taken: list[Measurement], now: Callable[[int], Any]) -> list[Any]:
        """Factors of measurements, linearised at `now(key)`, in their order."""
        made: dict[Measurement, Any] = {}
        for g in {g for g, _ in taken}:
            rows = np.array([row for other, row in taken if other == g])
            for row, factor in zip(rows.tolist(), self._linearised(g, rows, now), strict=True):
                made[g, row] = factor
        return [made[one] for one in taken]

    def _linearised(self, g: int, rows: Ints, now: Callable[[int], Any]) -> list[Any]:
        group, at, keys, objects = self.problem.factors[g], [], [], []
        for k, slot in enumerate(group.slots):
            keys.append(keys_of(slot, self.index[g][rows, k]))
            objects.append([now(key) for key in keys[-1]])
            to_row = self.types[slot].to_row
            here = np.array([to_row(one) for one in objects[-1]], dtype=np.float64)
            at.append(here.reshape(len(rows), -1))
            self.about[g][k][rows] = at[-1]
        slopes, rights, _ = self.rows[g].linear(at, rows)
        ends = np.cumsum([0, *(m.dim for m in group.model.manifolds)]).tolist()
        unit, factors = self._unit(slopes.shape[1]), []
        for n, (slope, right) in enumerate(zip(slopes, rights, strict=True)):
            point, terms = gtsam.Values(), []
            for k, column in enumerate(keys):
                point.insert(column[n], objects[k][n])
                terms += [column[n], slope[:, ends[k] : ends[k + 1]]]
            factors.append(gtsam.LinearContainerFactor(gtsam.JacobianFactor(*terms, right, unit), point))
        return factors

    def _unit(self, size: int) -> Any:
        if size not in self.units:
            self.units[size] = gtsam.noiseModel.Unit.Create(size)
        return self.units[size]

    def placed(self, names: list[Measurement], numbers: list[int]) -> None:
        """Note the numbers that an engine gave to the factors of measurements, of whatever group."""
        for (g, row), number in zip(names, numbers, strict=True):
            if g in self.place:
                self.place[g][row] = number

    def absorbed(self, keys: list[int]) -> None:
        """Variables have left the engine; what joined them is part of its prior now."""
        for key in keys:
            kind, index = chr(key >> SHIFT), key & ((1 << SHIFT) - 1)
            for g in self.groups:
                for k, slot in enumerate(self.problem.factors[g].slots):
                    if slot == kind:
                        self.place[g][self.index[g][:, k] == index] = ABSENT

    def stale(self, source: Any, threshold: float) -> tuple[list[Measurement], list[int]]:
        """Measurements whose variables moved by more than a threshold since, and their numbers."""
        if not any((place != ABSENT).any() for place in self.place.values()):
            return [], []
        values = read_all(self.problem, source)
        names: list[Measurement] = []
        numbers: list[int] = []
        for g in self.groups:
            here = np.flatnonzero(self.place[g] != ABSENT)
            far = np.zeros(len(here), dtype=bool)
            group = self.problem.factors[g]
            for k, (slot, manifold) in enumerate(zip(group.slots, group.model.manifolds, strict=True)):
                now = values.at(slot, self.index[g][here, k])
                far |= np.abs(manifold.local(self.about[g][k][here], now)).max(axis=1) > threshold
            names += [(g, row) for row in here[far].tolist()]
            numbers += self.place[g][here[far]].tolist()
        return names, numbers
