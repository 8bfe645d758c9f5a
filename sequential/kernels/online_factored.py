"""One step of the filter in UD or square-root form, called once a sample.

The factors travel beside the covariance in the belief, so that nothing of them is lost between samples.
"""

from __future__ import annotations

from numba import njit, types

from sequential.kernels.arrays import f0, f1, f2, i0, w1, w2
from sequential.kernels.factored import follow, open_factors
from sequential.kernels.handles import loader
from sequential.kernels.records import FILTERED, MODEL, SCHEDULE
from sequential.kernels.slots import REFUSED, SLOTS, pack, place, unpack

__all__ = ["factored_step"]

# (model, plan, slots, what the filter writes, (mean, covariance, U, D), form, iterations)
load = loader(types.Tuple([MODEL, SCHEDULE, SLOTS, FILTERED, types.Tuple([w1, w2, w2, w1]), i0, i0]))


@njit(i0(i0, f0, i0, f1, f1, f1, f1, f2, w1), cache=True, error_model="numpy", _nrt=False)
def factored_step(address, dt, sensor, belief, z, u, context, noise, out):
    """Move a belief [mean | covariance | U | D] by dt, take a reading, and write both to `out`.

    A belief whose U is NaN is known by its covariance only, which is then factored.
    """
    model, plan, slots, filtered, scratch, form, iterations = load(address)
    if not place(model, slots, filtered, dt, sensor, z, u, context, noise):
        return REFUSED
    x, cov, factor, diagonal = scratch
    if not unpack(model, belief, x, cov, factor, diagonal):
        open_factors(form, cov, model.d, factor, diagonal)
    log_likelihood, failed = follow(model, plan, x, factor, diagonal, form, iterations, 0, filtered)
    return pack(model, filtered, factor, diagonal, log_likelihood, failed, out)
