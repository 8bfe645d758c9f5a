"""SO(2): a heading, stored as one angle in radians."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from sequential.manifold.protocol import Array, Block, Kind, Manifold

__all__ = ["SO2", "wrap_angle"]


def wrap_angle(angle: Array) -> Array:
    """Wrap angles (...), rad, into ]-pi, pi]; angles already inside are returned to the last bit."""
    if np.all(np.abs(angle) < np.pi):
        return np.array(angle)
    wrapped = angle - 2.0 * np.pi * np.ceil((angle - np.pi) / (2.0 * np.pi))
    # Next to the cut the division may round to a whole turn, which leaves the result an ulp outside.
    wrapped = np.where(np.abs(wrapped) >= np.pi, np.pi, wrapped)
    return np.where(np.abs(angle) < np.pi, angle, wrapped)


@final
@dataclass(frozen=True, slots=True)
class SO2(Manifold):
    """Rotations of the plane: storage (angle,), tangent (angle,), both rad; the chart of gtsam.Rot2.

    Notes
    -----
    The group commutes, so its adjoint and its Jacobians are 1 (Sola, Deray, Atchuthan 2018, "A micro Lie
    theory for state estimation in robotics", appendix A).
    """

    size = 1
    dim = 1

    def retract(self, x: Array, xi: Array) -> Array:
        """Add ``xi`` (..., 1) to ``x`` (..., 1) and wrap."""
        return wrap_angle(x + xi)

    def local(self, x: Array, y: Array) -> Array:
        """Give the shortest turn (..., 1) from ``x`` to ``y``, in ]-pi, pi]."""
        return wrap_angle(y - x)

    def transport(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Return ones (..., 1, 1) twice."""
        lead = np.broadcast_shapes(x.shape[:-1], y.shape[:-1])
        return np.ones((*lead, 1, 1)), np.ones((*lead, 1, 1))

    def identity(self) -> Array:
        """Give the zero angle, (1,)."""
        return np.zeros(1)

    def normalize(self, x: Array) -> Array:
        """Wrap (..., 1) into ]-pi, pi]."""
        return wrap_angle(np.asarray(x, dtype=np.float64))

    def blocks(self) -> tuple[Block, ...]:
        """List the single block."""
        return (Block(Kind.SO2, 0, 0, 1, 1),)

    def labels(self) -> tuple[str, ...]:
        """Name the one component."""
        return ("angle",)
