"""Measurements in the order in which they arrive, for engines that grow step by step.

A variable is begun by the first measurement that determines it, from what the engine believes then; a
measurement of variables that are not there yet waits for them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.slam.lowering import native_factors
from factorlab.graph.slam.variables import SHIFT, keys_of, require_type
from sequential.errors import ModelError, UnderConstrainedError
from sequential.model import Loss
from sequential.slam import SlamProblem
from sequential.slam.arrival import able, arrivals, who
from sequential.slam.models import Between

__all__ = ["Feed", "Step"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Measurement = tuple[int, int]  # group, row


@dataclass(slots=True)
class Step:
    """What one step brings: factors, and values of new variables."""

    number: int
    graph: Any
    values: Any
    new: dict[int, Any] = field(default_factory=dict)
    names: list[Measurement] = field(default_factory=list)  # of the factors


class Feed:
    """The measurements of a problem, as native factors, step by step.

    Parameters
    ----------
    problem : measurements
    believed : what the engine believes of a variable: `believed(key)` gives GTSAM's object
    loss : of groups that bring none of their own
    """

    def __init__(
        self, problem: SlamProblem, believed: Callable[[int], Any], loss: Loss | None = None
    ) -> None:
        self.problem, self.believed = problem, believed
        self.factors = [native_factors(group, loss) for group in problem.factors]
        self.keys = [
            list(zip(*(keys_of(s, np.asarray(g.index)[:, k]) for k, s in enumerate(g.slots)), strict=True))
            for g in problem.factors
        ]
        self.able = [{k for k in range(len(g.slots)) if len(g) and able(g, k)} for g in problem.factors]
        self.types = {ord(kind): require_type(m, kind) for kind, m in problem.kinds.items()}
        self.known: set[int] = set()
        self.gone: set[int] = set()
        self.dropped = 0
        self.waiting: list[Measurement] = []
        self.chained = [
            self.types[ord(g.slots[0])].to_gtsam(np.asarray(g.z)) if isinstance(g.model, Between) else None
            for g in problem.factors
        ]
        self.begun = self._given()

    def _given(self) -> dict[int, Any]:
        """Values that the problem brings, by key; each enters with its first measurement."""
        start = self.problem.start
        if start is None:
            return {}
        found: dict[int, Any] = {}
        for kind, index in start.index.items():
            objects = self.types[ord(kind)].to_gtsam(start.rows[kind])
            found.update(zip(keys_of(kind, index), objects, strict=True))
        return found

    def __iter__(self) -> Iterator[Step]:
        """One step for each number at which something arrives."""
        steps, groups, rows = (column.tolist() for column in arrivals(self.problem))
        for number, arrived in groupby(zip(steps, groups, rows, strict=True), key=lambda item: item[0]):
            step = Step(number, gtsam.NonlinearFactorGraph(), gtsam.Values())
            self._take(step, self.waiting + [(g, row) for _, g, row in arrived])
            yield step
        if self.waiting:
            raise UnderConstrainedError(self._stranded(*self.waiting[0]))

    def _take(self, step: Step, queue: list[Measurement]) -> None:
        """Add what can be added; a variable begun late lets others follow."""
        while queue:
            waiting, before = [], len(step.new)
            for g, row in queue:
                if not self._add(step, g, row):
                    waiting.append((g, row))
            if len(step.new) == before:
                self.waiting = waiting
                return
            queue = waiting
        self.waiting = []

    def _add(self, step: Step, g: int, row: int) -> bool:
        """Add one measurement, with the variable that it begins; False where it has to wait."""
        keys = self.keys[g][row]
        known = self.known
        missing = [k for k, key in enumerate(keys) if key not in known]
        if missing:
            if self.gone and not self.gone.isdisjoint(keys):
                self.dropped += 1
                return True
            if len(missing) == 1 and keys[missing[0]] not in self.begun and missing[0] in self.able[g]:
                self._enter(step, keys[missing[0]], self._place(step, g, row, missing[0], keys))
            elif all(keys[k] in self.begun for k in missing):
                for k in missing:
                    self._enter(step, keys[k], self.begun[keys[k]])
            else:
                return False
        step.graph.push_back(self.factors[g][row])
        step.names.append((g, row))
        return True

    def _enter(self, step: Step, key: int, value: Any) -> None:
        step.values.insert(key, value)
        step.new[key] = value
        self.known.add(key)

    def _now(self, step: Step, key: int) -> Any:
        """What is believed of a variable, or what it was begun with in this very step."""
        return step.new[key] if key in step.new else self.believed(key)

    def _place(self, step: Step, g: int, row: int, missing: int, keys: tuple[int, ...]) -> Any:
        """GTSAM's object for the variable that a measurement begins."""
        chained = self.chained[g]
        if chained is not None and type(chained[row]) is not np.ndarray:
            other = self._now(step, keys[1 - missing])
            return other.compose(chained[row] if missing == 1 else chained[row].inverse())
        group = self.problem.factors[g]
        values = [
            None
            if k == missing
            else np.array([self.types[key >> SHIFT].to_row(self._now(step, key))], dtype=np.float64)
            for k, key in enumerate(keys)
        ]
        found = group.model.place(missing, np.asarray(group.z)[row : row + 1], *values)
        return self.types[keys[missing] >> SHIFT].to_gtsam(found)[0]

    def forget(self, key: int) -> None:
        """A variable has left the engine for good."""
        self.known.discard(key)
        self.gone.add(key)

    def _stranded(self, g: int, row: int) -> str:
        group = self.problem.factors[g]
        names = [f"{s}{i}" for s, i in zip(group.slots, np.asarray(group.index)[row].tolist(), strict=True)]
        lost = [n for n, key in zip(names, self.keys[g][row], strict=True) if key not in self.known]
        return (
            f"measurement {row} of {who(group)} joins {' and '.join(names)}, and nothing says where "
            f"{' and '.join(lost)} is to begin; give it a value in problem.start, or add a prior"
        )


def require_native(problem: SlamProblem, feed: Feed, name: str) -> None:
    """Refuse models without native factors; raises `ModelError`."""
    lacking = [who(g) for g, f in zip(problem.factors, feed.factors, strict=True) if f is None]
    if lacking:
        msg = f"{name} needs native GTSAM factors, which {', '.join(lacking)} does not have; use BatchSlam()"
        raise ModelError(msg)
