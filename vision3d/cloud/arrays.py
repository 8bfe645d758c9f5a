"""What every function on clouds checks at its door."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, ModelError, ShapeError

__all__ = ["Array", "Backend", "beside", "checked_backend", "checked_points", "positive"]

Array = NDArray[np.float64]
Backend = Literal["own", "open3d"]


def checked_points(points: ArrayLike, *, at_least: int = 0, what: str = "points") -> Array:
    """Points (N, 3), finite, as many as are needed.

    Raises
    ------
    ShapeError
        where they are not (N, 3).
    DataError
        where one is not finite, or there are too few.
    """
    place = np.asarray(points, dtype=np.float64)
    if place.ndim != 2 or place.shape[1] != 3:
        raise ShapeError(f"{what}: expected (N, 3), got {place.shape}")
    wrong = np.flatnonzero(~np.isfinite(place).all(axis=1))
    if len(wrong):
        raise DataError(
            f"{what}: {len(wrong)} of {len(place)} are not finite, the first is number {wrong[0]}; leave "
            "them out with points[np.isfinite(points).all(axis=1)]"
        )
    if len(place) < at_least:
        raise DataError(f"{what}: expected at least {at_least}, got {len(place)}")
    return place


def beside(values: ArrayLike, shape: tuple[int, ...], what: str) -> NDArray[Any]:
    """Values that go with the points.

    Raises
    ------
    ShapeError
        where their shape is another.
    """
    array = np.asarray(values)
    if array.shape != shape:
        raise ShapeError(f"{what}: expected {shape} to go with the points, got {array.shape}")
    return array


def positive(value: float, what: str) -> float:
    """A number above zero.

    Raises
    ------
    ModelError
        for another.
    """
    if not (np.isfinite(value) and value > 0.0):
        raise ModelError(f"{what}: expected a number above zero, got {value}")
    return float(value)


def checked_backend(backend: str) -> bool:
    """Whether open3d is to do it.

    Raises
    ------
    ModelError
        for a backend that there is not.
    """
    if backend not in {"own", "open3d"}:
        raise ModelError(f"no backend {backend!r}; there are 'own' and 'open3d'")
    return backend == "open3d"
