"""Which tentative matches agree with those around them, before any model is fitted.

A right match says by its size and angle how its surroundings lie in the other image; its right neighbours
lie there.  A wrong one has no such company (compare Bian et al., CVPR 2017; Cavalli et al., AdaLAM, 2020).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from vision3d.features.features import Features, Matches

__all__ = ["supporters"]


def supporters(
    a: Features, b: Features, matches: Matches, *, neighbours: int = 16, tolerance: float = 0.35
) -> NDArray[np.int64]:
    """How many of its neighbours lie where each match says, of the `neighbours` nearest in a's image.

    Parameters
    ----------
    a, b : the features that were matched
    tolerance : how far from there, as a share of their distance

    Returns
    -------
    NDArray[np.int64]
        (M,) supporters; two or more are rarely chance.
    """
    if neighbours < 1 or not 0.0 < tolerance < 1.0:
        raise ModelError(
            f"expected one neighbour or more and a tolerance from 0 to 1; got {neighbours} and {tolerance}"
        )
    many = len(matches)
    if many < 2:
        return np.zeros(many, np.int64)
    from scipy.spatial import cKDTree

    first, second = matches.points(a, b)
    near = cKDTree(first).query(first, k=min(neighbours + 1, many))[1][:, 1:]
    there = np.einsum("mij,mkj->mki", matches.warps(a, b), first[near] - first[:, None])
    found = second[near] - second[:, None]
    # what is in the same place says nothing: a feature found twice
    apart = (np.linalg.norm(first[near] - first[:, None], axis=2) > 2.0) & (
        np.linalg.norm(found, axis=2) > 2.0
    )
    away = np.linalg.norm(found - there, axis=2)
    return np.asarray(
        (apart & (away < tolerance * np.linalg.norm(there, axis=2))).sum(axis=1), dtype=np.int64
    )
