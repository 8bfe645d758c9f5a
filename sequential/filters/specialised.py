"""Kernels made for one size of state and reading: loops over small matrices are unrolled.

Compiled once per machine for each size, in five to fifteen seconds, and up to twice as quick as those for any
size: worth it for tuning, Monte Carlo runs and long logs.  The results agree to rounding.
"""

from __future__ import annotations

from typing import Any

from sequential.compile import made_for

__all__ = ["COMMON", "Sizes", "made_for", "sizes_of"]

Sizes = tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]
ANY: Sizes = ((), (), ())
# State and reading for which a kernel is made unasked.  Linear: tracks on a line, in the plane and in space.
# Nonlinear: a planar pose that is ranged or ranged with a bearing, a planar track seen by a radar.
COMMON = {
    "linear": ((2, 1), (4, 2), (6, 3), (9, 3)),
    "extended": ((3, 1), (3, 2), (4, 2)),
    "unscented": ((3, 1), (3, 2), (4, 2)),
}


def sizes_of(tables: Any, kernel: str, *, specialise: bool | None) -> Sizes:
    """Storage, tangent and reading as tuples of that length, whose types tell the sizes to the compiler.

    With `specialise` None they are told where they are common ones of that kernel.
    """
    dims = set(tables.z_dim.tolist())
    common = len(dims) == 1 and tables.n == tables.d and (tables.d, min(dims)) in COMMON[kernel]
    if not (common if specialise is None else specialise):
        return ANY
    reading = (0,) * dims.pop() if len(dims) == 1 else ()
    return (0,) * tables.n, (0,) * tables.d, reading
