"""Numba types of the arrays that kernels pass around.

Inputs are read-only types, which mutable arrays convert to; so a kernel is compiled once, for one signature,
whoever calls it.  `f1`, `f2`, `f3` are read, `w1`, `w2`, `w3` are written; `u2`, `u3` and `wu2`, `wu3` the
same for 8-bit images.
"""

from __future__ import annotations

from numba import types

__all__ = ["b0", "f0", "f1", "f2", "f3", "i0", "i1", "i2", "u2", "u3", "w1", "w2", "w3", "wu2", "wu3"]

b0, f0, i0 = types.boolean, types.float64, types.int64
f1 = types.Array(types.float64, 1, "C", readonly=True)
f2 = types.Array(types.float64, 2, "C", readonly=True)
f3 = types.Array(types.float64, 3, "C", readonly=True)
i1 = types.Array(types.int64, 1, "C", readonly=True)
i2 = types.Array(types.int64, 2, "C", readonly=True)
u2 = types.Array(types.uint8, 2, "C", readonly=True)
u3 = types.Array(types.uint8, 3, "C", readonly=True)
w1, w2, w3 = types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1]
wu2, wu3 = types.uint8[:, ::1], types.uint8[:, :, ::1]
