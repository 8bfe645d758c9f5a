"""One compiled function out of several of a user's: what they compute alike is computed once.

A process that returns its state and its Jacobian as tuples becomes one function that moves a belief, with
every size known and the zeros of the Jacobian left out; a sensor one that gives the measurement with its
Jacobian.  That halves what a step of an extended filter costs: sines are shared, products with zero are none.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from sequential.model import Plain
from sequential.models.declared import density_noise
from sequential.wrapping import jitted, places, try_once

__all__ = ["fused_move", "fused_sight", "over_points"]

LARGEST = 6  # tangent directions up to which the products are written out
# Products with zero may be left out, and sums with it: NaN and the sign of zero need not survive.
# It holds for the products below alone; what the user wrote keeps the rules of IEEE 754.
LENIENT = {"nnan", "nsz"}


@lru_cache(maxsize=256)
def fused_move(step: Any, jacobian: Any, noise: Any, n: int, d: int, inputs: int) -> Any:
    """`advance` of `sequential.model.Functions` from a step and its Jacobian; None where that cannot be.

    `noise` is a user's function or `density_noise`.
    """
    if d > LARGEST:
        return None
    after = written(step, "after", n, inputs)
    f = written(jacobian, "f", n, inputs)
    if isinstance(noise, Plain):
        q = written(noise, "q", n, inputs)
    else:
        q = [f"p[{1 + k}] * dt" for k in range(d * d)] if noise is density_noise else None
    if after is None or f is None or q is None:
        return None
    lines = [f"after = step({given(step)})", f"f = jacobian({given(jacobian)})"]
    lines += [f"q = noise({given(noise)})"] if isinstance(noise, Plain) else []
    lines += pushed(f, q, n, d)
    lines += [f"out[{i}] = {place}" for i, place in enumerate(after)]
    lines += [f"out[{n + i * d + j}] = s{max(i, j)}{min(i, j)}" for i in range(d) for j in range(d)]
    return made(lines, (n,), inputs, {"step": step, "jacobian": jacobian, "noise": noise})


@lru_cache(maxsize=256)
def fused_sight(observe: Any, jacobian: Any, n: int, inputs: int) -> Any:
    """A function that writes the measurement and behind it its Jacobian; None where that cannot be."""
    seen = written(observe, "seen", n, inputs)
    h = written(jacobian, "h", n, inputs)
    if seen is None or h is None:
        return None
    lines = [f"seen = observe({given(observe)})", f"h = jacobian({given(jacobian)})"]
    lines += [f"out[{i}] = {place}" for i, place in enumerate([*seen, *h])]
    return made(lines, (n,), inputs, {"observe": observe, "jacobian": jacobian})


@lru_cache(maxsize=256)
def over_points(raw: Any, n: int, inputs: int, count: int, stride: int) -> Any:
    """A function that takes `count` states at once, and writes each result `stride` numbers on."""
    found = written(raw, "value", n, inputs)
    if found is None:
        return None
    lines = [f"for k in range({count}):", "    x = states[k]", f"    value = function({given(raw)})"]
    lines += [f"    out[k * {stride} + {i}] = {place}" for i, place in enumerate(found)]
    return made(lines, (count, n), inputs, {"function": raw})


def written(raw: Any, name: str, n: int, inputs: int) -> list[str] | None:
    """Expressions of the numbers that a user's function returns; None unless it returns them as tuples."""
    if not isinstance(raw, Plain):
        return None
    value, writes = try_once(raw, n, inputs)
    if writes:
        return None
    found = places(value, name)
    return found if type(value) is tuple and len(found) == raw.size else None


def given(raw: Plain) -> str:
    """The arguments of a user's function."""
    return ", ".join(raw.arguments)


def pushed(f: list[str], q: list[str], n: int, d: int) -> list[str]:
    """Lines for S = F P Fᵀ + Q below the diagonal, with P behind the state in `out`."""
    lines = [f"p{i}{j} = out[{n + i * d + j}]" for i in range(d) for j in range(i + 1)]
    lines += [f"f{i}{j} = {f[i * d + j]}" for i in range(d) for j in range(d)]
    for i in range(d):
        for j in range(d):
            terms = " + ".join(f"f{i}{k} * p{max(k, j)}{min(k, j)}" for k in range(d))
            lines.append(f"w{i}{j} = {terms}")
    for i in range(d):
        for j in range(i + 1):
            terms = " + ".join(f"w{i}{k} * f{j}{k}" for k in range(d))
            lines.append(f"s{i}{j} = {terms} + {q[i * d + j]}")
    return lines


def made(lines: list[str], shape: tuple[int, ...], inputs: int, functions: dict[str, Any]) -> Any:
    """The lines as a C function in the kernels' calling convention, given one state x or several `states`."""
    from numba import carray, cfunc

    from sequential.kernels.call import MODEL_SIGNATURE

    name = "x" if len(shape) == 1 else "states"
    head = f"def fused(state, context, dt, p, out):\n    {name} = carray(state, {shape})\n"
    head += f"    u = carray(context, ({inputs},))\n"
    scope: dict[str, Any] = {"carray": carray}
    for name, raw in functions.items():
        if isinstance(raw, Plain):
            scope[name] = jitted(raw.function)
    exec(head + "".join(f"    {line}\n" for line in lines), scope)  # noqa: S102 - text made above
    return cfunc(MODEL_SIGNATURE, error_model="numpy", fastmath=LENIENT)(scope["fused"])
