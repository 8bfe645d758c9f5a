"""Rows of residuals that touch neighbouring control values, and how they are brought together."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision3d.inertial.grid import Located

__all__ = ["Interval", "Rows"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Interval:
    """Rows of S intervals of knots, padded to M each: J (S, M, L), e and weight (S, M)."""

    first: Integers
    node: Integers
    J: Array
    e: Array
    weight: Array


@dataclass(frozen=True, eq=False)
class Rows:
    """Residuals of N readings, each of r numbers, whitened.

    Parameters
    ----------
    at : (N,) where the readings are
    J : (N, r, L): by 6 numbers of every control, the constants, and 12 of two bias nodes
    e : (N, r), measured less expected with the sign of GTSAM: expected - measured
    weight : (N,) 1, or less where a reading is not believed
    """

    at: Located
    J: Array
    e: Array
    weight: Array

    @property
    def cost(self) -> float:
        """Half the weighted sum of squares."""
        return 0.5 * float(np.sum(self.weight[:, None] * self.e**2))

    def with_errors(self, e: Array) -> Rows:
        """The same rows with other residuals (N, r)."""
        return Rows(self.at, self.J, e, self.weight)

    def applied(self, controls: Array, constants: Array, nodes: Array, order: int) -> Array:
        """J x, (N, r), for controls (K, 6), constants (q,), nodes (B, 6)."""
        own = controls[self.at.first[:, None] + np.arange(order)].reshape(len(self.e), -1)
        two = nodes[self.at.node[:, None] + np.arange(2)].reshape(len(self.e), -1)
        every = np.broadcast_to(constants, (len(self.e), len(constants)))
        return np.asarray(np.einsum("nrl,nl->nr", self.J, np.hstack([own, every, two])))

    def by_interval(self, most: int) -> Iterator[Interval]:
        """Rows brought together by the interval of knots that they lie in, `most` intervals at a time."""
        if not len(self.e):
            return
        r, length = self.J.shape[1:]
        order = np.argsort(self.at.first, kind="stable")
        first = self.at.first[order]
        starts = np.flatnonzero(np.diff(first, prepend=first[0] - 1))
        sizes = np.diff(np.append(starts, len(first)))
        for k in range(0, len(starts), most):
            begin, own = starts[k : k + most], sizes[k : k + most]
            rows = order[begin[0] : begin[-1] + own[-1]]
            interval = np.repeat(np.arange(len(begin)), own)
            place = np.arange(len(rows)) - np.repeat(begin - begin[0], own)
            shape = len(begin), int(own.max())
            J, e, weight = np.zeros((*shape, r, length)), np.zeros((*shape, r)), np.zeros((*shape, r))
            J[interval, place], e[interval, place] = self.J[rows], self.e[rows]
            weight[interval, place] = self.weight[rows, None]
            m = shape[1] * r
            yield Interval(
                first[begin], self.at.node[order[begin]],
                J.reshape(-1, m, length), e.reshape(-1, m), weight.reshape(-1, m),
            )  # fmt: skip
