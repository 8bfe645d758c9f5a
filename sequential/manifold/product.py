"""Products: several manifolds side by side in one flat state, each under a name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from itertools import accumulate
from types import MappingProxyType
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from sequential.errors import DataError, ShapeError
from sequential.manifold.protocol import Array, Block, Manifold

__all__ = ["Product"]


@final
@dataclass(frozen=True, slots=True, init=False, repr=False)
class Product(Manifold):
    """Named parts, stored one after the other in the order given; nothing couples them.

    Parameters
    ----------
    **parts : Manifold
        The parts, products among them; equality of two products includes names and order.

    Raises
    ------
    DataError
        If there is no part, or one is not a manifold.

    Examples
    --------
    >>> from sequential.manifold import SE2, Product, Vector
    >>> state = Product(pose=SE2(), bias=Vector(1))
    >>> x = state.pack(pose=[1.0, 2.0, 0.5], bias=[0.01])
    >>> x[state.storage("bias")]
    array([0.01])
    """

    names: tuple[str, ...]
    members: tuple[Manifold, ...]

    def __init__(self, /, **parts: Manifold) -> None:
        """Keep names and members in order."""
        if not parts:
            raise DataError(
                "a Product needs at least one named part, as in Product(pose=SE2(), bias=Vector(1))"
            )
        for name, part in parts.items():
            if not isinstance(part, Manifold):
                raise DataError(f"part {name!r} of a Product must be a Manifold, got {part!r}")
        object.__setattr__(self, "names", tuple(parts))
        object.__setattr__(self, "members", tuple(parts.values()))

    def __repr__(self) -> str:
        """Write the product the way it is constructed."""
        return f"Product({', '.join(f'{n}={m!r}' for n, m in self.parts.items())})"

    @property
    def size(self) -> int:
        """Length n of the storage, the sum over the parts."""
        return sum(part.size for part in self.members)

    @property
    def dim(self) -> int:
        """Length d of the tangent, the sum over the parts."""
        return sum(part.dim for part in self.members)

    @property
    def parts(self) -> Mapping[str, Manifold]:
        """The parts by name, read-only."""
        return MappingProxyType(dict(zip(self.names, self.members, strict=True)))

    def part(self, name: str) -> Manifold:
        """Give the manifold called ``name``; DataError if there is none."""
        return self.members[self._index(name)]

    def storage(self, name: str) -> slice:
        """Say where the part lies in the state (n,)."""
        return self._storage_slices()[self._index(name)]

    def tangent(self, name: str) -> slice:
        """Say where the part lies in the tangent (d,)."""
        return self._tangent_slices()[self._index(name)]

    def pack(self, **values: ArrayLike) -> Array:
        """Join states of all the parts, each (..., n_part), into one (..., n); leading axes broadcast.

        Raises
        ------
        DataError
            If a part is missing or unknown.
        ShapeError
            If a value has the wrong length.
        """
        for name in (*values, *self.names):
            self._index(name)
            if name not in values:
                raise DataError(f"pack() of {self!r} needs a value for every part, {name!r} is missing")
        arrays = [_last_axis(name, part, values[name]) for name, part in self.parts.items()]
        lead = np.broadcast_shapes(*(a.shape[:-1] for a in arrays))
        return np.concatenate([np.broadcast_to(a, (*lead, a.shape[-1])) for a in arrays], axis=-1)

    def unpack(self, x: Array) -> dict[str, Array]:
        """Split a state (..., n) into views (..., n_part) by name."""
        return {name: x[..., s] for name, s in zip(self.names, self._storage_slices(), strict=True)}

    def retract(self, x: Array, xi: Array) -> Array:
        """Move every part of ``x`` (..., n) by its share of ``xi`` (..., d)."""
        return np.concatenate([m.retract(x[..., s], xi[..., t]) for m, s, t in self._layout()], axis=-1)

    def local(self, x: Array, y: Array) -> Array:
        """Give the step (..., d) from ``x`` to ``y``, part by part."""
        return np.concatenate([m.local(x[..., s], y[..., s]) for m, s, _ in self._layout()], axis=-1)

    def transport(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Return the block-diagonal T and Jinv, both (..., d, d)."""
        lead = np.broadcast_shapes(x.shape[:-1], y.shape[:-1])
        carried = np.zeros((*lead, self.dim, self.dim))
        inverse_jacobian = np.zeros_like(carried)
        for member, s, t in self._layout():
            carried[..., t, t], inverse_jacobian[..., t, t] = member.transport(x[..., s], y[..., s])
        return carried, inverse_jacobian

    def identity(self) -> Array:
        """Give the identity of every part, (n,)."""
        return np.concatenate([part.identity() for part in self.members])

    def normalize(self, x: Array) -> Array:
        """Return the canonical storage (..., n) of every part."""
        state = np.asarray(x, dtype=np.float64)
        return np.concatenate([m.normalize(state[..., s]) for m, s, _ in self._layout()], axis=-1)

    def blocks(self) -> tuple[Block, ...]:
        """List the elementary blocks, nested products flattened."""
        return tuple(
            replace(block, storage=s.start + block.storage, tangent=t.start + block.tangent)
            for member, s, t in self._layout()
            for block in member.blocks()
        )

    def labels(self) -> tuple[str, ...]:
        """Name the tangent components ``part.component``."""
        return tuple(f"{name}.{label}" for name, part in self.parts.items() for label in part.labels())

    def _index(self, name: str) -> int:
        if name not in self.names:
            near = get_close_matches(name, self.names, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise DataError(f"{self!r} has parts {', '.join(self.names)}, not {name!r}{hint}")
        return self.names.index(name)

    def _storage_slices(self) -> list[slice]:
        return _consecutive([part.size for part in self.members])

    def _tangent_slices(self) -> list[slice]:
        return _consecutive([part.dim for part in self.members])

    def _layout(self) -> Iterator[tuple[Manifold, slice, slice]]:
        return zip(self.members, self._storage_slices(), self._tangent_slices(), strict=True)


def _consecutive(lengths: list[int]) -> list[slice]:
    """Lay pieces of the given lengths end to end."""
    return [slice(end - n, end) for n, end in zip(lengths, accumulate(lengths), strict=True)]


def _last_axis(name: str, part: Manifold, value: ArrayLike) -> Array:
    """Read the value of one part as an array (..., n_part); a bare number serves where n_part is 1."""
    array = np.atleast_1d(np.asarray(value, dtype=np.float64))
    if array.shape[-1] != part.size:
        raise ShapeError(f"part {name!r} is {part!r} with shape (..., {part.size}), got {array.shape}")
    return array
