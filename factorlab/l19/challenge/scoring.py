"""A score out of twenty: each part counts between nothing filtered and our tuned Kalman filter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from factorlab.l19.challenge.measures import Measures

__all__ = ["MOST", "PARTS", "Part", "parts_of", "score_of"]

MOST = 20.0
PARTS = ("rampe", "palier", "retard", "aberrante", "σ")
SLOW_S = 12.0  # later than our filter by this much: no point for the delay
HONEST = (0.6, 1.6)  # mean of (error / σ)² that earns every point; four times beyond earns none
DISHONEST = 4.0
POINTS = {"rampe": 5.0, "palier": 5.0, "retard": 3.0, "aberrante": 4.0, "σ": 3.0}


@dataclass(frozen=True, slots=True)
class Part:
    """What one part earned, of how many points; `beats` says that it is better than our filter."""

    name: str
    points: float
    of: float
    beats: bool = False

    @property
    def share(self) -> float:
        """Of the points that there are."""
        return self.points / self.of


def parts_of(found: Measures, nothing: Measures, ours: Measures) -> tuple[Part, ...]:
    """The five parts, in the order of PARTS.

    Parameters
    ----------
    found : of the filter that is scored
    nothing : of the readings themselves
    ours : of our tuned Kalman filter
    """
    shares = {
        "rampe": _between(found.ramp, nothing.ramp, ours.ramp),
        "palier": _between(found.plateau, nothing.plateau, ours.plateau),
        "retard": float(np.clip(1.0 - (found.delay_s - ours.delay_s) / SLOW_S, 0.0, 1.0)),
        "aberrante": _between(found.outlier, nothing.outlier, ours.outlier),
        "σ": _honesty(found.nees),
    }
    beats = {
        "rampe": found.ramp < ours.ramp,
        "palier": found.plateau < ours.plateau,
        "retard": found.delay_s < ours.delay_s,
        "aberrante": found.outlier < ours.outlier,
    }
    return tuple(Part(n, shares[n] * POINTS[n], POINTS[n], beats.get(n, False)) for n in PARTS)


def score_of(parts: tuple[Part, ...]) -> float:
    """The sum, out of MOST."""
    return sum(part.points for part in parts)


def _between(value: float, nothing: float, ours: float) -> float:
    """0 at what is reached without a filter, 1 at what ours reaches, on a scale of ratios."""
    share = np.log(nothing / max(value, 1e-12)) / np.log(nothing / ours)
    return float(np.clip(share, 0.0, 1.0))


def _honesty(nees: float | None) -> float:
    if nees is None:
        return 0.0
    off = max(HONEST[0] / max(nees, 1e-12), nees / HONEST[1], 1.0)
    return float(np.clip(1.0 - np.log(off) / np.log(DISHONEST), 0.0, 1.0))
