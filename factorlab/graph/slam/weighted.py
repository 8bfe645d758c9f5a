"""The rows of a problem with a weight on each measurement that is doubted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from factorlab.graph.slam.graduated import Schedule
from factorlab.graph.slam.rows import Rows
from sequential.slam import SlamProblem, Values

__all__ = ["Weighted"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Ints = NDArray[np.int64]


class Weighted:
    """The rows of a problem with weights on what is doubted.

    Parameters
    ----------
    doubts : (N,) of each group
    confidence : quantile of χ² that bounds an inlier
    """

    def __init__(
        self,
        problem: SlamProblem,
        index: dict[str, NDArray[np.int64]],
        doubts: list[Flags],
        confidence: float,
    ) -> None:
        from scipy.stats import chi2

        self.problem = problem
        plain = tuple(replace(group, loss=None) for group in problem.factors)
        self.rows = Rows(replace(problem, factors=plain), index)
        self.doubts = [doubt for doubt, group in zip(doubts, problem.factors, strict=True) if len(group)]
        self.roots = [one.root for one in self.rows.whitened]
        dims = [group.model.measured.dim for group in self.rows.groups]
        bounds = [
            np.full(int(doubt.sum()), chi2.ppf(confidence, m))
            for doubt, m in zip(self.doubts, dims, strict=True)
        ]
        self.bound = np.concatenate(bounds) if bounds else np.zeros(0)
        self.count = len(self.bound)
        self._weights = np.ones(self.count)

    def weigh(self, weights: Array) -> None:
        """Set the weights (count,) of all doubted measurements."""
        self._weights, first = weights, 0
        for number, doubt in enumerate(self.doubts):
            here = int(doubt.sum())
            if not here:
                continue
            root = self.roots[number]
            each = np.ones(len(doubt))
            each[doubt] = np.sqrt(weights[first : first + here])
            self.rows.whitened[number].root = each[:, None, None] * root
            first += here

    def weights_now(self) -> Array:
        """(count,)."""
        return self._weights

    def squared(self, values: Values) -> Array:
        """(count,) squared whitened residuals of what is doubted, weights left out."""
        found = []
        for number, doubt in enumerate(self.doubts):
            if doubt.any():
                group = self.rows.groups[number]
                error = group.model.errors(np.asarray(group.z), *self.rows.read(values, number))[doubt]
                root = self.roots[number]
                root = root[doubt] if root.ndim == 3 else root
                found.append(np.square((root @ error[..., None])[..., 0]).sum(axis=1))
        return np.concatenate(found) if found else np.zeros(0)

    def tighten(self, values: Values, generous: float) -> bool:
        """Shrink the bounds where what is believed fits far better than stated; gives whether they shrank."""
        free = len(self.rows.pointer) - 1 - self.rows.columns
        free -= sum(
            group.model.measured.dim * int((w < 1).sum())
            for group, w in zip(self.problem.factors, self.by_group(), strict=True)
        )
        scale = generous * 2.0 * self.rows.cost(values) / max(free, 1)
        if free < 1 or scale >= 1.0:
            return False
        self.bound = self.bound * scale
        return True

    def residuals_and_slopes(self, values: Values, which: Ints) -> list[tuple[Array, Array, Ints]]:
        """Whitened residual (m,), Jacobian (m, c) and the columns (c,) of its variables, for some of them."""
        found: dict[int, tuple[Array, Array, Ints]] = {}
        first = 0
        for number, doubt in enumerate(self.doubts):
            rows = np.flatnonzero(doubt)
            wanted = np.flatnonzero((which >= first) & (which < first + len(rows)))
            if len(wanted):
                self._of_group(number, rows[which[wanted] - first], values, wanted, found)
            first += len(rows)
        return [found[k] for k in range(len(which))]

    def _of_group(
        self,
        number: int,
        rows: Ints,
        values: Values,
        place: Ints,
        found: dict[int, tuple[Array, Array, Ints]],
    ) -> None:
        group, root = self.rows.groups[number], self.roots[number]
        at = [value[rows] for value in self.rows.read(values, number)]
        z = np.asarray(group.z)[rows]
        root = root[rows] if root.ndim == 3 else root
        error = (root @ group.model.errors(z, *at)[..., None])[..., 0]
        slope = root @ np.concatenate(group.model.jacobians(z, *at), axis=-1)
        where = [numbers[rows] for numbers in self.rows.where[number]]
        for n, k in enumerate(place.tolist()):
            slices = [self.rows.column(s, int(w[n])) for s, w in zip(group.slots, where, strict=True)]
            columns = np.concatenate([np.arange(one.start, one.stop) for one in slices])
            found[k] = error[n], slope[n], columns

    def plausible(self, values: Values) -> bool:
        """Whether at least half of what is doubted lies within its bound."""
        return not self.count or float(np.median(self.squared(values) / self.bound)) < 1.0

    def robust_cost(self, values: Values, schedule: Schedule) -> float:
        """Twice the cost of what is trusted, and what the schedule makes of the rest."""
        now = self._weights
        self.weigh(np.zeros(self.count))
        trusted = 2.0 * self.rows.cost(values)
        self.weigh(now)
        return trusted + schedule.cost(self.squared(values), self.bound)

    def by_group(self) -> tuple[Array, ...]:
        """(N,) for each group of the problem."""
        found, first, full = [], 0, iter(self.doubts)
        for group in self.problem.factors:
            each = np.ones(len(group))
            if len(group):
                doubt = next(full)
                here = int(doubt.sum())
                each[doubt] = self._weights[first : first + here]
                first += here
            each.flags.writeable = False
            found.append(each)
        return tuple(found)
