"""Measurements in the order in which they arrive, for engines that grow step by step.

A variable is begun by the first measurement that determines it, or by several together, from what the engine
believes then; a measurement of variables that are not there yet waits for them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.slam.containers import Containers
from factorlab.graph.slam.lowering import lowered, native_factors
from factorlab.graph.slam.variables import SHIFT, keys_of, require_type
from sequential.errors import ModelError, UnderConstrainedError
from sequential.model import Loss
from sequential.slam import Factors, SlamProblem
from sequential.slam.beginnings import Able, in_order, who
from sequential.slam.determined import Reading, Several, determined
from sequential.slam.models import Between

__all__ = ["Feed", "Step"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Measurement = tuple[int, int]  # group, row
LOOK = 10  # steps between two looks at which containers are to be relinearised


@dataclass(slots=True)
class Step:
    """What one step brings: factors, and values of new variables."""

    number: int
    graph: Any = field(default_factory=gtsam.NonlinearFactorGraph)
    values: Any = field(default_factory=gtsam.Values)
    new: dict[int, Any] = field(default_factory=dict)
    names: list[Measurement] = field(default_factory=list)  # of the factors, as they stand in the graph
    loose: list[Measurement] = field(default_factory=list)  # those without a native factor
    replaced: list[int] = field(default_factory=list)  # numbers of factors that leave the engine


def calm_factors(group: Factors, loss: Loss | None) -> list[Any] | None:
    """Native factors that never raise, or None."""
    native = lowered(group.model)
    return None if native is None or native.raises else native_factors(group, loss)


class Feed:
    """The measurements of a problem as factors, step by step.

    Parameters
    ----------
    problem : measurements
    believed : what the engine believes of a variable: `believed(key)` gives GTSAM's object
    everything : `gtsam.Values` of all that the engine believes
    threshold : tangent step beyond which what has no native factor is linearised anew
    loss : of groups that bring none of their own
    """

    def __init__(
        self,
        problem: SlamProblem,
        believed: Callable[[int], Any],
        everything: Callable[[], Any],
        threshold: float,
        loss: Loss | None = None,
    ) -> None:
        self.problem, self.believed, self.everything = problem, believed, everything
        self.threshold = threshold
        self.factors = [calm_factors(group, loss) for group in problem.factors]
        loose = [g for g, made in enumerate(self.factors) if made is None]
        self.containers = Containers(problem, loose, loss) if loose else None
        self.keys = [
            list(zip(*(keys_of(s, np.asarray(g.index)[:, k]) for k, s in enumerate(g.slots)), strict=True))
            for g in problem.factors
        ]
        self.able = Able(problem)
        self.types = {ord(kind): require_type(m, kind) for kind, m in problem.kinds.items()}
        self.chained = [
            self.types[ord(g.slots[0])].to_gtsam(np.asarray(g.z)) if isinstance(g.model, Between) else None
            for g in problem.factors
        ]
        self.begun = self._given()
        self.known: set[int] = set()
        self.gone: set[int] = set()
        self.dropped = 0
        self.waiting: list[Measurement] = []
        self.again: dict[int, int] = {}
        # of poses that odometry alone has placed, since the first; only points that wait want to know
        self.drift: dict[int, Array] = {}
        self.drifts = any(len(g.slots) > 1 and not isinstance(g.model, Between) for g in problem.factors)
        self.newest: dict[int, Any] = {}  # what the engine was asked for last

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
        steps, groups, rows = (column.tolist() for column in in_order(self.problem))
        arrived = groupby(zip(steps, groups, rows, strict=True), key=lambda item: item[0])
        for count, (number, items) in enumerate(arrived):
            step = Step(number)
            self._take(step, self.waiting + [(g, row) for _, g, row in items])
            self._loosen(step, look=count % LOOK == LOOK - 1)
            yield step
        if self.waiting:
            raise UnderConstrainedError(self._stranded(*self.waiting[0]))

    def again_linearised(self, most: int) -> Iterator[Step]:
        """Steps that bring no news, until nothing has moved far since it was linearised."""
        for _ in range(most):
            step = Step(-1)
            self._loosen(step, look=True)
            yield step
            if self.containers is not None and not step.replaced:
                return

    def entered(self, step: Step, numbers: list[int]) -> None:
        """Note the numbers that the engine gave to the factors of a step."""
        if self.containers is not None:
            self.containers.placed(step.names, numbers)

    def forget(self, keys: list[int]) -> None:
        """Variables have left the engine for good."""
        self.known.difference_update(keys)
        self.gone.update(keys)
        if self.containers is not None:
            self.containers.absorbed(keys)

    def _take(self, step: Step, queue: list[Measurement]) -> None:
        """Add what can be added; a variable begun late lets others follow."""
        while queue:
            waiting, before = [], len(step.new)
            for g, row in queue:
                if not self._add(step, g, row):
                    waiting.append((g, row))
            self.waiting = queue = waiting
            if len(step.new) == before and not (waiting and self._determine(step)):
                return

    def _add(self, step: Step, g: int, row: int) -> bool:
        """Add one measurement, with the variable that it begins; False where it has to wait."""
        keys = self.keys[g][row]
        if not self.known.issuperset(keys):
            if self.gone and not self.gone.isdisjoint(keys):
                self.dropped += 1
                return True
            if not self._begin(step, g, row, keys):
                return False
        if self.drift and self.chained[g] is None:
            for key in keys:
                self.drift.pop(key, None)
        made = self.factors[g]
        if made is None:
            step.loose.append((g, row))
        else:
            step.graph.push_back(made[row])
            step.names.append((g, row))
        return True

    def _begin(self, step: Step, g: int, row: int, keys: tuple[int, ...]) -> bool:
        """Begin what a measurement joins and is not there yet; whether all of it is there now."""
        missing = [k for k, key in enumerate(keys) if key not in self.known]
        if self.begun:
            for k in [k for k in missing if keys[k] in self.begun]:
                self._enter(step, keys[k], self.begun[keys[k]])
                missing.remove(k)
        if len(missing) == 1 and self.able(g, missing[0]):
            placed = self._place(step, g, row, missing[0], keys)
            if placed is not None:
                self._enter(step, keys[missing.pop()], placed)
        return not missing

    def _loosen(self, step: Step, *, look: bool) -> None:
        """Linearise what has no native factor: what is new, and what has moved."""
        if self.containers is None:
            return
        if look:
            stale, step.replaced = self.containers.stale(self.everything(), self.threshold)
            step.loose += stale
        for factor in self.containers.make(step.loose, lambda key: self._now(step, key)):
            step.graph.push_back(factor)
        step.names += step.loose

    def _enter(self, step: Step, key: int, value: Any) -> None:
        step.values.insert(key, value)
        step.new[key] = value
        self.known.add(key)

    def _now(self, step: Step, key: int) -> Any:
        """What is believed of a variable, or what it was begun with in this very step."""
        if key in step.new:
            return step.new[key]
        return self.newest[key] if key in self.newest else self.believed(key)

    def _row(self, step: Step, key: int) -> Array:
        return np.array(self.types[key >> SHIFT].to_row(self._now(step, key)), dtype=np.float64)

    def _place(self, step: Step, g: int, row: int, missing: int, keys: tuple[int, ...]) -> Any | None:
        """GTSAM's object for the variable that a measurement begins; None where it does not after all."""
        chained = self.chained[g]
        if chained is not None and type(chained[row]) is not np.ndarray:
            other = self._now(step, keys[1 - missing])
            if self.drifts:
                noise = np.asarray(self.problem.factors[g].noise_cov)
                own = noise[row] if noise.ndim == 3 else noise
                self.drift[keys[missing]] = own + self.drift.get(keys[1 - missing], 0.0)
            return other.compose(chained[row] if missing == 1 else chained[row].inverse())
        group = self.problem.factors[g]
        values = [None if k == missing else self._row(step, key)[None] for k, key in enumerate(keys)]
        try:
            found = group.model.place(missing, np.asarray(group.z)[row : row + 1], *values)
        except ModelError:
            return None
        if not np.isfinite(found).all():
            return None
        return self.types[keys[missing] >> SHIFT].to_gtsam(found)[0]

    def _determine(self, step: Step) -> bool:
        """Begin what several waiting measurements determine together; whether there was any."""
        alone: dict[int, list[Measurement]] = {}
        for g, row in self.waiting:
            missing = [key for key in self.keys[g][row] if key not in self.known]
            if len(missing) == 1:
                alone.setdefault(missing[0], []).append((g, row))
        before = len(step.new)
        for key, names in alone.items():
            if len(names) < self.again.get(key, 2):
                continue
            self.again[key] = len(names) + max(1, len(names) // 4)
            manifold = self.problem.kinds[chr(key >> SHIFT)]
            found = determined(manifold, self._readings(step, key, names), Several())
            if found is not None:
                self._enter(step, key, self.types[key >> SHIFT].to_gtsam(found[None])[0])
        return len(step.new) > before

    def _readings(self, step: Step, key: int, names: list[Measurement]) -> list[Reading]:
        """Some of many measurements of one variable, joined where one model makes them in one slot."""
        few = np.unique(np.linspace(0, len(names) - 1, min(len(names), Several().at_most)).astype(int))
        joined: dict[tuple[int, int], list[int]] = {}
        for g, row in (names[i] for i in few.tolist()):
            joined.setdefault((g, self.keys[g][row].index(key)), []).append(row)
        readings = []
        for (g, slot), rows in joined.items():
            group = self.problem.factors[g]
            values = tuple(
                None if k == slot else np.stack([self._row(step, self.keys[g][row][k]) for row in rows])
                for k in range(len(group.slots))
            )
            drift = tuple(
                None if k == slot else self._drifts([self.keys[g][row][k] for row in rows])
                for k in range(len(group.slots))
            )
            z, cov = np.asarray(group.z)[rows], group.covs()[rows]
            readings.append(Reading(group.model, slot, z, values, cov, drift))
        return readings

    def _drifts(self, keys: list[int]) -> Array | None:
        """How uncertain poses (N) are relative to the last of them: (N, d, d), or None."""
        own = [self.drift.get(key) for key in keys]
        d = next((len(cov) for cov in own if cov is not None), 0)
        if not d or len(own) < 2:
            return None
        gathered = np.stack([np.zeros((d, d)) if cov is None else cov for cov in own])
        return np.asarray(gathered[-1] - gathered)

    def _stranded(self, g: int, row: int) -> str:
        group = self.problem.factors[g]
        names = [f"{s}{i}" for s, i in zip(group.slots, np.asarray(group.index)[row].tolist(), strict=True)]
        lost = [n for n, key in zip(names, self.keys[g][row], strict=True) if key not in self.known]
        return (
            f"measurement {row} of {who(group)} joins {' and '.join(names)}, and nothing says where "
            f"{' and '.join(lost)} is to begin; give it a value in problem.start, or add a prior"
        )
