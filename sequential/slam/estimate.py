"""What is known of the variables: values by kind and index, and what an estimator returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ShapeError
from sequential.history import Innovations, Report, Run
from sequential.manifold import Manifold

__all__ = ["SlamRun", "Values"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Values:
    """Values of variables: for each kind its indices (n,), ascending, and rows (n, size)."""

    index: Mapping[str, Ints]
    rows: Mapping[str, Array]

    def __post_init__(self) -> None:
        for kind, index in self.index.items():
            if len(index) != len(self.rows[kind]) or (np.diff(index) <= 0).any():
                msg = f"values of kind {kind!r} need one row for each of their ascending indices"
                raise ShapeError(msg)
        for values in (*self.index.values(), *self.rows.values()):
            values.flags.writeable = False

    def at(self, kind: str, index: NDArray[np.int64]) -> Array:
        """(N, size) rows of some variables; `DataError` names the first that is missing."""
        known = self.index.get(kind, np.zeros(0, dtype=np.int64))
        where = np.searchsorted(known, index)
        found = where < len(known)
        found[found] = known[where[found]] == np.asarray(index)[found]
        if not found.all():
            which = f"{kind}{np.asarray(index)[~found][0]}"
            msg = f"there is no value for {which}; give it one, or drop what names it"
            raise DataError(msg)
        return self.rows[kind][where]

    def has(self, kind: str, index: NDArray[np.int64]) -> NDArray[np.bool_]:
        """(N,) which variables have a value."""
        return np.isin(index, self.index.get(kind, np.zeros(0, dtype=np.int64)))


@dataclass(frozen=True, slots=True, eq=False)
class SlamRun:
    """What an estimator of a `SlamProblem` returns.

    Parameters
    ----------
    values : all variables, as last believed: smoothed by a graph, filtered (poses when they were newest,
        landmarks at the end) by a filter
    covs : marginal covariances (n, d, d) of kinds, in the order of `values`; kinds may be missing
    online : for an online estimator, what it believed of the newest pose at each step: a `Run` on the pose's
        manifold (`t` in ns, mean (K, n), cov (K, d, d)); None for a batch
    innovations : by the place of the factors in the problem, as text
    associations : (N,) landmark of each reading that came without an id, -1 rejected; None where all have one
    """

    values: Values
    covs: Mapping[str, Array]
    manifolds: Mapping[str, Manifold]
    report: Report
    online: Run | None = None
    innovations: Mapping[str, Innovations] = field(default_factory=dict)
    associations: Ints | None = None

    def trajectory(self, t: Ints, kind: str = "x") -> Run:
        """The smoothed variables of one kind as a `Run`; `t` (n,) ns are their times."""
        cov = self.covs.get(kind)
        mean = self.values.rows[kind]
        d = self.manifolds[kind].dim
        spread = np.full((len(mean), d, d), np.nan) if cov is None else cov
        return Run(t, mean, spread, self.manifolds[kind], self.innovations, float("nan"), self.report)
