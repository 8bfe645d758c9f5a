"""Several models of one system, stacked so that one compiled kernel serves any number of them."""

from __future__ import annotations

from typing import Any, NamedTuple

from numba import types

from sequential.kernels.arrays import f2, f3, i2, w3
from sequential.kernels.call import inlined
from sequential.kernels.records import Filtered, ModelTables
from sequential.timeline import Schedule

__all__ = ["MODES", "MODE_OUT", "STACKED", "Modes", "filtered_of", "mode_of", "plan_of"]


class Modes(NamedTuple):
    """What differs from model to model, with a leading J; see `ModelTables` for the meaning."""

    process: Any  # (J, 5) addresses: step, jacobian, noise, advance, carry
    params: Any  # (J, p)
    observe: Any  # (J, S)
    observe_jacobian: Any  # (J, S)
    sensor_params: Any  # (J, q)
    sensor_params_at: Any  # (J, S)
    noise_cov: Any  # (J, T, m, m) of the readings, as in `Schedule`
    gate: Any  # (J, S, m+1)
    loss: Any  # (J, S)
    loss_k: Any  # (J, S)
    shut: Any  # (S, m+1) gates that shut everything out
    open: Any  # (S, m+1) and gates that let everything in
    see: Any  # (J, S)


STACKED = types.Array(types.float64, 4, "C", readonly=True)
MODES = types.NamedTuple([i2, f2, i2, i2, f2, i2, STACKED, f3, i2, f2, f2, f2, i2], Modes)
# mean (J, K, n), cov (J, K, d, d), residual (J, M, m), residual_cov (J, M, m, m), accepted (J, M)
MODE_OUT = types.Tuple(
    [w3, types.float64[:, :, :, ::1], w3, types.float64[:, :, :, ::1], types.int64[:, ::1]]
)


@inlined
def mode_of(base, modes, j, gate):
    """The record of model j with the given gates (S,); `base` is that of any model."""
    return ModelTables(
        base.table, base.n, base.d, modes.process[j, 0], modes.process[j, 1], modes.process[j, 2],
        modes.process[j, 3], modes.process[j, 4], modes.params[j], modes.observe[j],
        modes.observe_jacobian[j], modes.sensor_params[j], modes.sensor_params_at[j], base.z_table,
        base.z_first, base.z_size, base.z_dim, gate, modes.loss[j], modes.loss_k[j],
        base.flat, base.z_flat, base.m, modes.see[j],
        0, base.observe_points,
    )  # fmt: skip


@inlined
def plan_of(plan, modes, j):
    """The schedule with the readings' noises as model j has them."""
    return Schedule(
        plan.step_ptr, plan.step_dt, plan.step_input, plan.inputs, plan.reading_ptr, plan.sensor, plan.z,
        plan.context, plan.z_flat, modes.noise_cov[j], plan.noise_row, plan.rows,
    )  # fmt: skip


@inlined
def filtered_of(out, j):
    """Where model j writes its innovations; it keeps no predictions."""
    mean, cov, residual, residual_cov, accepted = out
    return Filtered(mean[j], cov[j], mean[j], cov[j], cov[j], residual[j], residual_cov[j], accepted[j])
