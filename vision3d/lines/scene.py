"""What the straight lines of an image say about it, where there is none to follow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vision3d.lines.segments import SegmentSettings, find_segments
from vision3d.lines.vanishing import VanishingPoint, vanishing_points

__all__ = ["Scene", "read_scene"]

FEW = 6
BUILT = 0.55  # of the length of all segments, upright and level together
EACH = 0.15


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Straight lines of an image and where they meet.

    Attributes
    ----------
    segments : (N, 4) x1, y1, x2, y2, px, the longest first
    points : vanishing points, that of the greatest length first
    built : whether upright and level lines prevail, as on a building or in a room
    """

    segments: NDArray[np.float64]
    points: tuple[VanishingPoint, ...]
    built: bool

    @property
    def words(self) -> str:
        """What the image shows, as the object of a sentence."""
        if len(self.segments) < FEW:
            return f"{len(self.segments) or 'no'} straight lines"
        told = f"{len(self.segments)} straight lines"
        if self.built:
            share = sum(point.share for point in self.points if point.kind != "slanting")
            told += f", {100 * share:.0f} % of their length upright or level, as on a building or in a room"
        return f"{told}: {'; '.join(point.words for point in self.points)}" if self.points else told


def read_scene(image: ArrayLike, settings: SegmentSettings | None = None) -> Scene:
    """Segments and vanishing points of an image (h, w) or (h, w, 3), uint8."""
    pixels = np.asarray(image)
    segments = find_segments(pixels, settings)
    points = vanishing_points(segments, (pixels.shape[1], pixels.shape[0]))
    shares = {
        kind: sum(point.share for point in points if point.kind == kind) for kind in ("upright", "level")
    }
    built = len(segments) >= FEW and min(shares.values()) >= EACH and sum(shares.values()) >= BUILT
    return Scene(segments, points, built)
