"""Which pictures were matched with which, and how their two-view geometries agree round loops."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ShapeError

__all__ = ["ViewGraph"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class ViewGraph:
    """Pictures as nodes, pairs of them that were matched as edges; arrays are read-only.

    Parameters
    ----------
    names : (N,) every picture that was read, with a pose in the end or without
    features : (N,) keypoints found in each
    pairs : (E, 2) pictures a < b
    matches : (E,) before the geometry of two views was asked for
    inliers : (E,) that agree with it
    kinds : (E,) what the pair is: "general", "planar", "pure rotation", "uncalibrated", "none" …
    b_R_a : (E, 4) quaternion of the relative rotation; NaN where there is none
    """

    names: tuple[str, ...]
    features: Index
    pairs: Index
    matches: Index
    inliers: Index
    kinds: tuple[str, ...]
    b_R_a: Array

    def __post_init__(self) -> None:
        edges = len(self.kinds)
        shapes: dict[str, tuple[type, tuple[int, ...]]] = {
            "features": (np.int64, (len(self.names),)),
            "pairs": (np.int64, (edges, 2)),
            "matches": (np.int64, (edges,)),
            "inliers": (np.int64, (edges,)),
            "b_R_a": (np.float64, (edges, 4)),
        }
        for name, (kind, shape) in shapes.items():
            array: NDArray[np.float64 | np.int64] = np.array(getattr(self, name), dtype=kind)
            if array.size == 0:
                array = array.reshape(shape)
            if array.shape != shape:
                raise ShapeError(f"{name} of a view graph is an array {shape}, got {array.shape}")
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def matrix(self, values: Index) -> Index:
        """(N, N) symmetric table of a quantity of the pairs."""
        table = np.zeros((len(self.names), len(self.names)), dtype=np.int64)
        for (a, b), value in zip(self.pairs, values, strict=True):
            table[a, b] = table[b, a] = value
        return table
