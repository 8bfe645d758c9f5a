"""One step of the filter of sigma points, called once a sample."""

from __future__ import annotations

from numba import njit, types

from sequential.kernels.arrays import f0, f1, f2, i0, w1, w2
from sequential.kernels.handles import loader
from sequential.kernels.records import FILTERED, MODEL, SCHEDULE
from sequential.kernels.slots import LOST, REFUSED, SLOTS, place, report
from sequential.kernels.unscented import filter_sigma_points

__all__ = ["sigma_points_step"]

# (model, plan, slots, what the filter writes, (mean, covariance), weights, unit points)
load = loader(types.Tuple([MODEL, SCHEDULE, SLOTS, FILTERED, types.Tuple([w1, w2]), f1, f2]))


@njit(i0(i0, f0, i0, f1, f1, f1, f1, f2, w1), cache=True, error_model="numpy", _nrt=False)
def sigma_points_step(address, dt, sensor, belief, z, u, context, noise, out):
    """Move a belief [mean | covariance] by dt, take a reading, and write both to `out`."""
    model, plan, slots, filtered, scratch, weights, unit = load(address)
    if not place(model, slots, filtered, dt, sensor, z, u, context, noise):
        return REFUSED
    x, p = scratch
    n, d = model.n, model.d
    for i in range(n):
        x[i] = belief[i]
    for i in range(d):
        for j in range(d):
            p[i, j] = belief[n + i * d + j]
    log_likelihood, failed = filter_sigma_points(
        model, plan, x, p, weights, unit, 0, filtered, (), (), ()
    )  # fmt: skip
    for i in range(n):
        out[i] = filtered.mean[0, i]
    for i in range(d):
        for j in range(d):
            out[n + i * d + j] = filtered.cov[0, i, j]
    code = report(model, filtered, n + d * d, log_likelihood, out)
    return code if failed == -1 else LOST
