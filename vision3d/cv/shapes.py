"""The shapes that OpenCV 4 and 5 do not share, brought to one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Array", "Ids", "flat", "quads", "rows"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]


def rows(found: Any, width: int) -> Array:
    """Whatever OpenCV gave, as (N, width) float64; None as (0, width)."""
    if found is None:
        return np.empty((0, width))
    return np.asarray(found, dtype=np.float64).reshape(-1, width)


def flat(found: Any) -> Ids:
    """Whatever OpenCV gave, as (N,) int64; None as (0,)."""
    return np.empty(0, dtype=np.int64) if found is None else np.asarray(found, dtype=np.int64).reshape(-1)


def quads(found: Any) -> Array:
    """Quadrilaterals, however OpenCV gave them, as (M, 4, 2) float64; none as (0, 4, 2)."""
    each = [np.asarray(quad, dtype=np.float64).reshape(4, 2) for quad in found or ()]
    return np.stack(each) if each else np.empty((0, 4, 2))
