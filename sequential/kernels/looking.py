"""Every reading of a log seen from a given trajectory: residuals and Jacobians, in one pass."""

from __future__ import annotations

import numpy as np
from numba import njit, types

from sequential.kernels.arrays import f2, i1
from sequential.kernels.records import MODEL, SCHEDULE
from sequential.kernels.sensing import measure, scratch_size, sensor_jacobian

__all__ = ["look_at_readings"]

_f2, _f3 = types.float64[:, ::1], types.float64[:, :, ::1]


@njit(types.void(MODEL, SCHEDULE, f2, i1, _f2, _f3), cache=True, error_model="numpy")
def look_at_readings(model, plan, trajectory, node_of, out_residual, out_jacobian):
    """Residuals local(expected, z) (M, m) and Jacobians (M, m, d) at the states (K, n) of their nodes."""
    widest = plan.z.shape[1]
    expected, flat = np.empty(widest), np.empty(scratch_size(model.n, model.d, widest))
    states = trajectory.reshape(-1)
    for reading in range(len(node_of)):
        at = node_of[reading] * model.n
        measure(model, plan, reading, states, at, expected, out_residual[reading])
        sensor_jacobian(model, plan, reading, states, at, expected, flat, out_jacobian[reading])
