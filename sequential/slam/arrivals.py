"""Measurements in the order in which a filter gets them, and several of one model linearised together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sequential.slam.joint_belief import Variable
from sequential.slam.problem import Factors, SlamProblem

__all__ = ["Reading", "Rows", "arrivals", "linearised"]

Array = NDArray[np.float64]
UNKNOWN = -1


class Reading(NamedTuple):
    """One measurement: row `row` of group `group`, and the variables that it joins.

    The index of a variable that came without one is `UNKNOWN`.
    """

    group: int
    row: int
    variables: tuple[Variable, ...]


class Rows(NamedTuple):
    """N measurements of one group, linearised."""

    error: Array  # (N, m) GTSAM's sign
    jacobians: tuple[Array, ...]  # (N, m, d) by each slot
    noise: Array  # (N, m, m)


def arrivals(problem: SlamProblem) -> Iterator[tuple[int, list[Reading]]]:
    """Steps in order, each with its readings in the order of the groups."""
    at: dict[int, list[Reading]] = {}
    for number, group in enumerate(problem.factors):
        table = np.asarray(group.index).copy()
        if group.unknown is not None:
            table[:, group.unknown] = UNKNOWN
        for row, (step, index) in enumerate(zip(problem.steps[number].tolist(), table.tolist(), strict=True)):
            variables = tuple(zip(group.slots, index, strict=True))
            at.setdefault(step, []).append(Reading(number, row, variables))
    for step in sorted(at):
        yield step, at[step]


def linearised(
    group: Factors,
    readings: Sequence[Reading],
    value: Mapping[Variable, Array],
    about: Mapping[Variable, Array] | None = None,
) -> Rows:
    """Errors at `value`, Jacobians there or `about` other values, of readings of one group."""
    rows = [reading.row for reading in readings]
    z = np.asarray(group.z)[rows]
    noise = np.asarray(group.noise_cov)
    here = _stacked(readings, value)
    there = here if about is None else _stacked(readings, about)
    cov = noise[rows] if noise.ndim == 3 else np.broadcast_to(noise, (len(rows), *noise.shape))
    return Rows(group.model.errors(z, *here), group.model.jacobians(z, *there), cov)


def _stacked(readings: Sequence[Reading], value: Mapping[Variable, Array]) -> list[Array]:
    slots = zip(*(reading.variables for reading in readings), strict=True)
    return [np.stack([value[variable] for variable in slot]) for slot in slots]
