"""Innovations of an online smoother or graph: each reading against what the estimate before it predicts."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from sequential.compile import compiled
from sequential.filters.solution import masked
from sequential.history import Innovations
from sequential.smoothers.leave_one_out import look_back
from sequential.timeline import Problem

__all__ = ["dead_reckoning", "look_back", "predict", "predicted_innovations"]

Array = NDArray[np.float64]


def predict(problem: Problem, mean: Array, cov: Array) -> tuple[Array, Array]:
    """Carry each node to the next: means (K, n) and covariances (K, d, d); entry 0 is the prior."""
    from sequential.kernels.walking import walk

    whole, prior = compiled(problem.model), problem.model.prior
    arrived, transition, noise = np.empty(mean.shape), np.empty(cov.shape), np.empty(cov.shape)
    walk(whole.tables, problem.schedule, np.ascontiguousarray(mean), arrived, transition, noise)
    whole.raise_failures()
    before = np.empty_like(cov)
    before[1:] = transition[1:] @ cov[:-1] @ np.swapaxes(transition[1:], 1, 2) + noise[1:]
    arrived[0], before[0] = prior.mean, prior.cov
    return arrived, before


def dead_reckoning(problem: Problem, start: Array, first: int, last: int) -> tuple[Array, Array]:
    """The path that the process makes from a state at node `first` without readings.

    Returns
    -------
    path : (last - first + 1, n)
    transition : (last - first + 1, d, d) Jacobians from node to node; entry 0 is the identity
    """
    from sequential.kernels.walking import walk

    whole, plan = compiled(problem.model), problem.schedule
    span = slice(first, last + 2)
    plan = plan._replace(step_ptr=plan.step_ptr[span], reading_ptr=plan.reading_ptr[span])
    path = np.tile(start, (last - first + 1, 1))
    square = (len(path), whole.tables.d, whole.tables.d)
    transition = np.empty(square)
    walk(whole.tables, plan, path, path, transition, np.empty(square))  # each arrival is the next start
    whole.raise_failures()
    return path, transition


def predicted_innovations(problem: Problem, mean: Array, cov: Array) -> Mapping[str, Innovations]:
    """Innovations of every sensor, from the online estimates of the nodes before.

    Where several readings share a node, each is held against the prediction without the others.  Taking
    the reading out of the posterior instead, in closed form, would divide rounding by R - H P Hᵀ, which is
    next to nothing where one fix outweighs all that came before.
    """
    arrived, before = predict(problem, mean, cov)
    residual, jacobian, node_of = look_back(problem, arrived)
    found = {}
    for index, (name, sensor) in enumerate(problem.model.sensors.items()):
        rows = np.flatnonzero(problem.schedule.sensor == index)
        m = sensor.manifold.dim
        h = jacobian[rows, :m]
        spread = h @ before[node_of[rows]] @ np.swapaxes(h, 1, 2) + problem.noises(rows, m)
        found[name] = Innovations(
            problem.reading_t[rows],
            problem.reading_row[rows],
            masked(problem, rows, residual[rows, :m]),
            spread,
            np.ones(len(rows), dtype=bool),
        )
    return found
