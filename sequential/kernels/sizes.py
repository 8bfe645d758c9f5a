"""Sizes that the compiler may know: one source for a kernel of any size and for those made for one size.

A size is told by the type of a tuple.  `()` says nothing, and the loop bounds stay variables: compiled once,
for all.  `(0, 0, 0)` says three, and loops over small matrices are unrolled.
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.extending import overload

from sequential.kernels.call import inlined, owning
from sequential.kernels.records import ModelTables

__all__ = ["ANY_SIZE", "known", "reading_dim", "reading_size", "sized"]

ANY_SIZE = types.Tuple(())


def known(size: Any, otherwise: Any) -> Any:
    """Length of `size`, a constant to the compiler, or `otherwise` where it is empty."""
    return len(size) or otherwise


@overload(known, jit_options={"forceinline": True, "_nrt": False})
def _known(size, otherwise):
    if size.count == 0:
        return lambda size, otherwise: otherwise  # noqa: ARG005 - of the family
    count = size.count
    return lambda size, otherwise: count  # noqa: ARG005 - of the family


@owning
def sized(model, storage, tangent, reading):
    """The model with sizes that the compiler knows, where the tuples tell them."""
    return ModelTables(
        model.table, known(storage, model.n), known(tangent, model.d), model.step, model.jacobian,
        model.noise, model.advance, model.carry, model.params, model.observe, model.observe_jacobian,
        model.sensor_params, model.sensor_params_at, model.z_table, model.z_first, model.z_size, model.z_dim,
        model.gate, model.loss, model.loss_k, model.flat, model.z_flat, known(reading, 0), model.see,
        model.step_points, model.observe_points,
    )  # fmt: skip


@inlined
def reading_dim(model, s):
    """Tangent of a measurement of sensor s."""
    return model.m if model.m != 0 else model.z_dim[s]


@inlined
def reading_size(model, s, m):
    """Storage of a measurement of sensor s, which is m where its tangents simply add."""
    return m if model.z_flat[s] != 0 else model.z_size[s]
