"""Readings that come without an id get one: that of a landmark of the belief, or that of a new one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from sequential.slam.arrivals import UNKNOWN, Reading, linearised
from sequential.slam.association import NEW, REJECTED, Association, Pairings
from sequential.slam.joint_belief import JointBelief, Variable
from sequential.slam.problem import Factors, SlamProblem

__all__ = ["Identifier", "nameless"]

Array = NDArray[np.float64]


class Identifier:
    """Names the landmarks of readings; a new one gets an index above all that the problem knows."""

    def __init__(self, problem: SlamProblem, association: Association) -> None:
        self.problem, self.association = problem, association
        self.fresh = {kind: int(max(problem.indices(kind), default=-1)) + 1 for kind in problem.kinds}

    def name(
        self, readings: Sequence[Reading], belief: JointBelief, about: Mapping[Variable, Array]
    ) -> list[tuple[Reading, Reading | None]]:
        """Each reading without an id, with what it is taken for: None where it is rejected."""
        found: list[tuple[Reading, Reading | None]] = []
        for number in sorted({reading.group for reading in readings}):
            group, own = self.problem.factors[number], [r for r in readings if r.group == number]
            slot = group.unknown or 0
            known = belief.of_kind(group.slots[slot])
            chosen = self.association.choose(beside(group, own, slot, known, belief, about))
            for reading, choice in zip(own, chosen.tolist(), strict=True):
                landmark = self._landmark(group.slots[slot], known, choice)
                found.append((reading, None if landmark is None else named(reading, slot, landmark)))
        return found

    def _landmark(self, kind: str, known: Sequence[Variable], choice: int) -> Variable | None:
        if choice == REJECTED:
            return None
        if choice != NEW:
            return known[choice]
        self.fresh[kind] += 1
        return kind, self.fresh[kind] - 1


def nameless(reading: Reading) -> bool:
    """Whether a reading came without an id."""
    return any(index == UNKNOWN for _, index in reading.variables)


def named(reading: Reading, slot: int, landmark: Variable) -> Reading:
    """The reading with a landmark in its slot."""
    before, after = reading.variables[:slot], reading.variables[slot + 1 :]
    return reading._replace(variables=(*before, landmark, *after))


def beside(
    group: Factors,
    readings: Sequence[Reading],
    slot: int,
    known: Sequence[Variable],
    belief: JointBelief,
    about: Mapping[Variable, Array],
) -> Pairings:
    """Every reading of a group beside every landmark."""
    m, shape = group.model.measured.dim, (len(readings), len(known))
    pairs = [named(reading, slot, landmark) for reading in readings for landmark in known]
    if not pairs:
        columns = np.zeros((*shape, 0), dtype=np.int64)
        noise = np.zeros((len(readings), m, m))
        return Pairings(np.zeros((*shape, m)), np.zeros((*shape, m, 0)), columns, noise, belief.cov)
    rows = linearised(group, pairs, belief.value, about)
    columns = np.stack([belief.columns_of(pair.variables) for pair in pairs])
    return Pairings(
        rows.error.reshape(*shape, m),
        np.concatenate(rows.jacobians, axis=2).reshape(*shape, m, -1),
        columns.reshape(*shape, -1),
        rows.noise.reshape(*shape, m, m)[:, 0],
        belief.cov,
    )
