"""Whether the matrices of a linear filter fit together."""

from __future__ import annotations

from typing import Any

import numpy as np

from sequential.errors import ShapeError

__all__ = ["require_dimensions"]


def require_dimensions(filter_: Any, z: Any, H: Any, R: Any, F: Any, Q: Any) -> None:
    """Raise `ShapeError` at the first matrix that does not fit; None stands for the filter's own."""
    n = filter_.dim_x
    H = np.asarray(filter_.H if H is None else H)
    F = np.asarray(filter_.F if F is None else F)
    Q = np.asarray(filter_.Q if Q is None else Q)
    R = np.asarray(filter_.R if R is None else R)
    if filter_.x.shape not in {(n,), (n, 1)}:
        raise ShapeError(f"x has shape {filter_.x.shape}; with dim_x = {n} it is ({n},) or ({n}, 1)")
    for name, matrix in (("P", filter_.P), ("Q", Q), ("F", F)):
        if np.shape(matrix) != (n, n):
            raise ShapeError(f"{name} has shape {np.shape(matrix)}; with dim_x = {n} it is ({n}, {n})")
    if H.ndim != 2 or H.shape[1] != n:
        raise ShapeError(f"H has shape {H.shape}; with dim_x = {n} it is (dim_z, {n})")
    m = len(H)
    if R.shape != (m, m) and not (m == 1 and R.size == 1):
        raise ShapeError(f"R has shape {R.shape}; for an H of {m} rows it is ({m}, {m})")
    if z is not None and (np.size(z) != m or (np.ndim(z) == 2 and np.shape(z) not in {(m, 1), (1, m)})):
        raise ShapeError(f"z has shape {np.shape(z)}; for an H of {m} rows a reading is {m} numbers")
