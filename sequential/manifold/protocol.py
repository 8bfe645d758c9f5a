"""What every manifold knows: how to move a flat state, how to compare two, how to carry a covariance.

A state is a flat ``float64`` array of length ``n`` (its *storage*); a small change of it is an array of
length ``d`` (its *tangent*).  A manifold object holds no state, only the rules, so a filter, a graph and
a compiled kernel can share one description.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, NotFiniteError, ShapeError

__all__ = ["UNIT_TOLERANCE", "Array", "Block", "Kind", "Manifold"]

Array = NDArray[np.float64]

UNIT_TOLERANCE = 1e-6
"""How far from 1 the norm of a stored quaternion may lie before :meth:`Manifold.check` refuses it."""


class Kind(IntEnum):
    """Elementary manifolds, by the number under which the compiled kernels know them."""

    VECTOR = 0
    SO2 = 1
    SO3 = 2
    SE2 = 3
    SE3 = 4
    NAV = 5


QUATERNION_KINDS = frozenset({Kind.SO3, Kind.SE3, Kind.NAV})
"""Kinds whose storage begins with a unit quaternion (w, x, y, z)."""


@dataclass(frozen=True, slots=True)
class Block:
    """One elementary manifold inside a flat state.

    Parameters
    ----------
    kind : Kind
        Which rules apply to the block.
    storage, tangent : int
        Where the block starts in the state (n,) and in the tangent (d,).
    size, dim : int
        How many numbers it takes in each.
    """

    kind: Kind
    storage: int
    tangent: int
    size: int
    dim: int


class Manifold(abc.ABC):
    """The rules of one state space; see the module docstring for storage and tangent.

    In every method the leading axes ``...`` of the arguments broadcast.  States that a manifold returns
    are canonical: quaternions of unit norm with ``qw >= 0``, angles in ]-pi, pi].

    Notes
    -----
    ``retract`` is the ⊞ and ``local`` the ⊟ of Hertzberg et al. 2013, "Integrating generic sensor fusion
    algorithms with sound state representations through encapsulation of manifolds".  All charts are
    GTSAM's, so that a filter covariance and a graph marginal are the same matrix.
    """

    __slots__ = ()

    @property
    @abc.abstractmethod
    def size(self) -> int:
        """Length n of the storage."""

    @property
    @abc.abstractmethod
    def dim(self) -> int:
        """Length d of the tangent."""

    @abc.abstractmethod
    def retract(self, x: Array, xi: Array) -> Array:
        """Move the state ``x`` (..., n) by the tangent step ``xi`` (..., d); returns (..., n)."""

    @abc.abstractmethod
    def local(self, x: Array, y: Array) -> Array:
        """Give the step (..., d) that leads from ``x`` to ``y``, both (..., n): the inverse of retract."""

    @abc.abstractmethod
    def transport(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Linearise ``e = local(x, y)`` at both ends.

        Parameters
        ----------
        x, y : Array
            States (..., n).

        Returns
        -------
        T, Jinv : Array
            Both (..., d, d).  With ``J`` the derivative of ``e`` by a step at ``y`` and ``J_from`` by a
            step at ``x``: ``Jinv = inv(J)`` turns a change of ``e`` into a step at ``y``, and
            ``T = -Jinv @ J_from`` is the step at ``y`` that leaves ``e`` unchanged when ``x`` moves.
        """

    @abc.abstractmethod
    def identity(self) -> Array:
        """Give the origin of the manifold, (n,)."""

    @abc.abstractmethod
    def normalize(self, x: Array) -> Array:
        """Return the canonical storage (..., n) of ``x``: unit quaternion, ``qw >= 0``, wrapped angles."""

    @abc.abstractmethod
    def blocks(self) -> tuple[Block, ...]:
        """List the elementary manifolds that the state is made of, in storage order."""

    @abc.abstractmethod
    def labels(self) -> tuple[str, ...]:
        """Name the d tangent components, for axes of plots and columns of tables."""

    def random(self, rng: np.random.Generator, scale: float = 1.0, shape: tuple[int, ...] = ()) -> Array:
        """Draw states (*shape, n): the identity moved by normal steps of standard deviation ``scale``."""
        return self.retract(self.identity(), scale * rng.standard_normal((*shape, self.dim)))

    def table(self) -> NDArray[np.int64]:
        """Describe the blocks to a compiled kernel: (B, 5) rows of kind, storage, tangent, size, dim."""
        rows = [(int(b.kind), b.storage, b.tangent, b.size, b.dim) for b in self.blocks()]
        return np.array(rows, dtype=np.int64)

    def check(self, x: ArrayLike) -> None:
        """Refuse what is not a state of this manifold.

        Raises
        ------
        ShapeError
            If the last axis does not have length n.
        NotFiniteError
            If a component is NaN or infinite.
        DataError
            If ``x`` is not numeric, or a quaternion is not of unit norm within `UNIT_TOLERANCE`.
        """
        try:
            state = np.asarray(x, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise DataError(
                f"a state of {self!r} must be an array of {self.size} numbers: {error}"
            ) from error
        self._check_length(state)
        self._check_finite(state)
        for block in self.blocks():
            if block.kind in QUATERNION_KINDS:
                self._check_unit(state, block.storage)

    def _check_length(self, state: Array) -> None:
        if state.ndim == 0 or state.shape[-1] != self.size:
            raise ShapeError(f"a state of {self!r} has shape (..., {self.size}), got {state.shape}")

    def _check_finite(self, state: Array) -> None:
        bad = np.argwhere(~np.isfinite(state))
        if len(bad):
            where = tuple(int(i) for i in bad[0])
            raise NotFiniteError(
                f"a state of {self!r} must be finite, got {state[where]} at index {list(where)}"
                f" ({len(bad)} such value{'s' if len(bad) > 1 else ''}); drop or repair the sample"
            )

    def _check_unit(self, state: Array, start: int) -> None:
        norm = np.linalg.norm(state[..., start : start + 4], axis=-1)
        worst = float(norm.flat[np.argmax(np.abs(norm - 1.0))]) if norm.size else 1.0
        if abs(worst - 1.0) > UNIT_TOLERANCE:
            raise DataError(
                f"components {start}:{start + 4} of a state of {self!r} are a unit quaternion (w, x, y, z),"
                f" got norm {worst:.7g}; pass it through normalize() first"
            )
