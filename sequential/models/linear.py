"""A linear process given step by step: x' = F x + B u + w, w ~ N(0, Q)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, ModelError, NotFiniteError, ShapeError
from sequential.log import Stream
from sequential.manifold import Kind, Manifold
from sequential.model import Functions, ProcessModel, as_params
from sequential.noise import require_covariance

__all__ = ["LinearProcess", "require_flat", "tabulated_input"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LinearProcess(ProcessModel):
    """One application of F, Q and B for every step, however long the step is.

    Parameters
    ----------
    F : (n, n) transition, or (K, n, n) one for each row of a table
    Q : (n, n), (n,) variances or a number; (K, n, n) one for each row
    B : (n, m) or (K, n, m) what the input does; the input stream then has m columns

    Raises
    ------
    ShapeError, NotFiniteError, NotPositiveDefiniteError
        where the matrices do not fit together, or a Q is no covariance.

    Notes
    -----
    A step leads from one node to the next, and is cut at every stamp of the input stream; so stamps of
    readings and inputs must be those of the discrete model, and times asked for with `at` are steps too.
    Use `ContinuousProcess` where intervals vary.

    A table (any of F, Q, B with a leading K) takes its row from the *last column of the input stream*, after
    the m columns of B u.  `tabulated_input` builds such a stream.
    """

    F: ArrayLike
    Q: ArrayLike
    B: ArrayLike | None = None
    linear: bool = True

    def __post_init__(self) -> None:
        transition = _matrices(self.F, "F")
        n = transition.shape[-1]
        if transition.shape[-2] != n:
            raise ShapeError(f"F of a LinearProcess is square, (n, n) or (K, n, n); got {transition.shape}")
        given = np.asarray(self.Q, dtype=np.float64)
        if given.ndim == 3:
            cov = np.stack(
                [require_covariance(q, n, f"Q[{k}] of a LinearProcess", definite=False)
                 for k, q in enumerate(given)]
            )  # fmt: skip
        else:
            cov = require_covariance(given, n, "Q of a LinearProcess", definite=False)
        control = None if self.B is None else _matrices(self.B, "B")
        if control is not None and control.shape[-2] != n:
            raise ShapeError(f"B of a LinearProcess has shape ({n}, m) or (K, {n}, m), got {control.shape}")
        for name, value in (("F", transition), ("Q", cov), ("B", control)):
            object.__setattr__(self, name, value)
        lengths = {len(a) for a in (transition, cov, control) if a is not None and a.ndim == 3}
        if len(lengths) > 1:
            raise ShapeError(f"tables of a LinearProcess have the same length, got {sorted(lengths)} rows")

    @property
    def rows(self) -> int:
        """Length K of the table; 0 for matrices that stay the same."""
        return max(len(a) if a.ndim == 3 else 0 for a in self._arrays())

    def _arrays(self) -> tuple[Array, Array, Array]:
        transition, cov = np.asarray(self.F), np.asarray(self.Q)
        control = np.zeros((len(cov[-1]), 0)) if self.B is None else np.asarray(self.B)
        return transition, cov, control

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `ProcessModel.functions`."""
        transition, cov, control = self._arrays()
        n, m = transition.shape[-1], control.shape[-1]
        require_flat(manifold, n, "LinearProcess")
        counts = [len(a) if a.ndim == 3 else 1 for a in (transition, cov, control)]
        params = as_params(n, m, self.rows, counts, transition, cov, control)
        inputs = m + (1 if self.rows else 0)
        return Functions(table_step, table_jacobian, params, inputs, table_noise, helpers=HELPERS)

    def require_inputs(self, values: Array, where: str) -> None:
        """Raise `DataError` where an input asks for a row that the table does not have."""
        if not self.rows:
            return
        asked = values[:, self._arrays()[2].shape[-1]]
        wrong = np.flatnonzero((asked != np.floor(asked)) | (asked < 0) | (asked >= self.rows))
        if len(wrong):
            raise DataError(
                f"{where} asks for row {asked[wrong[0]]:g} at sample {wrong[0]}, but the tables of the "
                f"LinearProcess have rows 0 to {self.rows - 1}; the last column of the input is that row"
            )


