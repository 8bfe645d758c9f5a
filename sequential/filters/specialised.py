"""Kernels made for one size of state and reading: loops over small matrices are unrolled.

Compiled once per machine for each size, in five to fifteen seconds, and up to twice as quick as those for any
size: worth it for tuning, Monte Carlo runs and long logs.  The results agree to rounding.
"""

from __future__ import annotations

from typing import Any

from sequential.compile import made_for

__all__ = ["Sizes", "made_for", "sizes_of"]

Sizes = tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]
ANY: Sizes = ((), (), ())


def sizes_of(tables: Any, *, specialise: bool) -> Sizes:
    """Storage, tangent and reading as tuples of that length, whose types tell the sizes to the compiler."""
    if not specialise:
        return ANY
    dims = set(tables.z_dim.tolist())
    reading = (0,) * dims.pop() if len(dims) == 1 else ()
    return (0,) * tables.n, (0,) * tables.d, reading
