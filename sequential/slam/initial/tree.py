"""Poses composed along a spanning tree: of short paths, or of the odometry first."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from sequential.errors import UnderConstrainedError
from sequential.manifold import SE2
from sequential.slam.initial.links import Links

__all__ = ["spanning_tree", "tree_poses"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


def spanning_tree(links: Links, weight: Array | None = None) -> tuple[Ints, Ints]:
    """A tree of shortest paths from the anchors.

    Parameters
    ----------
    weight : (N,) length of each link; by default the trace of its rotation's covariance, so that headings
        come along the surest way

    Returns
    -------
    parent : (n,) node before each, -1 at anchors
    link : (n,) link between the two, -1 at anchors
    """
    turn = slice(2, 3) if isinstance(links.manifold, SE2) else slice(0, 3)
    if weight is None:
        weight = np.trace(links.cov[:, turn, turn], axis1=1, axis2=2)
    n = links.count
    low, high = np.minimum(links.tail, links.head), np.maximum(links.tail, links.head)
    order = np.lexsort((weight, high, low))
    first = np.concatenate([[True], np.diff(low[order] * n + high[order]) != 0])
    best = order[first]  # the surest link of each pair
    graph = coo_matrix((weight[best] + np.finfo(float).tiny, (low[best], high[best])), shape=(n, n)).tocsr()
    _, parent, _ = dijkstra(
        graph, directed=False, indices=links.anchors, return_predecessors=True, min_only=True
    )
    parent = np.where(parent < 0, -1, parent).astype(np.int64)
    if len(lost := np.setdiff1d(np.flatnonzero(parent < 0), links.anchors)):
        msg = f"{links.kind}{links.index[lost[0]]} is joined to no pose that a prior tells"
        raise UnderConstrainedError(msg)
    keys = low[best] * n + high[best]
    wanted = np.minimum(parent, np.arange(n)) * n + np.maximum(parent, np.arange(n))
    where = np.searchsorted(keys, np.maximum(wanted, 0)).clip(max=len(keys) - 1)
    return parent, np.where(parent < 0, -1, best[where])


def tree_poses(links: Links, weight: Array | None = None) -> Array:
    """Poses (n, size) along a spanning tree; all paths are composed at once, in log₂ of the depth steps."""
    from sequential.slam.models.groups import compose, inverse

    parent, link = spanning_tree(links, weight)
    manifold, nodes = links.manifold, np.arange(links.count)
    step = np.tile(manifold.identity(), (links.count, 1))
    moved = parent >= 0
    ahead = moved & (links.head[link] == nodes)
    step[ahead] = links.z[link[ahead]]
    behind = moved & ~ahead
    step[behind] = inverse(manifold, links.z[link[behind]])
    order = np.argsort(links.anchors, kind="stable")
    step[links.anchors[order]] = manifold.normalize(links.poses[order])
    above = np.where(moved, parent, -1)
    while (above >= 0).any():
        rows = np.flatnonzero(above >= 0)
        step[rows] = compose(manifold, step[above[rows]], step[rows])
        above[rows] = above[above[rows]]
    return step
