"""Which pairs of pictures are worth matching: all of a small set, promising ones of a large one.

The largest features of a picture are few and are seen from far: a pair that shares some of them overlaps
(Wu, Towards linear-time incremental structure from motion, 3DV 2013, sec. 3).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from vision3d.sfm.extraction import PictureFeatures

__all__ = ["worth_matching"]

ALL_UP_TO = 60  # pictures whose pairs are all matched
LARGEST = 300  # features of a picture that decide
ENOUGH = 4  # of them that two pictures share
NEIGHBOURS = 20  # the best partners of a picture are matched in any case
RATIO = 0.8


def worth_matching(
    pictures: Sequence[PictureFeatures], *, all_up_to: int = ALL_UP_TO
) -> list[tuple[int, int]]:
    """Pairs (a, b), a < b, in order; all of them up to `all_up_to` pictures."""
    count = len(pictures)
    pairs = list(combinations(range(count), 2))
    if count <= all_up_to:
        return pairs
    described = [_largest(one) for one in pictures]
    shared = np.zeros((count, count), dtype=np.int64)
    for a, b in pairs:
        shared[a, b] = shared[b, a] = _shared(described[a], described[b])
    best = np.argsort(-shared, axis=1, kind="stable")[:, :NEIGHBOURS]
    near = np.zeros_like(shared, dtype=bool)
    near[np.arange(count)[:, None], best] = True
    kept = (shared >= ENOUGH) | near | near.T
    return [(a, b) for a, b in pairs if kept[a, b]]


def _largest(picture: PictureFeatures) -> NDArray[np.float32]:
    """Unit descriptors (n, 128) of the features with the largest shapes."""
    size = np.abs(np.linalg.det(picture.keypoints[:, 2:6].astype(np.float64).reshape(-1, 2, 2)))
    chosen = np.argsort(-size, kind="stable")[:LARGEST]
    own = picture.descriptors[chosen].astype(np.float32)
    return np.asarray(own / np.maximum(np.linalg.norm(own, axis=1, keepdims=True), 1e-9))


def _shared(a: NDArray[np.float32], b: NDArray[np.float32]) -> int:
    """How many features are each other's nearest, and clearly nearer than the second."""
    if len(a) < 2 or len(b) < 2:
        return 0
    near = a @ b.T
    there, back = near.argmax(axis=1), near.argmax(axis=0)
    rows = np.arange(len(a))
    second = np.partition(near, -2, axis=1)[:, -2]
    first = near[rows, there]
    apart = np.sqrt(np.maximum(2.0 - 2.0 * first, 0.0)), np.sqrt(np.maximum(2.0 - 2.0 * second, 0.0))
    return int(((back[there] == rows) & (apart[0] < RATIO * apart[1])).sum())
