"""One step of the extended Kalman filter, called once a sample."""

from __future__ import annotations

import math

from numba import njit, types

from sequential.kernels.arrays import f0, f1, f2, i0, w1
from sequential.kernels.extended import WORKSPACE, absorb, workspace
from sequential.kernels.handles import loader
from sequential.kernels.moving import predict
from sequential.kernels.records import FILTERED, MODEL, SCHEDULE
from sequential.kernels.slots import REFUSED, SLOTS, place, report

__all__ = ["extended_step", "make_workspace"]

# (model, plan, slots, what the filter writes, scratch, iterations)
load = loader(types.Tuple([MODEL, SCHEDULE, SLOTS, FILTERED, WORKSPACE, i0]))


@njit(WORKSPACE(i0, i0, i0), cache=True, error_model="numpy")
def make_workspace(n, d, widest):
    """Scratch arrays, to be kept by the caller."""
    return workspace(n, d, widest)


@njit(i0(i0, f0, i0, f1, f1, f1, f1, f2, w1), cache=True, error_model="numpy", _nrt=False)
def extended_step(address, dt, sensor, belief, z, u, context, noise, out):
    """Move a belief [mean | covariance | …] by dt, take a reading, and write both to `out`."""
    model, plan, slots, filtered, scratch, iterations = load(address)
    if not place(model, slots, filtered, dt, sensor, z, u, context, noise):
        return REFUSED
    both, x, p, phi, work, update, expected, residual = scratch
    size = len(both)
    for i in range(size):
        both[i] = belief[i]
    predict(model, plan, 0, both, x, p, phi, 0, work)
    log_likelihood = 0.0
    if plan.reading_ptr[1] > 0:
        gained, share = absorb(model, plan, 0, x, p, iterations, update, work, expected, residual, filtered)
        log_likelihood = gained - 0.5 * math.log(share)
    for i in range(size):
        out[i] = both[i]
    return report(model, filtered, size, log_likelihood, out)
