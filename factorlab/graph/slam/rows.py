"""All measurements of a problem linearised in one vectorised pass: whitened rows of a sparse matrix.

This is the road for models without a native factor, and what every native factor is held to.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.model import Loss
from sequential.slam import Factors, SlamProblem, Values
from sequential.slam.models import Prior

__all__ = ["GroupRows", "Rows", "loss_of", "robust"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
ALL = slice(None)


def robust(loss: Loss | None, squared: Array) -> tuple[Array, Array]:
    """Cost and weight of squared whitened norms (N,); Zhang 1997, table 1, as in `sequential.model.Loss`."""
    if loss is None:
        return 0.5 * squared, np.ones_like(squared)
    norm, k = np.sqrt(squared), loss.k
    if loss.kind == "huber":
        far = norm > k
        safe = np.where(far, norm, 1.0)
        return np.where(far, k * (norm - 0.5 * k), 0.5 * squared), np.where(far, k / safe, 1.0)
    return 0.5 * k * k * np.log1p(squared / (k * k)), k * k / (k * k + squared)


def loss_of(group: Factors, otherwise: Loss | None) -> Loss | None:
    """A group's loss, or the one for groups without; a prior is never doubted by that one."""
    return group.loss or (None if isinstance(group.model, Prior) else otherwise)


class GroupRows:
    """Measurements of one group, whitened.

    Parameters
    ----------
    group : measurements
    loss : where the group brings none of its own
    """

    def __init__(self, group: Factors, loss: Loss | None = None) -> None:
        self.group, self.loss = group, loss_of(group, loss)
        self.z = np.asarray(group.z)
        # upper triangles (m, m), or (N, m, m): GTSAM's square root of the information
        root = np.linalg.cholesky(np.linalg.inv(np.asarray(group.noise_cov)))
        self.root = np.ascontiguousarray(root.swapaxes(-1, -2))

    def errors(self, at: list[Array], rows: Ints | slice = ALL) -> Array:
        """(N, m) errors of some rows over their standard deviations, without the loss."""
        error = self.group.model.errors(self.z[rows], *at)
        whitened: Array = (self._root(rows) @ error[..., None])[..., 0]
        return whitened

    def cost(self, at: list[Array]) -> float:
        """Half the sum of squares, or what the loss makes of it."""
        return float(robust(self.loss, np.square(self.errors(at)).sum(axis=1))[0].sum())

    def linear(self, at: list[Array], rows: Ints | slice = ALL) -> tuple[Array, Array, Array]:
        """Slopes (N, m, d_1 + d_2 …) and right sides (N, m) with the loss's weights, and the costs (N,)."""
        error = self.errors(at, rows)
        cost, weight = robust(self.loss, np.square(error).sum(axis=1))
        slope = self._root(rows) @ np.concatenate(self.group.model.jacobians(self.z[rows], *at), axis=-1)
        if self.loss is not None:
            lighter = np.sqrt(weight)[:, None]
            error, slope = error * lighter, slope * lighter[..., None]
        return slope, -error, cost

    def _root(self, rows: Ints | slice) -> Array:
        return self.root if self.root.ndim == 2 else self.root[rows]


class Rows:
    """Whitened Jacobian and error of a problem at given values, as a sparse matrix with a fixed pattern.

    Parameters
    ----------
    problem : measurements
    index : variables to solve for, by kind, ascending
    loss : of groups that bring none of their own
    """

    def __init__(self, problem: SlamProblem, index: dict[str, Ints], loss: Loss | None = None) -> None:
        self.problem, self.index = problem, index
        self.groups = [group for group in problem.factors if len(group)]
        self.whitened = [GroupRows(group, loss) for group in self.groups]
        self.first: dict[str, int] = {}
        self.columns = 0
        for kind, known in index.items():
            self.first[kind] = self.columns
            self.columns += len(known) * problem.kinds[kind].dim
        self.where = [self._positions(group) for group in self.groups]
        self._pattern()

    def _positions(self, group: Factors) -> list[Ints]:
        """Row of each slot's variable among those of its kind."""
        index = np.asarray(group.index)
        return [np.searchsorted(self.index[slot], index[:, k]) for k, slot in enumerate(group.slots)]

    def _pattern(self) -> None:
        """Columns of every number, and where each row begins."""
        columns, counts = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
        for group, where in zip(self.groups, self.where, strict=True):
            m, parts = group.model.measured.dim, []
            for k, slot in enumerate(group.slots):
                d = self.problem.kinds[slot].dim
                parts.append(self.first[slot] + d * where[k][:, None] + np.arange(d))
            wide = np.concatenate(parts, axis=1)
            columns.append(np.repeat(wide, m, axis=0).ravel())
            counts.append(np.full(len(group) * m, wide.shape[1]))
        self.indices = np.concatenate(columns).astype(np.int32)
        self.pointer = np.concatenate([[0], np.cumsum(np.concatenate(counts))]).astype(np.int32)

    def read(self, values: Values, number: int) -> list[Array]:
        """What the variables of a group are."""
        group, where = self.groups[number], self.where[number]
        return [values.rows[slot][at] for slot, at in zip(group.slots, where, strict=True)]

    def cost(self, values: Values) -> float:
        """Half the sum of squares, or what the losses make of it: GTSAM's error."""
        return sum(rows.cost(self.read(values, n)) for n, rows in enumerate(self.whitened))

    def linearise(self, values: Values) -> tuple[Any, Array, float]:
        """A, b and the cost: a step is the least-squares solution of ``A step = b``."""
        from scipy.sparse import csr_array

        data, right, total = [np.zeros(0)], [np.zeros(0)], 0.0
        for number, rows in enumerate(self.whitened):
            slope, error, cost = rows.linear(self.read(values, number))
            data.append(slope.ravel())
            right.append(error.ravel())
            total += float(cost.sum())
        shape = (len(self.pointer) - 1, self.columns)
        matrix = csr_array((np.concatenate(data), self.indices, self.pointer), shape=shape)
        return matrix, np.concatenate(right), total

    def moved(self, values: Values, step: Array) -> Values:
        """The values after a step (columns,)."""
        rows = {}
        for kind, known in self.index.items():
            manifold, first = self.problem.kinds[kind], self.first[kind]
            part = step[first : first + len(known) * manifold.dim].reshape(len(known), manifold.dim)
            rows[kind] = manifold.retract(values.rows[kind], part)
        return Values(dict(self.index), rows)

    def column(self, kind: str, number: int) -> slice:
        """Columns of the variable that stands at `number` among those of its kind."""
        d = self.problem.kinds[kind].dim
        return slice(self.first[kind] + d * number, self.first[kind] + d * (number + 1))

    def variable(self, column: int) -> tuple[str, int]:
        """Kind and index of the variable that a column belongs to."""
        kind = max((k for k in self.first if self.first[k] <= column), key=lambda k: self.first[k])
        number = (column - self.first[kind]) // self.problem.kinds[kind].dim
        return kind, int(self.index[kind][number])
