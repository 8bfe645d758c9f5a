"""A user's functions in the calling convention of the kernels, by source text written around them."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from sequential.model import Plain

__all__ = ["jitted", "places", "try_once", "wrapped"]


@lru_cache(maxsize=256)
def jitted(function: Callable[..., Any]) -> Any:
    """A user's function for compiled callers: one for all that is made of it."""
    from numba import njit

    return njit(error_model="numpy")(function)


def wrapped(raw: Plain, n: int, inputs: int) -> Any:
    """A user's function as a C function; its arguments become arrays, copied if it writes to them."""
    from numba import carray, cfunc

    from sequential.kernels.call import MODEL_SIGNATURE

    inner = jitted(raw.function)
    size, adds = raw.size, raw.adds
    value, writes = try_once(raw, n, inputs)
    own = ".copy()" if writes else ""
    arguments = {"x": f"carray(x, ({n},)){own}", "u": f"carray(u, ({inputs},)){own}", "dt": "dt"}
    given = ", ".join(arguments[name] for name in raw.arguments)
    source = f"def wrapper(x, u, dt, p, out):\n    value = inner({given})\n" + _assigned(
        value, size, adds=adds
    )
    scope: dict[str, Any] = {"inner": inner, "carray": carray, "np": np}
    exec(source, scope)  # noqa: S102 - the text above, with nothing of the user's in it
    return cfunc(MODEL_SIGNATURE, error_model="numpy")(scope["wrapper"])


def _assigned(value: Any, size: int, *, adds: bool) -> str:
    """Source that writes a value of this kind to `out`; numbers and tuples without a temporary array."""
    sign = "+=" if adds else "="
    if type(value) in {float, int, np.float64}:
        return f"    out[0] {sign} value\n"
    if type(value) is tuple and len(found := places(value, "value")) == size:
        return "".join(f"    out[{i}] {sign} {place}\n" for i, place in enumerate(found))
    flat = "value" if type(value) is np.ndarray else "np.array(value)"
    return f"    flat = {flat}.ravel()\n    for i in range({size}):\n        out[i] {sign} flat[i]\n"


def places(value: Any, name: str) -> list[str]:
    """Where the numbers of nested tuples stand, row by row."""
    if type(value) is not tuple:
        return [name]
    return [place for k, inner in enumerate(value) for place in places(inner, f"{name}[{k}]")]


def try_once(raw: Plain, n: int, inputs: int) -> tuple[Any, bool]:
    """One value of a user's function, and whether it wrote to its arguments on the way."""
    known: dict[str, Any] = {"x": np.full(n, 0.5), "u": np.full(max(inputs, 1), 0.25), "dt": 0.01}
    value = raw.function(*(known[name] for name in raw.arguments))
    aliased = isinstance(value, np.ndarray) and any(np.shares_memory(value, known[a]) for a in ("x", "u"))
    return value, aliased or bool((known["x"] != 0.5).any() or (known["u"] != 0.25).any())
