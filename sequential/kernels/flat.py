"""Charts of states and readings, with short cuts where tangents simply add: vectors and angles."""

from __future__ import annotations

from sequential.kernels.call import inlined
from sequential.kernels.charts import local, retract, wrap

__all__ = ["ANGLES", "GENERAL", "PLAIN", "local_reading", "retract_state"]

GENERAL, ANGLES, PLAIN = 0, 1, 2  # anything; blocks of numbers and angles; one block of numbers


@inlined
def retract_state(model, x, x_at, xi, xi_at, out, out_at):
    """out = x ⊕ xi, arrays flat from their offsets; out may be x."""
    if model.flat == PLAIN:
        for i in range(model.n):
            out[out_at + i] = x[x_at + i] + xi[xi_at + i]
    else:
        retract(model.table, 0, len(model.table), x, x_at, xi, xi_at, out, out_at)


@inlined
def local_reading(model, s, m, x, x_at, y, y_at, out, out_at):
    """out (m,) = the tangent vector at the measurement x of sensor s that leads to y."""
    if model.z_flat[s] == GENERAL:
        local(model.z_table, model.z_first[s], model.z_first[s + 1], x, x_at, y, y_at, out, out_at)
        return
    for i in range(m):
        out[out_at + i] = y[y_at + i] - x[x_at + i]
    if model.z_flat[s] == ANGLES:
        for b in range(model.z_first[s], model.z_first[s + 1]):
            if model.z_table[b, 0] != 0:
                at = out_at + model.z_table[b, 2]
                out[at] = wrap(out[at])
