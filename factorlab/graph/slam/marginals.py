"""Marginal covariances of every variable, by GTSAM's Bayes tree over our rows."""

from __future__ import annotations

from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.slam.rows import Rows
from factorlab.graph.slam.variables import keys_of
from factorlab.graph.solve import readable
from sequential.slam import Values

__all__ = ["gaussian_graph", "marginals"]

Array = NDArray[np.float64]


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


def marginals(rows: Rows, values: Values, kinds: tuple[str, ...]) -> dict[str, Array]:
    """(n, d, d) of the variables of kinds, linearised at the values, robust weights taken there.

    Raises
    ------
    UnderConstrainedError
    """
    with readable():
        graph = gaussian_graph(rows, values)
        found = gtsam.Marginals(graph, gtsam.Values())
        return {
            kind: np.array([found.marginalCovariance(key) for key in keys_of(kind, rows.index[kind])])
            for kind in kinds
            if kind in rows.index
        }
