"""One node of a schedule whose arrays are filled anew for every sample, and what comes out of it.

The filters' own loops walk it, so that a filter fed sample by sample gives what it gives on a whole log, bit
for bit.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from numba import types

from sequential.kernels.arrays import i1, w1, w2, w3
from sequential.kernels.call import inlined

__all__ = ["DONE", "LOST", "REFUSED", "SLOTS", "Slots", "pack", "place", "report", "unpack"]

DONE, REFUSED, LOST = 0, 1, 2  # what a step returns: numbers that cannot be used came in, or came out
_wi = types.int64[::1]


class Slots(NamedTuple):
    """The arrays of the one-node schedule once more, to be written to."""

    step_ptr: Any  # (2,)
    reading_ptr: Any  # (2,)
    step_dt: Any  # (1,) s
    inputs: Any  # (1, inputs)
    sensor: Any  # (1,)
    z: Any  # (widest storage,)
    context: Any  # (1, widest context)
    noise_cov: Any  # (S+1, m, m), the last one for readings that bring their own or miss components
    noise_row: Any  # (1,)
    rows: Any  # (1,)
    z_size: Any  # (S,) storage of a measurement


SLOTS = types.NamedTuple([_wi, _wi, w1, w2, _wi, w1, w2, w3, _wi, _wi, i1], Slots)


@inlined
def place(model, slots, filtered, dt, sensor, z, u, context, noise):
    """Fill the slots: a step of dt seconds unless NaN, a reading unless `sensor` is negative.

    `noise` is (m, m) where the reading brings its own, else empty.  A component of z that is NaN is missing;
    False where any other number is not finite, or a part of a rotation is missing.
    """
    sound = True
    slots.step_ptr[1], slots.reading_ptr[1] = 0, 0
    if not math.isnan(dt):
        slots.step_ptr[1] = 1
        slots.step_dt[0] = dt
        sound = not math.isinf(dt)
        for i in range(len(u)):
            slots.inputs[0, i] = u[i]
            sound = sound and math.isfinite(u[i])
    if sensor < 0:
        return sound
    slots.reading_ptr[1] = 1
    slots.sensor[0] = sensor
    for i in range(len(context)):
        slots.context[0, i] = context[i]
        sound = sound and math.isfinite(context[i])
    missing = 0
    for i in range(slots.z_size[sensor]):
        slots.z[i] = z[i]
        sound = sound and not math.isinf(z[i])
        missing += 1 if math.isnan(z[i]) else 0
    m = model.z_dim[sensor]
    if missing == slots.z_size[sensor]:
        slots.reading_ptr[1], filtered.accepted[0] = 0, 0
        for i in range(m):
            filtered.residual[0, i] = math.nan
            for j in range(m):
                filtered.residual_cov[0, i, j] = math.nan
        return sound
    sound = sound and (missing == 0 or m == slots.z_size[sensor])
    slots.rows[0] = m - missing
    slots.noise_row[0] = sensor
    if missing == 0 and len(noise) == 0:
        return sound
    last = slots.noise_cov.shape[0] - 1
    slots.noise_row[0] = last
    for i in range(m):
        for j in range(m):
            cov = noise[i, j] if len(noise) > 0 else slots.noise_cov[sensor, i, j]
            if missing > 0 and (math.isnan(z[i]) or math.isnan(z[j])):
                cov = 1.0 if i == j else 0.0
            slots.noise_cov[last, i, j] = cov
    return sound


@inlined
def report(model, filtered, at, log_likelihood, out):
    """Write the innovation to `out` from index `at`: [residual | S | accepted | log likelihood].

    Returns the code of the step: LOST where the mean before it, or the log likelihood, is not finite.
    """
    width = filtered.residual.shape[1]
    for i in range(width):
        out[at + i] = filtered.residual[0, i]
        for j in range(width):
            out[at + width + i * width + j] = filtered.residual_cov[0, i, j]
    out[at + width + width * width] = filtered.accepted[0]
    out[at + width + width * width + 1] = log_likelihood
    if math.isnan(log_likelihood):
        return LOST
    for i in range(model.n):
        if not math.isfinite(out[i]):
            return LOST
    return DONE


@inlined
def unpack(model, belief, x, cov, factor, diagonal):
    """Mean, covariance and factors of a belief [mean | covariance | U | D]; False where U is not known."""
    n, d = model.n, model.d
    begin = n + d * d
    for i in range(n):
        x[i] = belief[i]
    for i in range(d):
        diagonal[i] = belief[begin + d * d + i]
        for j in range(d):
            cov[i, j] = belief[n + i * d + j]
            factor[i, j] = belief[begin + i * d + j]
    return not math.isnan(belief[begin])


@inlined
def pack(model, filtered, factor, diagonal, log_likelihood, failed, out):
    """Write a belief with its factors, and the innovation; returns the code of the step."""
    n, d = model.n, model.d
    begin = n + d * d
    for i in range(n):
        out[i] = filtered.mean[0, i]
    for i in range(d):
        out[begin + d * d + i] = diagonal[i]
        for j in range(d):
            out[n + i * d + j] = filtered.cov[0, i, j]
            out[begin + i * d + j] = factor[i, j]
    code = report(model, filtered, begin + d * d + d, log_likelihood, out)
    return code if failed == -1 else LOST
