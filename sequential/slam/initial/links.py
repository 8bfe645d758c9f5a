"""What a problem says of pose against pose, as arrays: the part that all initialisations work on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from sequential.errors import ModelError, UnderConstrainedError
from sequential.manifold import SE2, SE3, Manifold
from sequential.slam.problem import SlamProblem

__all__ = ["Links", "links_of"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Links:
    """Relative poses between nodes 0 … n-1.

    Parameters
    ----------
    kind : of the variables
    manifold : SE2 or SE3
    index : (n,) index of each node in the problem, ascending
    tail, head : (N,) nodes; z is `tail⁻¹ head`
    z : (N, 3) or (N, 7)
    cov : (N, d, d) in the chart at z
    anchors : (k,) nodes whose pose a prior tells
    poses : (k, 3) or (k, 7) those poses
    """

    kind: str
    manifold: Manifold
    index: Ints
    tail: Ints
    head: Ints
    z: Array
    cov: Array
    anchors: Ints
    poses: Array

    @property
    def count(self) -> int:
        """How many nodes."""
        return len(self.index)

    def require_connected(self) -> None:
        """Raise `UnderConstrainedError` naming a pose that no chain of links ties to a known one."""
        ones = np.ones(len(self.tail))
        whole = coo_matrix((ones, (self.tail, self.head)), shape=(self.count, self.count))
        pieces, label = connected_components(whole, directed=False)
        lost = np.flatnonzero(~np.isin(label, label[self.anchors]))
        if len(lost):
            msg = (
                f"{len(lost)} of {self.count} poses, {self.kind}{self.index[lost[0]]} the first, are joined "
                f"to no pose that a prior tells (the graph has {pieces} pieces); add an edge, or a prior"
            )
            raise UnderConstrainedError(msg)


def links_of(problem: SlamProblem, kind: str = "x") -> Links:
    """Relative poses and priors of one kind.

    Raises
    ------
    ModelError
        where there are none, or the kind does not hold poses.
    UnderConstrainedError
        where the graph falls into pieces, or nothing tells any pose.
    """
    from sequential.slam.models import Between, Prior

    manifold = problem.kinds[kind]
    if not isinstance(manifold, SE2 | SE3):
        msg = f"variables of kind {kind!r} live on {manifold}; poses on SE2 or SE3 are needed here"
        raise ModelError(msg)
    index = problem.indices(kind)
    pairs = [g for g in problem.factors if isinstance(g.model, Between) and g.slots == (kind, kind)]
    priors = [g for g in problem.factors if isinstance(g.model, Prior) and g.slots == (kind,)]
    if not pairs:
        msg = f"no factor measures one variable of kind {kind!r} against another; nothing to begin from"
        raise ModelError(msg)
    ends = np.searchsorted(index, np.concatenate([np.asarray(g.index) for g in pairs]))
    known = [np.asarray(g.index)[:, 0] for g in priors]
    if not known:
        msg = f"no prior tells any variable of kind {kind!r}; add one, such as on {kind}{index[0]}"
        raise UnderConstrainedError(msg)
    links = Links(
        kind,
        manifold,
        index,
        ends[:, 0],
        ends[:, 1],
        np.concatenate([np.asarray(g.z) for g in pairs]),
        np.concatenate([g.covs() for g in pairs]),
        np.searchsorted(index, np.concatenate(known)),
        np.concatenate([np.asarray(g.z) for g in priors]),
    )
    links.require_connected()
    return links
