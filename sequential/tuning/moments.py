"""What the smoothed states say about the noise: second moments of process and readings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.model import evaluate
from sequential.smoothers.leave_one_out import look_back
from sequential.smoothers.pairs import SmoothedPairs
from sequential.timeline import Problem

__all__ = ["Moments", "moments", "process_noise"]

Array = NDArray[np.float64]
FEW = 32  # different intervals: for more, the noise is what the filter's prediction added
TINY = 1e-9  # of the largest eigenvalue of a normalised Q: below, a direction has no noise of its own


@dataclass(frozen=True, slots=True, eq=False)
class Moments:
    """Expected second moments given all readings.

    `process` (K-1, d, d) is E[w wᵀ] of the process noise on the way to each node, `dt` (K-1,) how long that
    took, `readings[name]` (M, m, m) E[v vᵀ] of the noise in each reading.
    """

    process: Array
    dt: Array
    readings: dict[str, Array]


def moments(problem: Problem, pairs: SmoothedPairs) -> Moments:
    """E[w wᵀ] and E[v vᵀ] (Shumway and Stoffer 1982, eq. 9 to 14), linearised where the model is curved.

    w = x_k - f(x_{k-1}) with f about the filtered state, v = z - h(x) with h about the smoothed one.
    """
    return Moments(_of_process(problem, pairs), np.diff(problem.t) * 1e-9, _of_readings(problem, pairs))


def _of_process(problem: Problem, pairs: SmoothedPairs) -> Array:
    forward, manifold = pairs.forward, problem.model.manifold
    ahead = forward.predicted
    assert ahead is not None  # noqa: S101 - pairs keep it
    phi = ahead.transition[1:]
    step = manifold.local(ahead.mean[1:], pairs.mean[1:])
    before = manifold.local(forward.mean[:-1], pairs.mean[:-1])
    residual = step - np.einsum("kij,kj->ki", phi, before)
    shared = pairs.cross[1:] @ np.swapaxes(phi, 1, 2)
    moved = phi @ pairs.cov[:-1] @ np.swapaxes(phi, 1, 2)
    whole = pairs.cov[1:] + moved - shared - np.swapaxes(shared, 1, 2)
    return np.asarray(whole + residual[:, :, None] * residual[:, None, :])


def _of_readings(problem: Problem, pairs: SmoothedPairs) -> dict[str, Array]:
    residual, jacobian, node_of = look_back(problem, pairs.mean)
    found = {}
    for index, (name, sensor) in enumerate(problem.model.sensors.items()):
        rows = np.flatnonzero(problem.schedule.sensor == index)
        m = sensor.manifold.dim
        r, h, p = residual[rows, :m], jacobian[rows, :m], pairs.cov[node_of[rows]]
        second = r[:, :, None] * r[:, None, :] + h @ p @ np.swapaxes(h, 1, 2)
        if (problem.schedule.rows[rows] < m).any():
            missing = np.isnan(problem.schedule.z[rows, :m])
            second = _completed(second, missing, np.asarray(sensor.noise_cov))
        found[name] = second
    return found


def _completed(second: Array, missing: NDArray[np.bool_], noise_cov: Array) -> Array:
    """Noise of the components that are missing, given that of those present, under the R of before."""
    own = second.copy()
    for pattern in np.unique(missing[missing.any(axis=1)], axis=0):
        rows = np.flatnonzero((missing == pattern).all(axis=1))
        gone, there = np.flatnonzero(pattern), np.flatnonzero(~pattern)
        known = noise_cov[np.ix_(there, there)]
        slope = np.linalg.solve(known, noise_cov[np.ix_(there, gone)]).T  # of the missing on the present
        left = noise_cov[np.ix_(gone, gone)] - slope @ noise_cov[np.ix_(there, gone)]
        seen = second[np.ix_(rows, there, there)]
        own[np.ix_(rows, gone, there)] = slope @ seen
        own[np.ix_(rows, there, gone)] = np.swapaxes(slope @ seen, 1, 2)
        own[np.ix_(rows, gone, gone)] = slope @ seen @ slope.T + left
    return own


def process_noise(problem: Problem, pairs: SmoothedPairs) -> Array:
    """(K-1, d, d) covariance that the process adds on the way to each node."""
    f, plan, d = problem.model.process_functions, problem.schedule, problem.model.manifold.dim
    steps = np.diff(plan.step_ptr)[1:]
    process = problem.model.process
    steady = process.linear and not getattr(process, "rows", 0)  # its noise depends on the interval alone
    dt, kind = np.unique(plan.step_dt, return_inverse=True)
    if f.noise is not None and steady and len(dt) <= FEW and (steps == 1).all():
        x, u = problem.model.prior.mean, np.zeros(max(f.inputs, 1))
        each = [evaluate(f.noise, x, u, float(one), f.params, d * d).reshape(d, d) for one in dt]
        return np.stack(each)[kind]
    ahead = pairs.forward.predicted
    assert ahead is not None  # noqa: S101 - pairs keep it
    phi = ahead.transition[1:]
    return np.asarray(ahead.cov[1:] - phi @ pairs.forward.cov[:-1] @ np.swapaxes(phi, 1, 2))


def scale_of(noise: Array, second: Array) -> float:
    """The factor s that makes s·Q fit E[w wᵀ] best: Σ tr(Q⁺ W) / Σ rank Q, over (K, d, d) of both."""
    sigma = np.sqrt(np.clip(np.diagonal(noise, axis1=1, axis2=2), 0.0, None))
    sigma = np.where(sigma > 1e-12 * sigma.max(axis=1, keepdims=True), sigma, np.inf)
    outer = sigma[:, :, None] * sigma[:, None, :]
    values, vectors = np.linalg.eigh(noise / outer)
    inside = values > TINY * values[:, -1:]
    seen = np.einsum("kia,kij,kja->ka", vectors, second / outer, vectors)
    share = np.where(inside, seen / np.where(inside, values, 1.0), 0.0)
    return float(share.sum() / inside.sum())
