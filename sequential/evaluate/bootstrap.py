"""Bands of averages over values that come in correlated groups."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ShapeError

__all__ = ["BootstrapBand", "block_bootstrap", "gap_labels"]

Array = NDArray[np.float64]
Labels = NDArray[np.intp]
CELLS = 4_000_000  # resamples are drawn in portions of at most this many weights


@dataclass(frozen=True, slots=True)
class BootstrapBand:
    """A statistic of the sample, with the percentile band of its resamples."""

    value: float
    low: float
    high: float
    level: float
    blocks: int

    def holds(self, expected: float) -> bool:
        """Whether the band contains a value."""
        return self.low <= expected <= self.high


def gap_labels(t: ArrayLike, anchors: ArrayLike) -> NDArray[np.int64]:
    """Label (N,) of the gap between two `anchors` (used readings, sorted) into which each stamp falls."""
    return np.searchsorted(np.asarray(anchors), np.asarray(t), side="right").astype(np.int64)


def block_bootstrap(
    values: ArrayLike,
    groups: ArrayLike,
    rng: np.random.Generator,
    *,
    statistic: Literal["mean", "median"] = "mean",
    level: float = 0.95,
    resamples: int = 2000,
) -> BootstrapBand:
    """Percentile band of a mean or a median when values of one group are correlated.

    Whole groups are drawn with replacement, so whatever correlation there is inside a group stays in every
    resample (Davison and Hinkley 1997, Bootstrap methods, section 3.8, the cluster bootstrap).

    Parameters
    ----------
    values : (N,)
    groups : (N,) labels; the four held-out fixes between two used ones carry one label

    Raises
    ------
    ShapeError
        if there are fewer than two groups, or labels and values differ in number.
    """
    own = np.asarray(values, dtype=np.float64)
    labels = np.asarray(groups)
    if own.ndim != 1 or labels.shape != own.shape:
        raise ShapeError(f"values (N,) need one label each; got shapes {own.shape} and {labels.shape}")
    kinds, member = np.unique(labels, return_inverse=True)
    if len(kinds) < 2:
        raise ShapeError(f"a bootstrap over groups needs two groups or more, got {len(kinds)}")
    if statistic not in {"mean", "median"}:
        raise ShapeError(f"the statistic is 'mean' or 'median', got {statistic!r}")
    draws = _means if statistic == "mean" else _medians
    found = draws(own, member, len(kinds), rng, resamples)
    low, high = np.quantile(found, [(1.0 - level) / 2.0, (1.0 + level) / 2.0])
    whole = float(own.mean() if statistic == "mean" else np.median(own))
    return BootstrapBand(whole, float(low), float(high), level, len(kinds))


def _counts(groups: int, resamples: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """How often (resamples, groups) each group is drawn."""
    return rng.multinomial(groups, np.full(groups, 1.0 / groups), size=resamples).astype(np.int64)


def _means(
    own: Array, member: NDArray[np.intp], groups: int, rng: np.random.Generator, resamples: int
) -> Array:
    sums = np.bincount(member, own, groups)
    sizes = np.bincount(member, minlength=groups).astype(np.float64)
    counts = _counts(groups, resamples, rng).astype(np.float64)
    return np.asarray((counts @ sums) / (counts @ sizes))


def _medians(
    own: Array, member: NDArray[np.intp], groups: int, rng: np.random.Generator, resamples: int
) -> Array:
    order = np.argsort(own)
    ascending, kind = own[order], member[order]
    portion = max(1, CELLS // own.size)
    found = []
    for start in range(0, resamples, portion):
        counts = _counts(groups, min(portion, resamples - start), rng)
        heap = np.cumsum(counts[:, kind], axis=1)
        total = heap[:, -1:]
        lower = np.sum(heap < (total + 1) // 2, axis=1)
        upper = np.sum(heap < total // 2 + 1, axis=1)
        found.append(0.5 * (ascending[lower] + ascending[upper]))
    return np.concatenate(found)
