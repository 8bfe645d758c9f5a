"""The records that kernels take, and their Numba types."""

from __future__ import annotations

from typing import Any, NamedTuple

from numba import types

from sequential.kernels.arrays import f1, f2, f3, i1, i2, w2, w3
from sequential.timeline import Schedule

__all__ = ["FILTERED", "FINISHED", "MODEL", "SCHEDULE", "Filtered", "ModelTables"]


class ModelTables(NamedTuple):
    """A `StateSpace` as addresses and numbers; see `sequential.compile`."""

    table: Any  # (B, 5) blocks of the state's manifold
    n: int  # storage
    d: int  # tangent
    step: int  # addresses of the process; 0 where a function is absent
    jacobian: int
    noise: int
    advance: int
    carry: int
    params: Any
    observe: Any  # (S,) addresses of the sensors
    observe_jacobian: Any
    sensor_params: Any  # all sensors' numbers, one after the other
    sensor_params_at: Any  # (S,) where each begins
    z_table: Any  # blocks of the measurements' manifolds
    z_first: Any  # (S+1,) rows of z_table
    z_size: Any  # (S,) storage of a measurement
    z_dim: Any  # (S,) tangent of a measurement
    gate: Any  # (S, m+1) largest NIS that is accepted of so many components; infinity without a gate
    loss: Any  # (S,) 0 none, 1 Huber, 2 Cauchy
    loss_k: Any  # (S,)
    flat: int  # how the state's tangents add, see `kernels.flat`
    z_flat: Any  # (S,) the same for measurements
    m: int  # tangent of every measurement in a kernel made for one size, else 0
    see: Any  # (S,) addresses of sensors that write their Jacobian behind the measurement, or 0
    step_points: int  # address of a step, and
    observe_points: Any  # (S,) of sensors, that take all sigma points at once, or 0


_int = types.int64
MODEL = types.NamedTuple(
    [
        i2,
        _int,
        _int,
        _int,
        _int,
        _int,
        _int,
        _int,
        f1,
        i1,
        i1,
        f1,
        i1,
        i2,
        i1,
        i1,
        i1,
        f2,
        i1,
        f1,
        _int,
        i1,
        _int,
        i1,
        _int,
        i1,
    ],
    ModelTables,
)
SCHEDULE = types.NamedTuple([i1, f1, i1, f2, i1, i1, f2, f2, f1, f3, i1, i1], Schedule)


class Filtered(NamedTuple):
    """What a filter writes; with `keep` = 0 the three arrays of predictions have length one."""

    mean: Any  # (K, n)
    cov: Any  # (K, d, d)
    predicted_mean: Any  # (K, n)
    predicted_cov: Any  # (K, d, d)
    transition: Any  # (K, d, d)
    residual: Any  # (M, m)
    residual_cov: Any  # (M, m, m)
    accepted: Any  # (M,) 1 used, 0 rejected by its gate


FILTERED = types.NamedTuple([w2, w3, w2, w3, w3, w2, w3, types.int64[::1]], Filtered)
FINISHED = types.Tuple([types.float64, types.int64])
