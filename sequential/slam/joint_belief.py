"""The joint belief of a SLAM filter: values of the variables it holds and one covariance for all of them.

Every variable owns a block of the tangent.  A block that becomes free holds zeros, which no update touches,
and is given to the next variable of its size, so that poses may come and go while the map stays in place.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from sequential.errors import NotPositiveDefiniteError
from sequential.manifold import Manifold

__all__ = ["JointBelief", "Variable"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Variable = tuple[str, int]
"""Kind and index, as in ("l", 7)."""

GROWTH = 2


class JointBelief:
    """Variables of several kinds with their joint Gaussian; the chart of each is that of its manifold.

    `value` is what is believed, `first` what was believed when the variable was placed, by variable.
    """

    def __init__(self, kinds: Mapping[str, Manifold], capacity: int = 64) -> None:
        self.kinds = dict(kinds)
        self.value: dict[Variable, Array] = {}
        self.first: dict[Variable, Array] = {}
        self.block: dict[Variable, int] = {}  # where its tangent begins
        self.used = 0
        self._free: dict[int, list[int]] = {}
        self._room = np.zeros((capacity, capacity))

    def __contains__(self, variable: Variable) -> bool:
        return variable in self.value

    @property
    def cov(self) -> Array:
        """(used, used) covariance; a view, holes of zeros included."""
        return self._room[: self.used, : self.used]

    def columns(self, variable: Variable) -> slice:
        """Where a variable stands in the tangent."""
        begin = self.block[variable]
        return slice(begin, begin + self.kinds[variable[0]].dim)

    def columns_of(self, variables: Sequence[Variable]) -> Ints:
        """The tangent directions of several variables, in order."""
        blocks = [np.arange(c.start, c.stop) for c in map(self.columns, variables)]
        return np.concatenate(blocks) if blocks else np.zeros(0, dtype=np.int64)

    def marginal(self, variables: Sequence[Variable]) -> Array:
        """Joint covariance of some variables, in the order given."""
        at = self.columns_of(variables)
        return self.cov[np.ix_(at, at)]

    def of_kind(self, kind: str) -> list[Variable]:
        """Variables of a kind, by index."""
        return sorted(v for v in self.value if v[0] == kind)

    def add(
        self, variable: Variable, value: Array, cross: Array, cov: Array, first: Array | None = None
    ) -> None:
        """Append a variable: its covariance (d, d), and with all that is held (d, used)."""
        dim = self.kinds[variable[0]].dim
        at = self._claim(dim)
        rows = slice(at, at + dim)
        width = cross.shape[1]
        self._room[rows, :width] = cross
        self._room[:width, rows] = cross.T
        self._room[rows, rows] = 0.5 * (cov + cov.T)
        self.value[variable] = value
        self.first[variable] = value if first is None else first
        self.block[variable] = at

    def drop(self, variable: Variable) -> None:
        """Marginalise a variable out."""
        rows = self.columns(variable)
        self._room[rows, :] = 0.0
        self._room[:, rows] = 0.0
        self._free.setdefault(rows.stop - rows.start, []).append(rows.start)
        del self.value[variable], self.first[variable], self.block[variable]

    def update(self, at: Ints, jacobian: Array, residual: Array, noise: Array) -> Array:
        """Correct by rows `residual = jacobian @ (error) + noise` over tangent columns `at`.

        The covariance becomes Joseph's form (I - K H) P (I - K H)ᵀ + K R Kᵀ.

        Returns
        -------
        Array
            (used,) the correction, which `move` applies.
        """
        cov = self.cov
        cross = cov[:, at] @ jacobian.T  # P Hᵀ
        innovation = jacobian @ cross[at] + noise
        gain = np.linalg.solve(_sound(innovation), cross.T).T
        once = cov - gain @ cross.T
        twice = once - (once[:, at] @ jacobian.T) @ gain.T + (gain @ noise) @ gain.T
        cov[...] = 0.5 * (twice + twice.T)
        return np.asarray(gain @ residual)

    def move(self, step: Array) -> None:
        """Retract every variable by its part of a tangent step (used,)."""
        for kind, members, at in self.by_kind():
            moved = self.kinds[kind].retract(np.stack([self.value[v] for v in members]), step[at])
            self.value.update(zip(members, moved, strict=True))

    def by_kind(self) -> Iterator[tuple[str, list[Variable], Ints]]:
        """The variables of each kind, and (N, d) the tangent columns of each."""
        for kind, manifold in self.kinds.items():
            members = [v for v in self.value if v[0] == kind]
            if members:
                yield (
                    kind,
                    members,
                    np.array([self.block[v] for v in members])[:, None] + np.arange(manifold.dim),
                )

    def _claim(self, dim: int) -> int:
        """A free block of the tangent."""
        if self._free.get(dim):
            return self._free[dim].pop()
        at, self.used = self.used, self.used + dim
        if self.used > len(self._room):
            wider = np.zeros((GROWTH * self.used, GROWTH * self.used))
            wider[:at, :at] = self._room[:at, :at]
            self._room = wider
        return at


def _sound(innovation: Array) -> Array:
    """The covariance of an innovation, if it is one."""
    smallest = np.linalg.eigvalsh(innovation)[0]
    if not smallest > 0.0:
        msg = (
            f"an innovation has a covariance with the eigenvalue {smallest:.3g}; two readings without noise "
            "contradict each other, or a prior is not positive definite"
        )
        raise NotPositiveDefiniteError(msg)
    return innovation
