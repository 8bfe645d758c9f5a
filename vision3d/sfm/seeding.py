"""Pairs of images whose motion is known, and those among them that a reconstruction can begin from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision3d.sfm.growth import GrowthSettings, Scene
from vision3d.two_view import TwoView, estimate_two_view

__all__ = ["PairGeometry", "seeds", "verified_pairs"]

Integers = NDArray[np.int64]
Array = NDArray[np.float64]

LEAST = 15  # matches that agree, for a pair to be believed
MOVED = ("general", "planar", "pure rotation")


@dataclass(frozen=True, eq=False)
class PairGeometry:
    """Two images that see the same.

    Parameters
    ----------
    a, b : images, a < b
    rows : (M, 2) features that belong together and agree with the motion
    view : the motion
    """

    a: int
    b: int
    rows: Integers
    view: TwoView


def verified_pairs(
    scene: Scene, matches: Mapping[tuple[int, int], Integers], *, threshold_px: float = 2.0
) -> list[PairGeometry]:
    """Estimate the motion of every pair from its tentative matches, and keep the pairs that have one."""
    pairs = []
    for (a, b), tentative in sorted(matches.items()):
        rows = np.asarray(tentative, dtype=np.int64).reshape(-1, 2)
        if len(rows) < LEAST:
            continue
        pixels_a, pixels_b = scene.pixels[a][rows[:, 0]], scene.pixels[b][rows[:, 1]]
        view = estimate_two_view(
            scene.camera(a), scene.camera(b), pixels_a, pixels_b, threshold_px=threshold_px
        )
        if view.verdict in MOVED and view.inliers.sum() >= LEAST:
            pairs.append(PairGeometry(a, b, rows[view.inliers], view))
    return pairs


def seeds(pairs: Sequence[PairGeometry], settings: GrowthSettings) -> list[PairGeometry]:
    """Pairs to begin from, the best first: many matches, and rays that open wide enough to tell depth.

    A plane is a poor beginning, since two motions explain it, and a pure rotation is none.
    """

    def worth(pair: PairGeometry) -> float:
        opening = min(1.0, pair.view.parallax_rad / settings.seed_angle_rad)
        ambiguous = 0.5 if pair.view.verdict == "planar" else 1.0
        return float(len(pair.rows) * opening**2 * ambiguous)

    able = [pair for pair in pairs if pair.view.verdict in ("general", "planar")]
    return sorted(able, key=worth, reverse=True)
