"""Which pictures were matched with which, and how their two-view geometries agree round loops."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ShapeError
from sequential.manifold.quaternion import quaternion_inverse, quaternion_multiply

__all__ = ["Loops", "ViewGraph", "angle_of"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]
FEWEST_INLIERS = 30  # of a pair whose rotation is believed
MOST_LOOPS = 20_000


@dataclass(frozen=True, eq=False)
class Loops:
    """Rotations composed round triangles of the view graph; arrays are read-only.

    Parameters
    ----------
    triangles : (T, 3) pictures a < b < c
    errors_rad : (T,) angle of c_R_a, back through b; 0 where the three pairs agree
    """

    triangles: Index
    errors_rad: Array

    def __len__(self) -> int:
        return len(self.errors_rad)


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
    kinds : (E,) what the pair is: "general", "planar", "pure rotation", "flat or turned", "watermark", "none"
    b_R_a : (E, 4) quaternion of the relative rotation, from the two pictures alone; NaN where there is none
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
        a, b = self.pairs.T
        table[a, b] = table[b, a] = values
        return table

    def edges_of(self, picture: int) -> Index:
        """Edges at a picture."""
        return np.flatnonzero((self.pairs == picture).any(axis=1))

    def share_of(self, kind: str) -> float:
        """Share of verified pairs that are of a kind; 0 where there is none."""
        named = [one == kind for one, count in zip(self.kinds, self.inliers, strict=True) if count > 0]
        return sum(named) / len(named) if named else 0.0

    def loops(self) -> Loops:
        """Errors of the rotations round triangles of pairs; of large graphs a part, spread evenly."""
        good = (self.inliers >= FEWEST_INLIERS) & np.isfinite(self.b_R_a).all(axis=1)
        edge = {(int(a), int(b)): k for k, (a, b) in enumerate(self.pairs) if good[k]}
        around: dict[int, set[int]] = {}
        for a, b in edge:
            around.setdefault(a, set()).add(b)
        triangles = [
            (a, *two) for a, later in around.items() for two in combinations(sorted(later), 2) if two in edge
        ]
        if len(triangles) > MOST_LOOPS:
            kept = np.linspace(0, len(triangles) - 1, MOST_LOOPS).astype(int)
            triangles = [triangles[k] for k in kept]
        rows = np.array(triangles, dtype=np.int64).reshape(-1, 3)
        if not len(rows):
            return Loops(rows, np.zeros(0))
        ab, bc, ac = (
            self.b_R_a[[edge[int(row[i]), int(row[j])] for row in rows]] for i, j in ((0, 1), (1, 2), (0, 2))
        )
        around_once = quaternion_multiply(quaternion_inverse(ac), quaternion_multiply(bc, ab))
        return Loops(rows, angle_of(around_once))


def angle_of(q: Array) -> Array:
    """Angles (...,) in rad of rotations given as unit quaternions (..., 4)."""
    angle: Array = 2.0 * np.arctan2(np.linalg.norm(q[..., 1:], axis=-1), np.abs(q[..., 0]))
    return angle
