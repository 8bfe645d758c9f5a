"""Sightings that the map does not explain, and markers that contradict it as a whole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision3d.markers.sightings import MarkerSightings

__all__ = ["Gated", "gate", "usual_scale", "variance_scale"]

Array = NDArray[np.float64]
LIMIT = 39.0
"""χ² of eight degrees of freedom that one sighting in 200 000 exceeds."""
MEDIAN = 7.34  # of the same distribution
CONTRADICTS = 0.3  # share of a marker's sightings rejected beyond which the marker itself is at fault
NOTICED = 1.15  # factor of the variance below which corners count as what they claim


@dataclass(frozen=True, eq=False)
class Gated:
    """What was taken and what was not.

    Parameters
    ----------
    taken, rejected : (S,) sightings; those of markers outside the map are neither
    sound : (M,) False for a marker that contradicts the map
    share : (M,) of its sightings that were rejected
    """

    taken: NDArray[np.bool_]
    rejected: NDArray[np.bool_]
    sound: NDArray[np.bool_]
    share: Array


def gate(
    sightings: MarkerSightings,
    kept: NDArray[np.bool_],
    chi2: Array,
    reference: int,
    scale: float = 1.0,
    earlier: Gated | None = None,
) -> Gated:
    """Judge sightings by their χ² (S,), NaN where unknown; a marker judged unsound `earlier` stays so."""
    count = len(sightings.ids)
    with np.errstate(invalid="ignore"):
        good = kept & (chi2 <= LIMIT * scale)
    known = kept & (np.isfinite(chi2) if earlier is None else np.isfinite(chi2) | earlier.rejected)
    total = np.bincount(sightings.marker[known], minlength=count)
    bad = np.bincount(sightings.marker[known & ~good], minlength=count)
    share = bad / np.maximum(total, 1)
    sound = (share <= CONTRADICTS) | (np.arange(count) == reference)
    if earlier is not None:
        sound &= earlier.sound
        share = np.where(earlier.sound, share, earlier.share)
    taken = good & sound[sightings.marker]
    return Gated(taken, known & ~taken, sound, share)


def usual_scale(sightings: MarkerSightings, chi2: Array) -> float:
    """How many times larger than claimed the variance of the usual sighting is; 1 or more, by the median.

    Of frames with two markers and more: a frame's only marker is fitted by its pose and tells nothing.
    """
    company = np.bincount(sightings.frame)[sightings.frame] > 1
    told = chi2[company & np.isfinite(chi2)]
    return max(1.0, float(np.median(told)) / MEDIAN) if len(told) else 1.0


def variance_scale(chi2: Array, taken: NDArray[np.bool_], unknowns: int) -> float:
    """The same by the mean over what was taken, for its degrees of freedom; exactly 1 up to 1.15."""
    freedom = 8 * int(taken.sum()) - unknowns
    if freedom < 8:
        return 1.0
    scale = float(chi2[taken].sum()) / freedom
    return scale if scale > NOTICED else 1.0
