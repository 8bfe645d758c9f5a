"""What a smoother would have predicted of each reading from all the others, in closed form.

With residual r = z - h(x), Jacobian H and smoothed covariance P, leaving the reading out gives the residual
R T⁻¹ r with covariance R T⁻¹ R, where T = R - H P Hᵀ is the covariance of r (Plackett's update).  Its
normalised square, rᵀ T⁻¹ r, is χ² with m degrees of freedom: the smoother's counterpart of the NIS.
A reading that a robust loss gave the weight w was used with R/w; one that a gate rejected was left out
already, so that its residual is r and the covariance R + H P Hᵀ.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from sequential.compile import compiled
from sequential.errors import ModelError
from sequential.filters.solution import masked
from sequential.history import Innovations, Run
from sequential.model import Loss, SensorModel
from sequential.timeline import Problem, sealed

__all__ = ["leave_one_out", "require_noise"]

Array = NDArray[np.float64]

FLOOR = 1e-9  # T is positive definite in theory; eigenvalues below this share of R's are rounding


def leave_one_out(problem: Problem, smoothed: Run, forward: Run | None = None) -> Mapping[str, Innovations]:
    """Leave-one-out innovations of every sensor.

    Parameters
    ----------
    smoothed : estimates from all readings
    forward : the filter pass that decided about gates and robust weights; without it all were used, and
        weighted by their residuals at the smoothed states

    Raises
    ------
    ModelError
        where a reading has no noise.
    """
    require_noise(problem, "their leave-one-out innovations are 0/0: ask for none with leave_one_out=False")
    residual, jacobian, node_of = look_back(problem, smoothed.mean)
    found = {}
    for index, (name, sensor) in enumerate(problem.model.sensors.items()):
        rows = np.flatnonzero(problem.schedule.sensor == index)
        m = sensor.manifold.dim
        r, h, p = residual[rows, :m], jacobian[rows, :m], smoothed.cov[node_of[rows]]
        accepted = np.ones(len(rows), bool) if forward is None else forward.innovations[name].accepted
        noise = problem.noises(rows, m)
        weight = _weights(sensor, r, noise, None if forward is None else forward.innovations[name])
        left, cov = np.empty_like(r), np.empty((len(rows), m, m))
        left[accepted], cov[accepted] = _without(
            r[accepted], h[accepted], p[accepted], noise[accepted], weight[accepted]
        )
        out = ~accepted
        left[out], cov[out] = r[out], h[out] @ p[out] @ np.swapaxes(h[out], 1, 2) + noise[out]
        found[name] = Innovations(
            problem.reading_t[rows],
            problem.reading_row[rows],
            masked(problem, rows, left),
            cov,
            accepted,
            "leave-one-out",
        )
    return found


def require_noise(problem: Problem, why: str) -> None:
    """Raise `ModelError` where a reading is perfect, in a direction at least."""
    plan = problem.schedule
    for k, (name, sensor) in enumerate(problem.model.sensors.items()):
        mine, m = np.unique(plan.noise_row[plan.sensor == k]), sensor.manifold.dim
        try:
            np.linalg.cholesky(plan.noise_cov[mine, :m, :m])
        except np.linalg.LinAlgError:
            msg = f"sensor {name!r} has readings without noise (noise_cov is singular); {why}"
            raise ModelError(msg) from None


def look_back(problem: Problem, trajectory: Array) -> tuple[Array, Array, NDArray[np.int64]]:
    """Residuals (M, m), Jacobians (M, m, d) and nodes (M,) of all readings at a trajectory (K, n)."""
    from sequential.kernels.looking import look_at_readings

    whole = compiled(problem.model)
    readings, widest = problem.schedule.z.shape
    node_of = sealed(np.searchsorted(problem.t, problem.reading_t).astype(np.int64))
    residual, jacobian = np.zeros((readings, widest)), np.zeros((readings, widest, whole.tables.d))
    states = np.ascontiguousarray(trajectory)
    look_at_readings(whole.tables, problem.schedule, states, node_of, residual, jacobian)
    whole.raise_failures()
    return residual, jacobian, node_of


def _weights(sensor: SensorModel, r: Array, noise: Array, filtered: Innovations | None) -> Array:
    """(M,) weights that the loss gave: by the innovation in a filter, by the residual in a batch."""
    if sensor.loss is None:
        return np.ones(len(r))
    if filtered is not None:
        return loss_weights(sensor.loss, filtered.nis() / filtered.dof())
    return loss_weights(sensor.loss, np.einsum("ni,nij,nj->n", r, np.linalg.inv(noise), r))


def loss_weights(loss: Loss, squared: Array) -> Array:
    """(M,) weights of residuals whose whitened squared norms are given."""
    if loss.kind == "cauchy":
        return loss.k**2 / (loss.k**2 + squared)
    return np.minimum(1.0, loss.k / np.sqrt(np.maximum(squared, 1e-300)))


def _without(r: Array, h: Array, p: Array, noise: Array, weight: Array) -> tuple[Array, Array]:
    """Residuals (M, m) and covariances (M, m, m) of readings used with noise R/w, left out again."""
    root = np.linalg.cholesky(noise) / np.sqrt(weight)[:, None, None]
    white = np.linalg.solve(root, h)
    values, vectors = np.linalg.eigh(np.eye(r.shape[1]) - white @ p @ np.swapaxes(white, 1, 2))
    inverse = (vectors / np.maximum(values, FLOOR)[:, None, :]) @ np.swapaxes(vectors, 1, 2)
    # With R/w = A Aᵀ and T = A (1 - …) Aᵀ: the residual is A (1 - …)⁻¹ A⁻¹ r; its covariance takes R for R/w.
    left = root @ inverse @ np.linalg.solve(root, r[..., None])
    cov = root @ (inverse - np.eye(r.shape[1])) @ np.swapaxes(root, 1, 2) + noise
    return left[..., 0], cov
