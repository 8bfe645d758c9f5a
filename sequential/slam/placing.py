"""Where variables begin: one after the other, as the measurements that determine them arrive.

A graph needs a value of every variable to be linearised at, and a poor one leads to a poor minimum: Victoria
Park from landmarks at the origin ends thirty times above the best cost.  Here a variable begins at the first
measurement that determines it (`FactorModel.place`); where each single one leaves it free, as one picture
leaves the depth of a point, measurements wait until several together determine it well (`determined`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.slam.determined import Reading, Several, determined
from sequential.slam.estimate import Values
from sequential.slam.problem import SlamProblem

__all__ = ["Arrivals", "Placing", "place_all"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
LOOSE = 2.0  # bend of a variable that begins only because nothing more will come
Row = tuple[int, int]  # number of the group, row in it


@dataclass(frozen=True, slots=True)
class Arrivals:
    """What a step brings: variables that begin, and measurements all of whose variables have begun."""

    begun: tuple[tuple[str, int], ...]
    ready: tuple[Row, ...]


@dataclass(slots=True)
class Placing:
    """The variables of a problem in the making; an estimator calls `step` for 0, 1, 2, ...

    Parameters
    ----------
    problem : its `start` is taken for variables that have one
    several : when several measurements together determine a variable well enough
    """

    problem: SlamProblem
    several: Several = field(default_factory=Several)
    _values: dict[str, dict[int, Array]] = field(init=False, repr=False)
    _waiting: dict[tuple[str, int], list[Row]] = field(init=False, default_factory=dict, repr=False)
    _drift: dict[tuple[str, int], Array] = field(init=False, default_factory=dict, repr=False)
    _again: dict[tuple[str, int], int] = field(init=False, default_factory=dict, repr=False)
    _rows: list[list[Row]] = field(init=False, repr=False)
    _index: list[Ints] = field(init=False, repr=False)
    _z: list[Array] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._values = {kind: {} for kind in self.problem.kinds}
        last = max((int(steps.max()) for steps in self.problem.steps if len(steps)), default=-1)
        self._rows = [[] for _ in range(last + 1)]
        for number, steps in enumerate(self.problem.steps):
            for row, step in enumerate(steps.tolist()):
                self._rows[step].append((number, row))
        self._index = [np.asarray(group.index) for group in self.problem.factors]
        self._z = [np.asarray(group.z) for group in self.problem.factors]

    @property
    def steps(self) -> int:
        """How many steps there are."""
        return len(self._rows)

    @property
    def waiting(self) -> Mapping[tuple[str, int], int]:
        """Variables that no measurements have determined yet, and how many wait for each."""
        return {who: len(rows) for who, rows in self._waiting.items() if rows}

    def at(self, kind: str, index: int) -> Array:
        """Where a variable is (size,): as it was placed, or as an estimator has said since."""
        return self._values[kind][index]

    def correct(self, kind: str, index: int, value: Array) -> None:
        """Take an estimator's better value; what is placed from now on is placed by it."""
        self._values[kind][index] = value
        self._drift.pop((kind, index), None)

    def values(self) -> Values:
        """All variables that have begun."""
        index = {kind: np.array(sorted(rows), dtype=np.int64) for kind, rows in self._values.items() if rows}
        rows = {kind: np.stack([self._values[kind][i] for i in which]) for kind, which in index.items()}
        return Values(index, rows)

    def step(self, k: int) -> Arrivals:
        """What arrives at step `k`: variables begin, and measurements become ready, also older ones."""
        begun: list[tuple[str, int]] = []
        ready: list[Row] = []
        rows, before = list(self._rows[k]), -1
        while rows and len(rows) != before:
            before = len(rows)
            rows = [row for row in rows if not self._take(row, begun, ready)]
        for row in rows:
            self._wait(row)
        for who in {self._missing(row)[0] for row in rows if len(self._missing(row)) == 1}:
            self._determine(who, begun, ready)
        return Arrivals(tuple(begun), tuple(ready))

    def begin_poorly(self) -> bool:
        """Begin what still waits wherever its measurements fit at all; whether that began anything.

        For the end of a recording: more will not come, and poses are as good as they get.
        """
        begun: list[tuple[str, int]] = []
        several = self.several
        self.several = replace(several, bend=LOOSE, margin=0.0)
        self._again.clear()
        for who in list(self._waiting):
            self._determine(who, begun, [])
        self.several = several
        return bool(begun)

    def _take(self, row: Row, begun: list[tuple[str, int]], ready: list[Row]) -> bool:
        """Whether a measurement is ready, after placing by it what it determines alone."""
        missing = self._missing(row)
        for who in list(missing):
            if self._given(who):
                begun.append(who)
                missing.remove(who)
        if len(missing) == 1 and self._place(row, missing[0]):
            self._begin(missing.pop(), begun, ready)
        if missing:
            return False
        ready.append(row)
        return True

    def _missing(self, row: Row) -> list[tuple[str, int]]:
        """Variables of a measurement that have not begun."""
        group = self.problem.factors[row[0]]
        named = zip(group.slots, self._index[row[0]][row[1]].tolist(), strict=True)
        unknown = group.unknown
        return [
            (kind, i)
            for slot, (kind, i) in enumerate(named)
            if slot != unknown and i not in self._values[kind]
        ]

    def _given(self, who: tuple[str, int]) -> bool:
        """Whether the problem's own start has the variable."""
        start, (kind, index) = self.problem.start, who
        if start is None or not start.has(kind, np.array([index]))[0]:
            return False
        self._values[kind][index] = start.at(kind, np.array([index]))[0]
        return True

    def _place(self, row: Row, who: tuple[str, int]) -> bool:
        """Place a variable by one measurement, where that one determines it."""
        reading = self._reading(row[0], [row[1]], who)
        try:
            placed = reading.model.place(reading.missing, reading.z, *reading.values)
        except ModelError:
            return False
        if not np.isfinite(placed).all():
            return False
        self._values[who[0]][who[1]] = placed[0]
        self._note_drift(row, who)
        return True

    def _note_drift(self, row: Row, who: tuple[str, int]) -> None:
        """A pose by odometry is as uncertain as the one before and the odometry together."""
        group = self.problem.factors[row[0]]
        if len(group.slots) == 2 and group.slots[0] == group.slots[1]:
            named = zip(group.slots, self._index[row[0]][row[1]].tolist(), strict=True)
            (other,) = (one for one in named if one != who)
            noise = np.asarray(group.noise_cov)
            step = noise[row[1]] if noise.ndim == 3 else noise
            self._drift[who] = step + self._drift.get(other, 0.0)

    def _reading(self, number: int, at: list[int], who: tuple[str, int]) -> Reading:
        """Measurements of a group as they speak of one variable, in the same slot of each."""
        group, index = self.problem.factors[number], self._index[number][at]
        slot = list(zip(group.slots, index[0].tolist(), strict=True)).index(who)
        drift = tuple(
            None if k == slot else self._drifts(kind, index[:, k]) for k, kind in enumerate(group.slots)
        )
        values = tuple(
            None if k == slot else np.stack([self._values[kind][i] for i in index[:, k].tolist()])
            for k, kind in enumerate(group.slots)
        )
        return Reading(group.model, slot, self._z[number][at], values, group.covs()[at], drift)

    def _drifts(self, kind: str, index: Ints) -> Array | None:
        """How uncertain variables (N) are relative to the last of them: (N, d, d), or None."""
        own = [self._drift.get((kind, i)) for i in index.tolist()]
        if all(cov is None for cov in own):
            return None
        d = self.problem.kinds[kind].dim
        gathered = np.stack([np.zeros((d, d)) if cov is None else cov for cov in own])
        return gathered[-1] - gathered if len(gathered) > 1 else None

    def _wait(self, row: Row) -> None:
        for who in self._missing(row):
            self._waiting.setdefault(who, []).append(row)

    def _determine(self, who: tuple[str, int], begun: list[tuple[str, int]], ready: list[Row]) -> None:
        """Place a variable by all measurements that wait for nothing but it, if they suffice."""
        rows = [row for row in self._waiting.get(who, []) if self._missing(row) == [who]]
        if who[1] in self._values[who[0]] or len(rows) < self._again.get(who, 0):
            return
        self._again[who] = len(rows) + max(1, len(rows) // 4)
        value = determined(self.problem.kinds[who[0]], self._readings(rows, who), self.several)
        if value is not None:
            self._values[who[0]][who[1]] = value
            self._begin(who, begun, ready)

    def _readings(self, rows: list[Row], who: tuple[str, int]) -> list[Reading]:
        """Some of many measurements, joined where one model makes them in one slot."""
        few = np.linspace(0, len(rows) - 1, min(len(rows), self.several.at_most)).astype(int)
        joined: dict[tuple[int, int], list[int]] = {}
        for number, at in (rows[i] for i in few):
            named = list(
                zip(self.problem.factors[number].slots, self._index[number][at].tolist(), strict=True)
            )
            joined.setdefault((number, named.index(who)), []).append(at)
        return [self._reading(number, at, who) for (number, _), at in joined.items()]

    def _begin(self, who: tuple[str, int], begun: list[tuple[str, int]], ready: list[Row]) -> None:
        """Note that a variable has begun, and free the measurements that waited for it."""
        begun.append(who)
        for row in self._waiting.pop(who, []):
            missing = self._missing(row)
            if not missing:
                ready.append(row)
            elif len(missing) == 1:
                self._determine(missing[0], begun, ready)


def place_all(problem: SlamProblem, several: Several | None = None) -> Placing:
    """Place everything in order of arrival; `values()` of the result holds what could be placed."""
    placing = Placing(problem, several or Several())
    for k in range(placing.steps):
        placing.step(k)
    return placing
