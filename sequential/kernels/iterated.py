"""One Gauss-Newton iteration on the chain, as a linear filter about the current trajectory.

The unknowns are tangent steps δ_k at the current states x_k.  The prior, each process step and each reading
is linearised there; the forward pass below and the backward pass of `smoothing` then solve the least-squares
problem of the whole chain exactly (Bell 1994, The iterated Kalman smoother as a Gauss-Newton method).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit, types

from sequential.kernels.arrays import f0, f1, f2, i0, w2
from sequential.kernels.call import bare, bare_as, inlined
from sequential.kernels.correcting import correct, correction_scratch, settle
from sequential.kernels.matrices import copy_matrix, copy_vector, multiply, multiply_nt
from sequential.kernels.moving import linearise_move, linearise_prior
from sequential.kernels.records import MODEL, SCHEDULE
from sequential.kernels.sensing import loss_weight, measure, sensor_jacobian

__all__ = ["LINEARISED", "Linearised", "filter_steps"]


class Linearised(NamedTuple):
    """What the forward pass writes: beliefs about δ."""

    mean: Any  # (K, d)
    cov: Any  # (K, d, d)
    predicted_mean: Any  # (K, d)
    predicted_cov: Any  # (K, d, d)
    transition: Any  # (K, d, d)


_f2, _f3 = types.float64[:, ::1], types.float64[:, :, ::1]
LINEARISED = types.NamedTuple([_f2, _f3, _f2, _f3, _f3], Linearised)


@inlined
def absorb_step(model, plan, reading, trajectory, at, mean, cov, update, work, expected, residual):
    """Update the belief about δ by one reading linearised at the trajectory, with the robust weight there."""
    s = plan.sensor[reading]
    m, d = model.z_dim[s], model.d
    h, flat, cross, lower = update[0], update[1], update[2], update[5]
    noise = plan.noise_cov[plan.noise_row[reading]]
    measure(model, plan, reading, trajectory, at, expected, residual)
    sensor_jacobian(model, plan, reading, trajectory, at, expected, flat, h)
    weight = 1.0
    if model.loss[s] != 0:
        weight = loss_weight(
            model.loss[s], model.loss_k[s], whitened_square(noise, residual, m, lower, cross)
        )
    for i in range(m):
        for k in range(d):
            residual[i] -= h[i, k] * mean[k]
    nis, _, _, redone = correct(cov, h, noise, weight, residual, m, d, update)
    if nis < 0.0 or not settle(cov, h, noise, weight, residual, m, d, update, redone):
        return -1
    for i in range(d):
        mean[i] += update[7][i]
    return 0


@bare_as(f0(f2, f1, i0, w2, w2))
def whitened_square(noise, residual, m, lower, white):
    """Residualᵀ R⁻¹ residual by forward substitution; `white` (m, 1 or more) is scratch."""
    total = 0.0
    for j in range(m):
        for i in range(j, m):
            s = noise[i, j]
            for k in range(j):
                s -= lower[i, k] * lower[j, k]
            lower[i, j] = s**0.5 if i == j else s / lower[j, j]
    for i in range(m):
        s = residual[i]
        for k in range(i):
            s -= lower[i, k] * white[k, 0]
        white[i, 0] = s / lower[i, i]
        total += white[i, 0] ** 2
    return total


@bare
def filter_chain(model, plan, prior, trajectory, states, belief, x, q, frames, vectors, work, update, out):
    """The loop of `filter_steps`, with every array at hand."""
    n, d = model.n, model.d
    phi, turn, inverse, cov = frames
    mean, e, step, expected, residual = vectors
    for node in range(len(plan.reading_ptr) - 1):
        if node == 0:
            linearise_prior(model, prior, states, x, cov, e, turn, inverse, work)
            copy_matrix(turn, phi)
        else:
            linearise_move(model, plan, node, trajectory, states, belief, x, q, phi, e, turn, inverse, work)
            multiply(phi, cov, work[0], d, d, d)
            multiply_nt(work[0], phi, cov, d, d, d)
            for i in range(d):
                for j in range(i + 1):
                    s = 0.5 * (cov[i, j] + cov[j, i]) + q[i, j]
                    cov[i, j], cov[j, i] = s, s
        for i in range(d):
            step[i] = 0.0
            for k in range(d):
                step[i] += phi[i, k] * mean[k] - inverse[i, k] * e[k]
        copy_vector(step, mean)
        copy_vector(mean, out.predicted_mean[node])
        copy_matrix(cov, out.predicted_cov[node])
        copy_matrix(phi, out.transition[node])
        for reading in range(plan.reading_ptr[node], plan.reading_ptr[node + 1]):
            absorbed = absorb_step(
                model, plan, reading, states, node * n, mean, cov, update, work, expected, residual
            )
            if absorbed < 0:
                return reading
        copy_vector(mean, out.mean[node])
        copy_matrix(cov, out.cov[node])
    return -1


@njit(types.int64(MODEL, SCHEDULE, f1, f2, f2, LINEARISED), cache=True, error_model="numpy")
def filter_steps(model, plan, prior_mean, prior_cov, trajectory, out):
    """Linearise about the trajectory (K, n) and filter; returns -1, or the reading where S was indefinite."""
    n, d, widest = model.n, model.d, plan.z.shape[1]
    belief = np.empty(n + d * d)
    x, q = belief[:n], belief[n:].reshape((d, d))
    frames = (np.empty((d, d)), np.empty((d, d)), np.empty((d, d)), np.empty((d, d)))
    work = (np.empty((d, d)), np.empty((d, d)), np.empty(n), np.empty((d, d)))
    update = correction_scratch(n, d, widest)
    states = trajectory.reshape(-1)
    vectors = (np.zeros(d), np.empty(d), np.empty(d), np.empty(widest), np.empty(widest))
    prior = (prior_mean, prior_cov)
    return filter_chain(
        model, plan, prior, trajectory, states, belief, x, q, frames, vectors, work, update, out
    )
