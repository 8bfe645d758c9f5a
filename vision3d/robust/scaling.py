"""Centre and scale points before a search, so that all its numbers are of about one size (Hartley 1997)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, NotFiniteError, ShapeError, UnderConstrainedError

__all__ = ["checked_points", "paired_points", "scaled_pairs", "similarity_about", "spread"]

Array = NDArray[np.float64]


def checked_points(points: Array, columns: int, name: str) -> Array:
    """Points (N, columns) as float64, or a sentence."""
    given = np.ascontiguousarray(points, dtype=np.float64)
    if given.ndim != 2 or given.shape[1] != columns:
        raise ShapeError(f"{name} are points (N, {columns}); got {given.shape}")
    finite = np.isfinite(given)
    if not finite.all():
        bad = int(np.flatnonzero(~finite.all(axis=1))[0])
        raise NotFiniteError(f"{name}[{bad}] is not finite: {given[bad]}; leave it out")
    return given


def paired_points(a: Array, b: Array, columns: int, fewest: int, model: str) -> tuple[Array, Array]:
    """Two sets of points, as many of each, and enough of them.

    Raises
    ------
    DataError
        where they are not, or not finite.
    UnderConstrainedError
        where all of one side are one point.
    """
    first, second = checked_points(a, columns, "a"), checked_points(b, columns, "b")
    if len(first) != len(second):
        raise ShapeError(
            f"a and b are points of the same matches; got {len(first)} in a and {len(second)} in b"
        )
    if len(first) < fewest:
        raise DataError(f"a {model} takes {fewest} matches or more; got {len(first)}")
    for name, points in (("a", first), ("b", second)):
        if (points == points[0]).all():
            raise UnderConstrainedError(
                f"all {len(points)} points of {name} are one and the same, {points[0]}: a {model} takes "
                "points that span the image"
            )
    return first, second


def spread(points: Array) -> float:
    """Root mean square distance of points from their mean."""
    off = (points - points.sum(axis=0) / len(points)).ravel()
    return float(np.sqrt(off @ off / len(points)))


def similarity_about(points: Array, scale: float) -> Array:
    """The (3, 3) that takes the mean of plane points to 0 and divides by scale."""
    x, y = points.mean(axis=0)
    return np.array([[1.0 / scale, 0.0, -x / scale], [0.0, 1.0 / scale, -y / scale], [0.0, 0.0, 1.0]])


def scaled_pairs(a: Array, b: Array) -> tuple[Array, Array, Array, float]:
    """Rows (N, 4) of centred and scaled points, the (3, 3) that did so to a and to b, and the one scale."""
    scale = float(np.sqrt(spread(a) * spread(b)))
    to_a, to_b = similarity_about(a, scale), similarity_about(b, scale)
    rows = np.column_stack([a @ to_a[:2, :2] + to_a[:2, 2], b @ to_b[:2, :2] + to_b[:2, 2]])
    return rows, to_a, to_b, scale
