"""Marginal covariances of all variables at once, by dense fronts along the elimination tree.

`gtsam.Marginals` answers one query at a time, some milliseconds each; here every block of the inverse that
the Cholesky factor has room for is computed once, from the root of the tree downwards.  With x_F given its
border x_I as x_F = G x_I + noise of covariance C, the inverse is Z_FI = G Z_II, Z_FF = C + G Z_II Gᵀ
(Takahashi, Fagan, Chen 1973; fronts as in Duff and Reid 1983, "The multifrontal solution of indefinite sparse
symmetric linear systems").
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse import csr_array, diags_array, eye_array
from scipy.sparse.linalg import splu

__all__ = ["diagonal_blocks"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
LEAST_PIVOT = 1e-7  # of columns of length one


@dataclass(slots=True)
class Front:
    """Scalars `first … last` of the eliminated order, and the rows (k,) of the front, those foremost."""

    first: int
    last: int
    rows: Ints
    parent: int
    children: int = 0

    @property
    def own(self) -> int:
        """How many scalars it eliminates."""
        return self.last - self.first


def diagonal_blocks(matrix: Any, dims: Ints) -> list[Array]:
    """Blocks (d, d) on the diagonal of (AᵀA)⁻¹, one for each variable.

    Parameters
    ----------
    matrix : A, sparse (m, N), the columns of each variable next to each other
    dims : (n,) columns of each variable, Σ dims = N

    Raises
    ------
    numpy.linalg.LinAlgError
        where AᵀA is singular.
    """
    squared = np.asarray(matrix.multiply(matrix).sum(axis=0)).ravel()
    if (squared <= 0).any():
        msg = "a column is zero"
        raise np.linalg.LinAlgError(msg)
    scale = 1.0 / np.sqrt(squared)
    scaled = matrix @ diags_array(scale)
    order, fronts = _analysed(scaled, dims)
    begin = np.concatenate([[0], np.cumsum(dims)])
    place = np.concatenate([np.arange(begin[v], begin[v + 1]) for v in order])
    information = (scaled.T @ scaled).tocsc()[place][:, place].tocsc()
    blocks = _inverse(information, fronts)
    new = np.concatenate([[0], np.cumsum(dims[order])])
    found: list[Array] = [np.zeros(0)] * len(dims)
    for k, variable in enumerate(order.tolist()):
        here = scale[begin[variable] : begin[variable + 1]]
        number, offset = _front_of(fronts, int(new[k]))
        part = slice(offset, offset + int(dims[variable]))
        found[variable] = here[:, None] * blocks[number][part, part] * here
    return found


def _front_of(fronts: list[Front], scalar: int) -> tuple[int, int]:
    """Which front eliminates a scalar, and where in it."""
    low, high = 0, len(fronts) - 1
    while low < high:
        middle = (low + high + 1) // 2
        low, high = (middle, high) if fronts[middle].first <= scalar else (low, middle - 1)
    return low, scalar - fronts[low].first


def _analysed(matrix: Any, dims: Ints) -> tuple[Ints, list[Front]]:
    """An order of little fill (n,), and the fronts along it."""
    count = len(dims)
    owner = np.repeat(np.arange(count), dims)
    pattern = csr_array((np.ones(matrix.nnz), owner[matrix.indices], matrix.indptr), (matrix.shape[0], count))
    joined = (pattern.T @ pattern).tocsc()
    joined.data[:] = -1.0
    degree = np.asarray(-joined.sum(axis=0)).ravel()
    dominant = (joined + diags_array(2.0 * degree + 1.0) + eye_array(count)).tocsc()
    factor = splu(
        dominant, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    order = np.argsort(factor.perm_c).astype(np.int64)
    begin = np.concatenate([[0], np.cumsum(dims[order])]).astype(np.int64)
    below = _filled(joined[order][:, order].tocsc())
    fronts: list[Front] = []
    front_of = np.zeros(count, dtype=np.int64)
    start = 0
    for j in range(count):
        whole = j + 1 == count or not _goes_on(below[j], below[j + 1], j)
        if whole:
            border = [np.arange(begin[i], begin[i + 1]) for i in below[j].tolist()]
            rows = np.concatenate([np.arange(begin[start], begin[j + 1]), *border]).astype(np.int64)
            front_of[start : j + 1] = len(fronts)
            parent = int(below[j][0]) if len(below[j]) else -1
            fronts.append(Front(int(begin[start]), int(begin[j + 1]), rows, parent))
            start = j + 1
    for front in fronts:
        if front.parent >= 0:
            front.parent = int(front_of[front.parent])
            fronts[front.parent].children += 1
    return order, fronts


def _filled(pattern: Any) -> list[Ints]:
    """Rows below the diagonal of each column of the Cholesky factor, ascending.

    A column has its own entries and those of its children in the elimination tree (Liu 1990, "The role of
    elimination trees in sparse factorization").  The numbers of a factor cannot tell: along a chain of some
    hundred variables its fill falls below the smallest number there is.
    """
    count = pattern.shape[0]
    parts: list[list[Ints]] = [[] for _ in range(count)]
    below: list[Ints] = []
    for j in range(count):
        own = pattern.indices[pattern.indptr[j] : pattern.indptr[j + 1]].astype(np.int64)
        rows = np.unique(np.concatenate([own, *parts[j]]))
        rows = rows[rows > j]
        parts[j] = []
        if len(rows):
            parts[int(rows[0])].append(rows)
        below.append(rows)
    return below


def _goes_on(here: Ints, ahead: Ints, j: int) -> bool:
    """Whether column j+1 has the pattern of column j without itself, so that one front serves both."""
    return len(here) == len(ahead) + 1 and here[0] == j + 1 and bool(np.array_equal(here[1:], ahead))


def _inverse(information: Any, fronts: list[Front]) -> list[Array]:
    """(own, own) block of the inverse for each front."""
    given: list[list[tuple[Ints, Array]]] = [[] for _ in fronts]
    gains: list[tuple[Array, Array]] = []
    for number, front in enumerate(fronts):
        dense = _assembled(information, front)
        for rows, update in given[number]:
            at = np.searchsorted(front.rows, rows)
            dense[np.ix_(at, at)] += update
        given[number] = []
        own = front.own
        factor = cho_factor(dense[:own, :own], lower=True)
        if np.diagonal(factor[0]).min() < LEAST_PIVOT:
            msg = "a pivot is rounding"
            raise np.linalg.LinAlgError(msg)
        solved = cho_solve(factor, np.concatenate([np.eye(own), dense[:own, own:]], axis=1))
        gain = -solved[:, own:]
        gains.append((solved[:, :own], gain))
        if front.parent >= 0:
            given[front.parent].append((front.rows[own:], dense[own:, own:] + dense[own:, :own] @ gain))
    blocks: list[Array] = [np.zeros(0)] * len(fronts)
    known: dict[int, Array] = {}
    left = [front.children for front in fronts]
    for number in range(len(fronts) - 1, -1, -1):
        front = fronts[number]
        own, (spread, gain) = front.own, gains[number]
        if front.parent >= 0:
            above = fronts[front.parent]
            at = np.searchsorted(above.rows, front.rows[own:])
            border = known[front.parent][np.ix_(at, at)]
            left[front.parent] -= 1
            if not left[front.parent]:
                del known[front.parent]
            cross = gain @ border
            spread = spread + cross @ gain.T
            whole = np.block([[spread, cross], [cross.T, border]]) if front.children else spread
        else:
            whole = spread
        blocks[number] = 0.5 * (spread + spread.T)
        if front.children:
            known[number] = whole
    return blocks


def _assembled(information: Any, front: Front) -> Array:
    """The front's part of the information, its own columns and rows only."""
    size, own = len(front.rows), front.own
    dense = np.zeros((size, size))
    first, last = information.indptr[front.first], information.indptr[front.last]
    rows = information.indices[first:last]
    columns = np.repeat(np.arange(own), np.diff(information.indptr[front.first : front.last + 1]))
    kept = rows >= front.first
    at = np.searchsorted(front.rows, rows[kept])
    dense[at, columns[kept]] = information.data[first:last][kept]
    dense[:own, own:] = dense[own:, :own].T
    return dense
