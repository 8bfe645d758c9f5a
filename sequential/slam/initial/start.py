"""Initial poses of a problem by the name of a method."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.slam.estimate import Values
from sequential.slam.initial.chordal import chordal_poses
from sequential.slam.initial.lago import lago_poses
from sequential.slam.initial.links import Links, links_of
from sequential.slam.initial.tree import tree_poses
from sequential.slam.problem import SlamProblem

__all__ = ["METHODS", "initial_poses"]

Array = NDArray[np.float64]


def _odometry(links: Links) -> Array:
    """The odometry where there is one, anything else where its chain is broken."""
    step = np.abs(links.tail - links.head) == 1
    return tree_poses(links, np.where(step, 1.0, 1.0 + links.count))


METHODS: dict[str, Callable[[Links], Array]] = {
    "lago": lago_poses,
    "chordal": chordal_poses,
    "tree": tree_poses,
    "odometry": _odometry,
}


def initial_poses(problem: SlamProblem, method: str = "chordal", kind: str = "x") -> Values:
    """Poses to begin from; other kinds are placed from them.

    Parameters
    ----------
    method : `"lago"` (plane only), `"chordal"`, `"tree"` (shortest paths by the covariance of the rotation),
        `"odometry"` (steps from each pose to the next)
    kind : of the variables that hold poses

    Raises
    ------
    ModelError
        for an unknown method, no factors between poses, LAGO in space.
    UnderConstrainedError
        where the graph falls into pieces or no prior tells any pose; the message names one.
    """
    if method not in METHODS:
        msg = f"initial poses come from {', '.join(METHODS)}, got {method!r}"
        raise ModelError(msg)
    links = links_of(problem, kind)
    return Values({kind: links.index}, {kind: METHODS[method](links)})