def tabulated_input(
    t: ArrayLike,
    inputs: ArrayLike | None = None,
    rows: ArrayLike | None = None,
    *,
    covers: Literal["after", "before"] = "after",
) -> Stream:
    """The input stream of a tabulated `LinearProcess`.

    Parameters
    ----------
    t : (N,) float seconds or int nanoseconds: where a row begins to hold (`covers="before"`: ends)
    inputs : (N, m) what B is multiplied by, where the process has a B
    rows : (N,) row of the table; 0, 1, 2 and so on unless given
    """
    stamps = np.atleast_1d(np.asarray(t))
    index = np.arange(len(stamps)) if rows is None else np.asarray(rows)
    index = index.astype(np.float64).reshape(-1, 1)
    driven = np.zeros((len(index), 0)) if inputs is None else np.asarray(inputs, dtype=np.float64)
    columns = (driven.reshape(len(index), -1), index)
    return Stream(stamps, np.concatenate(columns, axis=1), covers=covers)


def require_flat(manifold: Manifold, n: int, who: str) -> None:
    """Raise `ModelError` unless the state is n plain numbers: a vector, or a product of vectors."""
    if manifold.size != n or any(block.kind != Kind.VECTOR for block in manifold.blocks()):
        raise ModelError(
            f"{who} needs Vector({n}), or a product of vectors of {n} numbers; the state is {manifold}"
        )


def _matrices(given: ArrayLike, name: str) -> Array:
    """A matrix, or a table of them, read-only."""
    own = np.array(given, dtype=np.float64)
    if own.ndim < 2:
        own = np.atleast_2d(own)
        if own.shape[1] > 1 and name == "B":
            own = own.T
    if own.ndim > 3 or not own.size:
        raise ShapeError(f"{name} of a LinearProcess is a matrix or a table of them, got shape {own.shape}")
    if not np.isfinite(own).all():
        raise NotFiniteError(f"{name} of a LinearProcess holds NaN or infinity")
    own.flags.writeable = False
    return own


def table_row(u: Any, p: Any) -> int:
    """Row of the tables; -1 where there is no such row."""
    count = int(p[2])
    if count == 0:
        return 0
    asked = u[int(p[1])]
    return int(asked) if 0.0 <= asked < count else -1


def table_at(p: Any, which: int, row: int) -> int:
    """Where F (0), Q (1) or B (2) of a row begins in p."""
    n = int(p[0])
    square, at = n * n, 6
    if which > 0:
        at += int(p[3]) * square
    if which > 1:
        at += int(p[4]) * square
    return at + (row * n * (n if which < 2 else int(p[1])) if p[3 + which] > 1.0 else 0)


def table_step(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """F x + B u; p = [n, m, rows, how many F, Q, B, then these]."""
    n, m = int(p[0]), int(p[1])
    row = table_row(u, p)
    f, b = table_at(p, 0, row), table_at(p, 2, row)
    for i in range(n):
        total = 0.0 if row >= 0 else math.nan
        if row >= 0:
            for j in range(n):
                total += p[f + i * n + j] * x[j]
            for j in range(m):
                total += p[b + i * m + j] * u[j]
        out[i] = total


def table_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """F itself."""
    n, row = int(p[0]), table_row(u, p)
    f = table_at(p, 0, row)
    for i in range(n * n):
        out[i] = p[f + i] if row >= 0 else math.nan


def table_noise(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """Add Q."""
    n, row = int(p[0]), table_row(u, p)
    q = table_at(p, 1, row)
    for i in range(n * n):
        out[i] += p[q + i] if row >= 0 else math.nan


HELPERS = (table_row, table_at)
