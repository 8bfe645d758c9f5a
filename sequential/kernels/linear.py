"""The Kalman filter of linear models over a whole log."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from sequential.kernels.arrays import f0, f1, f2, i0, i1
from sequential.kernels.call import inlined
from sequential.kernels.frozen import alike, coast, has_settled, log_normaliser
from sequential.kernels.linear_steps import absorb, linear_scratch, move
from sequential.kernels.matrices import copy_matrix, copy_vector, fill_diagonal
from sequential.kernels.records import FILTERED, FINISHED, MODEL, SCHEDULE
from sequential.kernels.sizes import ANY_SIZE, known

__all__ = ["filter_linear"]


@inlined
def filter_nodes(model, plan, phi, d, m, driven, constant, scratch, keep, freeze, out):
    """The loop of `filter_linear`, with every array at hand."""
    (x, p), steps, sights, (update, doubt), (fresh, last) = scratch
    log_likelihood, settled, normaliser = 0.0, False, 0.0
    for node in range(len(plan.reading_ptr) - 1):
        same = freeze > 0.0 and node > 0 and alike(plan, node, last, constant)
        if settled and same:
            size = known(m, model.z_dim[plan.sensor[plan.reading_ptr[node]]])
            gained = coast(model, plan, node, x, d, size, sights, steps, update, normaliser, out)
            if not math.isnan(gained):
                log_likelihood += gained
                for i in range(d):
                    out.mean[node, i] = x[i]
                    for j in range(d):
                        out.cov[node, i, j] = p[i, j]
                continue
        settled = False
        if keep != 0:
            fill_diagonal(phi, 1.0)
        move(model, plan, node, x, p, phi, d, driven, last, steps, update[9], keep)
        if keep != 0:
            copy_vector(x, out.predicted_mean[node])
            copy_matrix(p, out.predicted_cov[node])
            copy_matrix(phi, out.transition[node])
        failed = -1
        for reading in range(plan.reading_ptr[node], plan.reading_ptr[node + 1]):
            size = known(m, model.z_dim[plan.sensor[reading]])
            gained = absorb(model, plan, reading, x, p, d, size, sights, constant, fresh, update, doubt, out)
            if math.isnan(gained):
                failed = reading
                break
            log_likelihood += gained
        lost = False
        for i in range(d):
            out.mean[node, i] = x[i]
            lost = lost or p[i, i] < 0.0
            for j in range(d):
                out.cov[node, i, j] = p[i, j]
        if failed >= 0 or lost:
            return log_likelihood, failed if failed >= 0 else -2 - node
        if same:
            size = known(m, model.z_dim[plan.sensor[plan.reading_ptr[node]]])
            settled = has_settled(
                model, plan, node, p, out.cov[node - 1], d, size, freeze, update[5], update[6], out.accepted
            )
            normaliser = log_normaliser(update[6], size)
    return log_likelihood, -1


@njit(
    FINISHED(MODEL, SCHEDULE, f1, f2, i0, i1, i0, f0, FILTERED, ANY_SIZE, ANY_SIZE),
    cache=True, error_model="numpy", nogil=True,
)  # fmt: skip
def filter_linear(model, plan, prior_mean, prior_cov, driven, constant, keep, freeze, out, state, reading):
    """Run the filter; returns (log likelihood, code).

    The code is -1, or the reading at which S was not positive definite,
    or -2 - k where a variance at node k was negative.

    `driven` says whether an input drives the process, `constant` (S,) whether a sensor has no context; with
    `freeze` > 0 the gain is kept once P changes by less than that share of itself, see `kernels.frozen`;
    `state` and `reading` are their sizes, as in `sequential.kernels.sizes`.
    """
    d = known(state, model.d)
    scratch = linear_scratch(d, plan.z.shape[1], len(model.z_dim))
    copy_vector(prior_mean, scratch[0][0])
    copy_matrix(prior_cov, scratch[0][1])
    return filter_nodes(model, plan, np.eye(d), d, reading, driven, constant, scratch, keep, freeze, out)
