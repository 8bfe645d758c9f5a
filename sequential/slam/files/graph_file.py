"""What a graph file holds, before it is a problem: vertices, edges by what they measure, what is held."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, NotPositiveDefiniteError
from sequential.manifold import SE2, SE3, Manifold, Vector
from sequential.slam.estimate import Values

__all__ = ["Edges", "GraphFile"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Edges:
    """Measurements of one kind.

    Parameters
    ----------
    ids : (N, 2) int64, the vertices that each joins, as the file numbers them
    z : (N, size) measurements in our storage
    information : (N, m, m) in our chart: rotation before translation in space
    line : (N,) where each stands in the file, from 1
    """

    ids: Ints
    z: Array
    information: Array
    line: Ints

    def __len__(self) -> int:
        return len(self.ids)

    def covariance(self, where: str) -> Array:
        """(N, m, m); raises `NotPositiveDefiniteError` naming the line whose information has no inverse."""
        lowest = np.linalg.eigvalsh(self.information)[:, 0] if len(self) else np.zeros(0)
        bad = np.flatnonzero(~(lowest > 0))
        if len(bad):
            msg = (
                f"{where}, line {self.line[bad[0]]}: the information matrix has the eigenvalue "
                f"{lowest[bad[0]]:.3g}, and must be positive definite; give every direction some weight"
            )
            raise NotPositiveDefiniteError(msg)
        return np.asarray(np.linalg.inv(self.information)) if len(self) else self.information


def no_edges(size: int, dim: int) -> Edges:
    """None at all."""
    none = np.zeros(0, dtype=np.int64)
    return Edges(none.reshape(0, 2), np.zeros((0, size)), np.zeros((0, dim, dim)), none)


@dataclass(frozen=True, slots=True, eq=False)
class GraphFile:
    """A graph as a file holds it; vertices keep the file's numbers.

    Parameters
    ----------
    where : the file, for messages
    axes : 2, poses (x, y, heading), or 3, poses (qw, qx, qy, qz, x, y, z)
    vertices : values of the poses (kind "x") and of the landmarks (kind "l")
    between : pose against pose
    displacements : landmarks in the frame of a pose, (x, y) or (x, y, z), m
    sightings : (range, bearing) of landmarks, m, rad; in the plane only
    body_T_sensor : (N, 7) for each displacement in space, or None where the body itself sees
    fixed : vertices that the file holds in place
    skipped : lines of tags that are not understood, {tag: count}
    """

    where: str
    axes: int
    vertices: Values
    between: Edges
    displacements: Edges
    sightings: Edges
    body_T_sensor: Array | None = None
    fixed: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    skipped: Mapping[str, int] = field(default_factory=dict)

    @property
    def pose(self) -> Manifold:
        """Where poses live."""
        return SE2() if self.axes == 2 else SE3()

    @property
    def point(self) -> Manifold:
        """Where landmarks live."""
        return Vector(self.axes)

    def pose_ids(self) -> Ints:
        """All poses that a vertex or an edge names, ascending."""
        named = [self.between.ids.ravel(), self.displacements.ids[:, 0], self.sightings.ids[:, 0]]
        return np.unique(np.concatenate([*named, self.vertices.index.get("x", np.zeros(0, np.int64))]))

    def landmark_ids(self) -> Ints:
        """All landmarks, ascending."""
        named = [self.displacements.ids[:, 1], self.sightings.ids[:, 1]]
        return np.unique(np.concatenate([*named, self.vertices.index.get("l", np.zeros(0, np.int64))]))

    def with_vertices(self, values: Values) -> GraphFile:
        """The same measurements with other values, kinds "x" and "l", numbered by rank as in a problem."""
        ids = {"x": self.pose_ids(), "l": self.landmark_ids()}
        for kind, index in values.index.items():
            if kind in ids and (len(index) and index[-1] >= len(ids[kind])):
                msg = (
                    f"{self.where} has {len(ids[kind])} variables of kind {kind!r}, "
                    f"and the values name {kind}{index[-1]}"
                )
                raise DataError(msg)
        named = {kind: ids[kind][index] for kind, index in values.index.items() if kind in ids}
        rows = {kind: values.rows[kind] for kind in named}
        return replace(self, vertices=Values(named, rows))
