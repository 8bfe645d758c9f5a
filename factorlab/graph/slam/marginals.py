"""Marginal covariances of every variable, by GTSAM's Bayes tree over our rows."""

from __future__ import annotations

from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.slam.multifrontal import diagonal_blocks
from factorlab.graph.slam.rows import Rows
from factorlab.graph.slam.variables import keys_of
from factorlab.graph.solve import readable
from sequential.model import Loss
from sequential.slam import SlamProblem, Values

__all__ = ["gaussian_graph", "marginals", "marginals_of"]

Array = NDArray[np.float64]
MANY = 500  # variables beyond which one pass over all blocks beats a query each


def gaussian_graph(rows: Rows, values: Values) -> Any:
    """The rows at given values as a `gtsam.GaussianFactorGraph`, one factor for each measurement."""
    matrix, right, _ = rows.linearise(values)
    graph, row, number = gtsam.GaussianFactorGraph(), 0, 0
    for group in rows.groups:
        m, dims = group.model.measured.dim, [rows.problem.kinds[slot].dim for slot in group.slots]
        wide, count = sum(dims), len(group)
        blocks = matrix.data[number : number + count * m * wide].reshape(count, m, wide)
        unit = gtsam.noiseModel.Unit.Create(m)
        ends = np.cumsum([0, *dims]).tolist()
        keys = [keys_of(slot, np.asarray(group.index)[:, k]) for k, slot in enumerate(group.slots)]
        for n in range(count):
            terms: list[Any] = []
            for k, column in enumerate(keys):
                terms += [column[n], blocks[n][:, ends[k] : ends[k + 1]]]
            graph.push_back(gtsam.JacobianFactor(*terms, right[row + n * m : row + (n + 1) * m], unit))
        row, number = row + count * m, number + count * m * wide
    return graph


def marginals(
    problem: SlamProblem, values: Values, *, asked: bool | tuple[str, ...] = True, loss: Loss | None = None
) -> dict[str, Array]:
    """(n, d, d) of the variables of all kinds, of those asked for, or of none.

    Linearised at the values, robust weights taken there.

    Raises
    ------
    UnderConstrainedError
    """
    kinds = tuple(values.index) if asked is True else asked or ()
    if not kinds:
        return {}
    return marginals_of(Rows(problem, dict(values.index), loss), values, kinds)


def marginals_of(rows: Rows, values: Values, kinds: tuple[str, ...]) -> dict[str, Array]:
    """The same from rows that are there already; raises `UnderConstrainedError`."""
    if sum(map(len, rows.index.values())) > MANY and (blocks := _all_at_once(rows, values)):
        return {kind: blocks[kind] for kind in kinds if kind in blocks}
    with readable():
        found = gtsam.Marginals(gaussian_graph(rows, values), gtsam.Values())
        return {
            kind: np.array([found.marginalCovariance(key) for key in keys_of(kind, rows.index[kind])])
            for kind in kinds
            if kind in rows.index
        }


def _all_at_once(rows: Rows, values: Values) -> dict[str, Array]:
    """All blocks by dense fronts; nothing where the rows leave a direction free, which GTSAM then names."""
    counts = {kind: len(known) for kind, known in rows.index.items()}
    dims = np.repeat([rows.problem.kinds[kind].dim for kind in counts], list(counts.values()))
    try:
        blocks = diagonal_blocks(rows.linearise(values)[0], dims)
    except np.linalg.LinAlgError:
        return {}
    ends = np.cumsum([0, *counts.values()]).tolist()
    return {kind: np.array(blocks[ends[k] : ends[k + 1]]) for k, kind in enumerate(counts)}
