"""Adding a variable to a joint belief by the measurement that determines it, or by several together."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.slam.arrivals import Reading, linearised
from sequential.slam.determined import Reading as _Asked
from sequential.slam.determined import Several, determined
from sequential.slam.joint_belief import JointBelief, Variable
from sequential.slam.problem import SlamProblem

__all__ = ["place_by_several", "place_jointly"]

Array = NDArray[np.float64]
VIEWS = 3  # readings that a variable needs where none determines it alone


def place_jointly(
    belief: JointBelief,
    problem: SlamProblem,
    reading: Reading,
    missing: Variable,
    about: Mapping[Variable, Array],
    move: Callable[[Array], None],
) -> bool:
    """Add the missing variable of a reading; False where the reading does not determine it.

    The measurement says e(missing, others) = n with noise n, so that to first order
    d_missing = J_missing⁻¹ (n - e - J_others d_others), which gives its covariance and those with the others.
    Rows beyond its dimension (a marker's four corners are eight numbers for six) say something about the
    others; they are turned apart by a QR of the whitened Jacobian and make an update of their own.
    """
    group = problem.factors[reading.group]
    slot = reading.variables.index(missing)
    z = np.asarray(group.z)[reading.row : reading.row + 1]
    known = [None if v == missing else belief.value[v][None] for v in reading.variables]
    try:
        placed = group.model.place(slot, z, *known)[0]
    except ModelError:
        return False
    _add(belief, problem, [reading], missing, placed, about, move)
    return True


def place_by_several(
    belief: JointBelief,
    problem: SlamProblem,
    readings: Sequence[Reading],
    missing: Variable,
    about: Mapping[Variable, Array],
    move: Callable[[Array], None],
) -> bool:
    """Add a variable that several readings determine together; False where they do not, or not well yet.

    All of them are used up: what they say beyond the variable's place corrects the poses they were made from.
    """
    asked = []
    for reading in readings:
        group = problem.factors[reading.group]
        values = tuple(None if v == missing else belief.value[v][None] for v in reading.variables)
        row = slice(reading.row, reading.row + 1)
        slot = reading.variables.index(missing)
        asked.append(_Asked(group.model, slot, np.asarray(group.z)[row], values, group.covs()[row]))
    placed = determined(problem.kinds[missing[0]], asked, Several(at_least=VIEWS))
    if placed is None:
        return False
    _add(belief, problem, readings, missing, placed, about, move)
    return True


def _add(
    belief: JointBelief,
    problem: SlamProblem,
    readings: Sequence[Reading],
    missing: Variable,
    placed: Array,
    about: Mapping[Variable, Array],
    move: Callable[[Array], None],
) -> None:
    """Add a variable by readings linearised where it was placed."""
    others = list(dict.fromkeys(v for reading in readings for v in reading.variables if v != missing))
    values = {v: belief.value[v] for v in others} | {missing: placed}
    points = {v: about[v] for v in others} | {missing: placed}
    at, dim = belief.columns_of(others), problem.kinds[missing[0]].dim
    begin = dict(
        zip(others, np.cumsum([0, *(problem.kinds[v[0]].dim for v in others)]).tolist(), strict=False)
    )
    errors, by_missing, by_others = [], [], []
    for reading in readings:
        rows = linearised(problem.factors[reading.group], [reading], values, points)
        whiten = np.linalg.inv(np.linalg.cholesky(rows.noise[0]))
        wide = np.zeros((len(whiten), len(at)))
        for variable, slope in zip(reading.variables, rows.jacobians, strict=True):
            if variable == missing:
                by_missing.append(whiten @ slope[0])
            else:
                wide[:, begin[variable] : begin[variable] + slope.shape[2]] = whiten @ slope[0]
        errors.append(whiten @ rows.error[0])
        by_others.append(wide)
    error, jacobian = np.concatenate(errors), np.concatenate(by_others)
    turned, upper = np.linalg.qr(np.concatenate(by_missing), mode="complete")
    lift = np.linalg.solve(upper[:dim], turned[:, :dim].T)
    gain = -lift @ jacobian
    cross = gain @ belief.cov[at]
    value = problem.kinds[missing[0]].retract(placed, -lift @ error)  # no step where all is met exactly
    belief.add(missing, value, cross, gain @ cross[:, at].T + lift @ lift.T, first=placed)
    if len(error) > dim and len(at):
        rest = turned[:, dim:].T
        move(belief.update(at, rest @ jacobian, -rest @ error, np.eye(len(rest))))
