"""Repeated texture: whether the second picture, moved by some shift, looks the same to the features."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from factorlab.match.fitting import Geometry

if TYPE_CHECKING:
    from vision3d.features import Features, Matches

__all__ = ["Rival", "find_rival", "repeated_within"]

Array = NDArray[np.float64]
APART_PX = 10.0
CELL_PX = 6.0  # of shifts that count as one; a pattern seen obliquely has not quite one
ALIKE = 1.6  # times the distance of its own match, up to which another place looks the same
AT_ONCE = 500
SAME_BITS, SAME_NUMBERS = 40.0, 0.3  # descriptors of the same thing seen twice; others are twice as far


@dataclass(frozen=True, slots=True, eq=False)
class Rival:
    """Another place that the same features fit.

    Parameters
    ----------
    repeated : share of the inliers that have a look-alike elsewhere in the second picture
    share : of the inliers whose look-alikes are all away by about the same shift
    shift_px : (2,) that shift
    """

    repeated: float
    share: float
    shift_px: Array


def repeated_within(features: Features) -> float:
    """Share of the features of one picture that have a look-alike elsewhere in it."""
    from vision3d.features.matching import descriptor_table

    most = SAME_BITS if features.binary else SAME_NUMBERS
    some = np.unique(np.linspace(0, len(features) - 1, min(len(features), AT_ONCE)).astype(np.int64))
    if not len(some):
        return 0.0
    near = descriptor_table(features.descriptors[some], features.descriptors) <= most
    away = np.linalg.norm(features.pixels[some, None] - features.pixels[None], axis=2) > APART_PX
    return float((near & away).any(axis=1).mean())


def find_rival(geometry: Geometry, a: Features, b: Features, matches: Matches) -> Rival | None:
    """Look for look-alikes of every inlier's second end, and for the shift that most of them share."""
    if geometry.count < 8 or not geometry.inliers.any():
        return None
    pairs, own = matches.pairs[geometry.inliers], matches.distance[geometry.inliers]
    shifts, rows = _look_alikes(a, b, pairs, ALIKE * np.maximum(own, np.median(own)))
    repeated = len(np.unique(rows)) / len(pairs)
    if not len(shifts):
        return Rival(repeated, 0.0, np.zeros(2))
    at = _most_common(shifts, rows)
    return Rival(repeated, len(np.unique(rows[at])) / len(pairs), np.median(shifts[at], axis=0))


def _look_alikes(
    a: Features, b: Features, pairs: NDArray[np.int64], most: Array
) -> tuple[Array, NDArray[np.int64]]:
    """Shifts (K, 2) from the match of an inlier to what looks like it as well, and the inlier of each."""
    from vision3d.features.matching import descriptor_table

    shifts, rows = [], []
    for start in range(0, len(pairs), AT_ONCE):
        some = pairs[start : start + AT_ONCE]
        near = (
            descriptor_table(a.descriptors[some[:, 0]], b.descriptors) <= most[start : start + AT_ONCE, None]
        )
        i, j = np.nonzero(near)
        shift = b.pixels[j] - b.pixels[some[i, 1]]
        away = np.hypot(*shift.T) > APART_PX
        shifts.append(shift[away])
        rows.append(i[away] + start)
    return np.concatenate(shifts), np.concatenate(rows)


def _most_common(shifts: Array, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which shifts lie in the three by three cells that most inliers have one in."""
    cell = np.rint(shifts / CELL_PX).astype(np.int64)
    votes: dict[tuple[int, int], set[int]] = {}
    for (x, y), row in zip(cell.tolist(), rows.tolist(), strict=True):
        for u in (-1, 0, 1):
            for v in (-1, 0, 1):
                votes.setdefault((x + u, y + v), set()).add(row)
    best = max(votes, key=lambda key: len(votes[key]))
    return np.asarray((np.abs(cell - np.array(best)) <= 1).all(axis=1))
