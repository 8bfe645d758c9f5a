"""What filters and smoothers share: one step of the process, one look through a sensor.

Functions that take the records of a model or a plan are inlined by force: handing such a record to a real
call counts a reference for each of its arrays, 250 ns in all.  What allocates stays outside for the same
reason, since it would keep those counts alive.
"""

from __future__ import annotations

import math

import numpy as np

from sequential.kernels.arrays import f0, i0
from sequential.kernels.call import allocating, bare, bare_as, call, inlined
from sequential.kernels.charts import local, retract
from sequential.kernels.flat import local_reading
from sequential.kernels.sizes import reading_dim

__all__ = ["look", "loss_weight", "measure", "process_jacobian", "scratch_size", "sensor_jacobian"]

STEP = 1e-6  # of central differences, in the units of the tangent
CAUCHY = 2


@bare_as(i0(i0, i0, i0))
def scratch_size(n, d, widest):
    """Numbers that a look may need: a measurement and H, or a step, a state and three measurements."""
    return max(widest * (d + 1), d + n + 3 * widest)


@allocating
def difference_process(model, x, u, row, dt, after, out):
    """F (d, d) of the step by central differences; `after` is the state after the step."""
    d, blocks, width = model.d, len(model.table), u.shape[1]
    xi, ahead, moved = np.zeros(d), np.empty(model.n), np.empty(model.n)
    gone, came = np.empty(d), np.empty(d)
    for j in range(d):
        xi[j] = STEP
        retract(model.table, 0, blocks, x, 0, xi, 0, moved, 0)
        call(model.step, moved, 0, u, row * width, dt, model.params, 0, ahead, 0)
        local(model.table, 0, blocks, after, 0, ahead, 0, gone, 0)
        xi[j] = -STEP
        retract(model.table, 0, blocks, x, 0, xi, 0, moved, 0)
        call(model.step, moved, 0, u, row * width, dt, model.params, 0, ahead, 0)
        local(model.table, 0, blocks, after, 0, ahead, 0, came, 0)
        xi[j] = 0.0
        for i in range(d):
            out[i, j] = (gone[i] - came[i]) / (2.0 * STEP)


@inlined
def process_jacobian(model, x, u, row, dt, after, out):
    """F (d, d) of the step from x, declared or differenced; `after` is the state after the step."""
    if model.jacobian != 0:
        call(model.jacobian, x, 0, u, row * u.shape[1], dt, model.params, 0, out, 0)
    else:
        difference_process(model, x, u, row, dt, after, out)


@inlined
def measure(model, plan, reading, x, x_at, expected, residual):
    """Expected measurement at x, and residual = local(expected, z), zero where a component is missing."""
    s = plan.sensor[reading]
    call(
        model.observe[s], x, x_at, plan.context, reading * plan.context.shape[1], 0.0,
        model.sensor_params, model.sensor_params_at[s], expected, 0,
    )  # fmt: skip
    differ(model, plan, reading, expected, residual)


@inlined
def differ(model, plan, reading, expected, residual):
    """The tangent vector residual = local(expected, z), zero where a component is missing."""
    s = plan.sensor[reading]
    m = reading_dim(model, s)
    local_reading(model, s, m, expected, 0, plan.z_flat, reading * plan.z.shape[1], residual, 0)
    if plan.rows[reading] < m:
        for i in range(m):
            if math.isnan(plan.z[reading, i]):
                residual[i] = 0.0


@bare
def difference_sensor(model, plan, reading, x, x_at, expected, flat, out):
    """H (m, d) at x by central differences about the expected measurement; `flat` is scratch."""
    s = plan.sensor[reading]
    m, d, u = model.z_dim[s], model.d, reading * plan.context.shape[1]
    at, observe = model.sensor_params_at[s], model.observe[s]
    blocks, first, last = len(model.table), model.z_first[s], model.z_first[s + 1]
    moved, seen = d, d + model.n
    gone = seen + model.z_size[s]
    came = gone + m
    for j in range(d):
        flat[j] = 0.0
    for j in range(d):
        flat[j] = STEP
        retract(model.table, 0, blocks, x, x_at, flat, 0, flat, moved)
        call(observe, flat, moved, plan.context, u, 0.0, model.sensor_params, at, flat, seen)
        local(model.z_table, first, last, expected, 0, flat, seen, flat, gone)
        flat[j] = -STEP
        retract(model.table, 0, blocks, x, x_at, flat, 0, flat, moved)
        call(observe, flat, moved, plan.context, u, 0.0, model.sensor_params, at, flat, seen)
        local(model.z_table, first, last, expected, 0, flat, seen, flat, came)
        flat[j] = 0.0
        for i in range(m):
            out[i, j] = (flat[gone + i] - flat[came + i]) / (2.0 * STEP)


@inlined
def sensor_jacobian(model, plan, reading, x, x_at, expected, flat, out):
    """H (m, d) at x, declared or differenced, into the first rows of out; `flat` as from `scratch_size`.

    Rows of missing components are zero: with their unit variance in the schedule they say nothing.
    """
    s = plan.sensor[reading]
    m = reading_dim(model, s)
    if model.observe_jacobian[s] == 0:
        difference_sensor(model, plan, reading, x, x_at, expected, flat, out)
    else:
        call(
            model.observe_jacobian[s], x, x_at, plan.context, reading * plan.context.shape[1], 0.0,
            model.sensor_params, model.sensor_params_at[s], flat, 0,
        )  # fmt: skip
        for i in range(m):
            for j in range(model.d):
                out[i, j] = flat[i * model.d + j]
    forget_missing(model, plan, reading, m, out)


@inlined
def forget_missing(model, plan, reading, m, out):
    """Rows of missing components become zero."""
    if plan.rows[reading] < m:
        for i in range(m):
            if math.isnan(plan.z[reading, i]):
                for j in range(model.d):
                    out[i, j] = 0.0


@inlined
def look(model, plan, reading, x, x_at, expected, residual, flat, out):
    """Residual and H (m, d) of a reading at once: `measure` and `sensor_jacobian`."""
    s = plan.sensor[reading]
    if model.see[s] == 0:
        measure(model, plan, reading, x, x_at, expected, residual)
        sensor_jacobian(model, plan, reading, x, x_at, expected, flat, out)
        return
    call(
        model.see[s], x, x_at, plan.context, reading * plan.context.shape[1], 0.0,
        model.sensor_params, model.sensor_params_at[s], flat, 0,
    )  # fmt: skip
    m, size = reading_dim(model, s), model.z_size[s]
    for i in range(size):
        expected[i] = flat[i]
    for i in range(m):
        for j in range(model.d):
            out[i, j] = flat[size + i * model.d + j]
    differ(model, plan, reading, expected, residual)
    forget_missing(model, plan, reading, m, out)


@bare_as(f0(i0, f0, f0))
def loss_weight(kind, k, squared):
    """Weight of a residual whose whitened squared norm is given; 1 without a loss."""
    if kind == 0:
        return 1.0
    if kind == CAUCHY:
        return k * k / (k * k + squared)
    r = math.sqrt(squared)
    return 1.0 if r <= k else k / r
