"""Which entries of a covariance may change: blocks that are estimated, the others zero or as they were."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError

__all__ = ["Structure", "blocks_of", "fitted"]

Array = NDArray[np.float64]

Structure = str | ArrayLike | None
"""`None` (zeros as declared stay zero), "full", "diagonal", "scale", "held", or a mask (d, d)."""
WORDS = ("full", "diagonal", "scale", "held")


def blocks_of(structure: Any, declared: Array, what: str) -> list[NDArray[np.int64]]:
    """Groups of directions whose covariance is estimated together; directions in none are held.

    Raises
    ------
    ModelError
        for an unknown word, or a mask that is not made of blocks: only blocks have an exact update.
    """
    d = len(declared)
    if structure is None:
        return _joined(declared != 0.0)
    if isinstance(structure, str):
        if structure not in {"full", "diagonal"}:
            raise ModelError(
                f"the structure of {what} is one of {', '.join(WORDS)} or a mask, got {structure!r}"
            )
        every = np.arange(d)
        return [every] if structure == "full" else [every[k : k + 1] for k in range(d)]
    mask = np.asarray(structure, dtype=bool)
    if mask.shape != (d, d) or (mask != mask.T).any():
        raise ModelError(
            f"the mask of {what} must be symmetric with shape ({d}, {d}), got {np.shape(structure)}"
        )
    groups = _joined(mask)
    whole = np.zeros_like(mask)
    for group in groups:
        whole[np.ix_(group, group)] = True
    if (whole != mask).any():
        raise ModelError(
            f"the mask of {what} must be made of blocks: where i goes with j and j with k, i goes with k too"
        )
    return groups


def _joined(pattern: NDArray[np.bool_]) -> list[NDArray[np.int64]]:
    """Connected groups of directions whose own entry is set."""
    left = {int(k) for k in np.flatnonzero(np.diag(pattern))}
    groups = []
    while left:
        group, front = set[int](), {min(left)}
        while front:
            group |= front
            front = {int(j) for i in front for j in np.flatnonzero(pattern[i])} & left - group
        left -= group
        groups.append(np.array(sorted(group)))
    return groups


def fitted(structure: Any, declared: Array, second: Array, what: str) -> Array:
    """The covariance (d, d) of the given structure that second moments (d, d) ask for."""
    if isinstance(structure, str) and structure == "held":
        return declared
    if isinstance(structure, str) and structure == "scale":
        inverse = np.linalg.pinv(declared, hermitian=True)
        rank = int(np.linalg.matrix_rank(declared, hermitian=True))
        return np.asarray(declared * float(np.sum(inverse * second)) / rank)
    groups = blocks_of(structure, declared, what)
    own = np.zeros_like(declared)
    for group in groups:
        own[np.ix_(group, group)] = second[np.ix_(group, group)]
    held = np.setdiff1d(np.arange(len(declared)), np.concatenate([*groups, np.zeros(0, dtype=np.int64)]))
    own[np.ix_(held, held)] = declared[np.ix_(held, held)]
    return np.asarray((own + own.T) / 2.0)
