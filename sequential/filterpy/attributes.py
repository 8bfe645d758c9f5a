"""Attributes that a script assigns freely: numbers, lists, flat or column vectors, checked on the way in.

A descriptor here has no `__get__`: values lie in the object's own `__dict__` under their public name, so that
reading costs nothing and FilterPy's `Saver`, which copies that dictionary, finds them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import NotPositiveDefiniteError, ShapeError

__all__ = ["Control", "Covariance", "Matrix", "State", "as_covariance", "as_reading", "nothing_read"]

Array = NDArray[Any]

ROUNDING = 1e-6  # how far from a covariance, in units of its own variances, a matrix may be by rounding


class State:
    """A state of `dim_x` numbers, flat or as a column; the shape given is the shape kept."""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __set__(self, filter_: Any, value: ArrayLike) -> None:
        given = np.asarray(value, dtype=np.float64)
        n = filter_.dim_x
        if given.ndim == 0 and n == 1:
            given = given.reshape(1, 1)
        if given.shape not in {(n,), (n, 1)}:
            msg = f"{self.name} has shape {given.shape}; a state of {n} numbers is ({n},) or ({n}, 1)"
            raise ShapeError(msg)
        filter_.__dict__[self.name] = np.ascontiguousarray(given)


class Covariance:
    """A square matrix; a number stands for that variance on every axis, a vector for a diagonal."""

    def __init__(self, dim: str) -> None:
        self.dim = dim

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __set__(self, filter_: Any, value: ArrayLike) -> None:
        given = as_covariance(value, getattr(filter_, self.dim), self.name)
        require_semidefinite(given, self.name)
        filter_.__dict__[self.name] = given


class Matrix:
    """A matrix of `rows` by `columns`; a flat vector stands for the only row, or the only column."""

    def __init__(self, rows: str, columns: str) -> None:
        self.rows, self.columns = rows, columns

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __set__(self, filter_: Any, value: ArrayLike) -> None:
        n, m = getattr(filter_, self.rows), getattr(filter_, self.columns)
        given = np.asarray(value, dtype=np.float64)
        if given.ndim < 2 and given.size == n * m and (given.ndim or n == m) and min(n, m) == 1:
            given = given.reshape(n, m)
        elif given.ndim == 0 and n == m:
            given = given * np.eye(n)
        if given.shape != (n, m):
            msg = f"{self.name} has shape {given.shape}; with {self.rows} = {n} it is ({n}, {m})"
            if self.rows != self.columns:
                msg = (
                    f"{self.name} has shape {given.shape}; with {self.rows} = {n} and {self.columns} = {m} "
                    f"it is ({n}, {m})"
                )
            raise ShapeError(msg)
        filter_.__dict__[self.name] = np.ascontiguousarray(given)


class Control:
    """What turns a control input into a step of the state: (dim_x, inputs), flat for one input, or None."""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __set__(self, filter_: Any, value: ArrayLike | None) -> None:
        if value is not None and not np.isscalar(value):
            value = np.asarray(value, dtype=np.float64)
            if value.ndim and len(value) != filter_.dim_x:
                msg = (
                    f"{self.name} has shape {value.shape}; it needs {filter_.dim_x} rows, one for each state"
                )
                raise ShapeError(msg)
        filter_.__dict__[self.name] = value


def as_covariance(value: ArrayLike, dim: int, name: str) -> Array:
    """(dim, dim) from a matrix, a diagonal or a number; raises `ShapeError`."""
    given = np.asarray(value, dtype=np.float64)
    if given.ndim == 0:
        given = given * np.eye(dim)
    elif given.shape == (dim,):
        given = np.diag(given)
    if given.shape != (dim, dim):
        msg = f"{name} has shape {given.shape}; it is ({dim}, {dim}), a diagonal ({dim},) or one number"
        raise ShapeError(msg)
    return np.ascontiguousarray(given)


def require_semidefinite(given: Array, name: str) -> None:
    """Raise `NotPositiveDefiniteError` where a matrix is no covariance, beyond what rounding does to one."""
    spread = float(np.abs(given).max(initial=0.0))
    if np.abs(given - given.T).max(initial=0.0) > ROUNDING * spread:
        msg = f"{name} is not symmetric: largest difference {np.abs(given - given.T).max():.3g}"
        raise NotPositiveDefiniteError(msg)
    try:
        np.linalg.cholesky(given)
    except np.linalg.LinAlgError:
        sigma = np.sqrt(np.abs(np.diagonal(given)))
        scale = np.where(sigma > 0.0, sigma, 1.0)
        lowest = float(np.linalg.eigvalsh(given / np.outer(scale, scale)).min())
        if lowest < -ROUNDING:
            lowest = float(np.linalg.eigvalsh(given).min())
            msg = f"{name} is not positive semi-definite: smallest eigenvalue {lowest:.3g}"
            raise NotPositiveDefiniteError(msg) from None


def as_reading(z: Any, dim: int, ndim: int) -> Array:
    """A reading of `dim` numbers, however it was written, flat (`ndim` 1) or as a column.

    None in place of a number reads as NaN, which means that this component is missing.
    """
    try:
        flat = np.asarray(z, dtype=np.float64).ravel()
    except (TypeError, ValueError):
        msg = f"z is {z!r}; a reading is {dim} numbers, with None or NaN where one is missing"
        raise ShapeError(msg) from None
    if flat.size != dim:
        msg = f"z has shape {np.shape(z)}; with dim_z = {dim} a reading is {dim} numbers, flat or as a column"
        raise ShapeError(msg)
    return flat if ndim == 1 else flat.reshape(-1, 1)


def nothing_read(dim: int) -> NDArray[np.object_]:
    """What `z` holds where nothing was read: a column of None."""
    return np.array([[None] * dim]).T
