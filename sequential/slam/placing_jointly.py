"""Adding a variable to a joint belief by the measurement that determines it."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.slam.arrivals import Reading, linearised
from sequential.slam.joint_belief import JointBelief, Variable
from sequential.slam.problem import SlamProblem

__all__ = ["place_jointly"]

Array = NDArray[np.float64]


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
    manifold = problem.kinds[missing[0]]
    others = [v for v in reading.variables if v != missing]
    values = {v: belief.value[v] for v in others} | {missing: placed}
    points = {v: about[v] for v in others} | {missing: placed}
    rows = linearised(group, [reading], values, points)
    whiten = np.linalg.inv(np.linalg.cholesky(rows.noise[0]))
    error, by_missing = whiten @ rows.error[0], whiten @ rows.jacobians[slot][0]
    turned, upper = np.linalg.qr(by_missing, mode="complete")
    dim = manifold.dim
    lift = np.linalg.solve(upper[:dim], turned[:, :dim].T)
    by_others = [whiten @ j[0] for k, j in enumerate(rows.jacobians) if k != slot]
    jacobian = np.concatenate([np.zeros((len(error), 0)), *by_others], axis=1)
    at = belief.columns_of(others)
    gain = -lift @ jacobian
    cross = gain @ belief.cov[at]
    value = manifold.retract(placed, -lift @ error)  # no step where the measurement is met exactly
    belief.add(missing, value, cross, gain @ cross[:, at].T + lift @ lift.T, first=placed)
    if len(error) > dim and len(at):
        rest = turned[:, dim:].T
        move(belief.update(at, rest @ jacobian, -rest @ error, np.eye(len(rest))))
    return True
