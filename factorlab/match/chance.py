"""Whether as many matches would agree by chance: an a-contrario test.

If matches were random, k of n would agree with some model that a sample of m determines in
(n - m) C(n, k) C(k, m) α^(k-m) cases on average (Moisan and Stival, IJCV 2004), α being the probability that
one random match agrees with a given model.  Here α is measured: it is the share of wrong pairings, of
the first end of one match with the second of another, that agree with the model found.  Features come in
heaps, and no area of the image would say how often chance meets a heap.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["CHANCE_LOG10", "chance_agreement", "distinct_rows", "log10_false_alarms"]

Array = NDArray[np.float64]
CHANCE_LOG10 = -5.0  # of 260 unrelated pairs none came below -4.4; one should by -2, if matches were random
SAME_PX = 3.0
ROWS = 600  # first ends that are paired with every second


def distinct_rows(a: Array, b: Array, same_px: float = SAME_PX) -> NDArray[np.bool_]:
    """Which matches (M,) are no repetition of an earlier one: a feature found twice agrees twice."""
    from scipy.spatial import cKDTree

    keep = np.ones(len(a), np.bool_)
    if len(a) < 2:
        return keep
    for near in (a, b):  # either end is enough: one point cannot be evidence twice
        pairs = cKDTree(near).query_pairs(same_px, output_type="ndarray")
        for i, j in pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]:
            if keep[i]:
                keep[j] = False
    return keep


def chance_agreement(matrix: Array, kind: str, a: Array, b: Array, within_px: float) -> float:
    """Share α of wrong pairings (a_i, b_j), i ≠ j, within so many pixels of the model."""
    from vision3d.features.guided import distances_px

    many = len(a)
    some = np.unique(np.linspace(0, many - 1, min(many, ROWS)).astype(np.int64))
    near = distances_px(matrix, kind, a[some, None], b[None]) <= within_px  # type: ignore[arg-type]
    near[np.arange(len(some)), some] = False
    wrong = len(some) * (many - 1)
    # nothing seen among so many is still not never
    return float((near.sum() + 1.0) / (wrong + 1.0))


def log10_false_alarms(count: int, agree: int, sample: int, alpha: float) -> float:
    """log10 of how many models that good chance would give among `count` matches; 0 is as good as chance."""
    from scipy.special import gammaln

    if agree <= sample or count <= sample:
        return float(np.log10(max(count, 1)))

    def log_choose(n: int, k: int) -> float:
        return float(gammaln(n + 1) - gammaln(k + 1) - gammaln(n - k + 1))

    natural = (
        np.log(count - sample) + log_choose(count, agree) + log_choose(agree, sample)
        + (agree - sample) * np.log(min(alpha, 1.0))
    )  # fmt: skip
    return float(natural / np.log(10.0))
