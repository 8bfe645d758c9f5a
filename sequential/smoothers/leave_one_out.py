"""What a smoother would have predicted of each reading from all the others, in closed form.

With residual r = z - h(x) and smoothed covariance P, leaving the reading out gives the residual
R T⁻¹ r with covariance R T⁻¹ R, where T = R - H P Hᵀ is the covariance of r (Plackett's update).  Its
normalised square, rᵀ T⁻¹ r, is χ² with m degrees of freedom: the smoother's counterpart of the NIS.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sequential.history import Innovations, Run
from sequential.jacobians import difference
from sequential.model import SensorModel, evaluate
from sequential.timeline import Problem

__all__ = ["leave_one_out", "residual_and_jacobian"]

FLOOR = 1e-9  # T is positive definite in theory; eigenvalues below this share of R's are rounding


def leave_one_out(problem: Problem, smoothed: Run, forward: Run | None = None) -> Mapping[str, Innovations]:
    """Leave-one-out innovations of every sensor; readings that `forward` rejected stay rejected."""
    node_of = np.searchsorted(problem.t, problem.reading_t)
    found = {}
    for index, (name, sensor) in enumerate(problem.model.sensors.items()):
        rows = np.flatnonzero(problem.schedule.sensor == index)
        m = sensor.manifold.dim
        residual, cov = np.empty((len(rows), m)), np.empty((len(rows), m, m))
        for k, reading in enumerate(rows):
            node = node_of[reading]
            r, h = residual_and_jacobian(problem, sensor, name, int(reading), smoothed.mean[node])
            residual[k], cov[k] = _without(r, h, smoothed.cov[node], sensor)
        accepted = np.ones(len(rows), bool) if forward is None else forward.innovations[name].accepted
        found[name] = Innovations(
            problem.reading_t[rows], problem.reading_row[rows], residual, cov, accepted, "leave-one-out"
        )
    return found


def residual_and_jacobian(
    problem: Problem, sensor: SensorModel, name: str, reading: int, x: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Residual local(expected, z) (m,) and Jacobian (m, d) of one reading at a state."""
    f, m, d = problem.model.sensor_functions[name], sensor.manifold, problem.model.manifold.dim
    u = problem.schedule.context[reading]

    def observe(at: np.ndarray) -> np.ndarray:
        return evaluate(f.value, at, u, 0.0, f.params, m.size)

    residual = m.local(observe(x), problem.schedule.z[reading, : m.size])
    if f.jacobian is None:
        return residual, difference(observe, x, problem.model.manifold, m)
    return residual, evaluate(f.jacobian, x, u, 0.0, f.params, m.dim * d).reshape(m.dim, d)


def _without(
    r: np.ndarray, h: np.ndarray, cov: np.ndarray, sensor: SensorModel
) -> tuple[np.ndarray, np.ndarray]:
    noise = sensor.noise_cov
    root = np.linalg.cholesky(noise)
    white = np.linalg.solve(root, h)
    values, vectors = np.linalg.eigh(np.eye(len(r)) - white @ cov @ white.T)
    inverse = (vectors / np.maximum(values, FLOOR)) @ vectors.T
    # R T⁻¹ r = root · inverse · (root⁻¹ r), and R T⁻¹ R = root · inverse · rootᵀ.
    return root @ inverse @ np.linalg.solve(root, r), root @ inverse @ root.T
