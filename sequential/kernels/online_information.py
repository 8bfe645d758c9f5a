"""One step of the filter in information form, called once a sample.

The factors of the information travel beside the covariance in the belief.
"""

from __future__ import annotations

from numba import njit, types

from sequential.kernels.arrays import f0, f1, f2, i0, w1, w2
from sequential.kernels.handles import loader
from sequential.kernels.information import follow
from sequential.kernels.records import FILTERED, MODEL, SCHEDULE
from sequential.kernels.slots import REFUSED, SLOTS, pack, place, unpack

__all__ = ["information_step"]

# (model, plan, slots, what the filter writes, (mean, covariance, U, D))
load = loader(types.Tuple([MODEL, SCHEDULE, SLOTS, FILTERED, types.Tuple([w1, w2, w2, w1])]))


@njit(i0(i0, f0, i0, f1, f1, f1, f1, f2, w1), cache=True, error_model="numpy", _nrt=False)
def information_step(address, dt, sensor, belief, z, u, context, noise, out):
    """Move a belief [mean | covariance | U | D] by dt, take a reading, and write both to `out`.

    U D Uᵀ is the inverse of the covariance; where U is NaN, the covariance is inverted first.
    """
    model, plan, slots, filtered, scratch = load(address)
    if not place(model, slots, filtered, dt, sensor, z, u, context, noise):
        return REFUSED
    x, cov, factor, diagonal = scratch
    known = unpack(model, belief, x, cov, factor, diagonal)
    log_likelihood, failed = follow(model, plan, x, factor, diagonal, cov, known, 0, filtered)
    return pack(model, filtered, factor, diagonal, log_likelihood, failed, out)
