"""The flat space R^n: positions, velocities, biases, everything that simply adds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from sequential.errors import ShapeError
from sequential.manifold.protocol import Array, Block, Kind, Manifold

__all__ = ["Vector"]


@final
@dataclass(frozen=True, slots=True)
class Vector(Manifold):
    """Vectors of ``n`` numbers, in whatever unit the model gives them; storage and tangent coincide.

    Parameters
    ----------
    n : int
        Length, at least 1.

    Raises
    ------
    ShapeError
        If ``n`` is below 1.
    """

    n: int

    def __post_init__(self) -> None:
        """Refuse an empty vector, which would leave a state without components."""
        if self.n < 1:
            raise ShapeError(f"a Vector has at least one component, got n = {self.n}")

    @property
    def size(self) -> int:
        """Length n of the storage."""
        return self.n

    @property
    def dim(self) -> int:
        """Length of the tangent, n as well."""
        return self.n

    def retract(self, x: Array, xi: Array) -> Array:
        """Add: ``x + xi``, (..., n)."""
        return x + xi

    def local(self, x: Array, y: Array) -> Array:
        """Subtract: ``y - x``, (..., n)."""
        return y - x

    def transport(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Return identity matrices (..., n, n) twice: a flat space carries steps unchanged."""
        lead = np.broadcast_shapes(x.shape[:-1], y.shape[:-1])
        eye = np.broadcast_to(np.eye(self.n), (*lead, self.n, self.n))
        return eye.copy(), eye.copy()

    def identity(self) -> Array:
        """Give the zero vector (n,)."""
        return np.zeros(self.n)

    def normalize(self, x: Array) -> Array:
        """Copy ``x`` (..., n): every vector is canonical."""
        return np.array(x, dtype=np.float64)

    def blocks(self) -> tuple[Block, ...]:
        """List the single block."""
        return (Block(Kind.VECTOR, 0, 0, self.n, self.n),)

    def labels(self) -> tuple[str, ...]:
        """Name the components x0, x1 and so on."""
        return tuple(f"x{i}" for i in range(self.n))
