"""Where parallel lines of a scene meet in its image.

A vanishing point is looked for among the crossings of pairs of segments (RANSAC without chance: the longest
segments pair first), by how much length of segments points at it; it is refined on those, and they are taken
away before the next one is looked for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision3d.lines.segments import lengths

__all__ = ["VanishingPoint", "vanishing_points"]

Array = NDArray[np.float64]
PAIRED = 60  # longest segments whose crossings are tried
ROUNDS = 5


@dataclass(frozen=True, slots=True, eq=False)
class VanishingPoint:
    """A point at which segments aim.

    Attributes
    ----------
    homogeneous : (3,) of norm 1; the third is near 0 where the segments are parallel in the image
    members : (n,) numbers of the segments that aim at it
    share : of the length of all segments
    size : (width, height) of the image
    """

    homogeneous: Array
    members: NDArray[np.int64]
    share: float
    size: tuple[int, int]

    @property
    def pixel(self) -> tuple[float, float] | None:
        """Its place in px; None where it is farther than 20 widths of the image away."""
        x, y, w = self.homogeneous
        if abs(w) * 20 * max(self.size) < np.hypot(x, y):
            return None
        return float(x / w), float(y / w)

    @property
    def angle_rad(self) -> float:
        """The direction in which it lies from the middle of the image, 0 to pi from the x axis, y down."""
        x, y, w = self.homogeneous
        cx, cy = 0.5 * (self.size[0] - 1), 0.5 * (self.size[1] - 1)
        return float(np.arctan2(y - w * cy, x - w * cx) % np.pi)

    @property
    def kind(self) -> str:
        """Upright, level or slanting."""
        lean = abs(self.angle_rad - 0.5 * np.pi)
        return "upright" if lean < np.radians(20) else "level" if lean > np.radians(60) else "slanting"

    @property
    def words(self) -> str:
        """What it is, for people."""
        place = "parallel in the image"
        if self.pixel is not None:
            x, y = self.pixel
            place = f"meeting at ({x:.0f}, {y:.0f}) px".replace("-", "−")
        return f"{len(self.members)} {self.kind} lines, {place}"


def vanishing_points(
    segments: Array,
    size: tuple[int, int],
    *,
    most: int = 3,
    angle_rad: float = 0.025,
    least: int = 4,
    least_share: float = 0.08,
) -> tuple[VanishingPoint, ...]:
    """Find the vanishing points of segments (N, 4), that of the greatest length first.

    Parameters
    ----------
    size : (width, height) of the image
    angle_rad : between a segment and the direction from its middle to the point
    least, least_share : segments, and share of all length, that make one
    """
    total = float(lengths(segments).sum())
    free = np.arange(len(segments))
    found: list[VanishingPoint] = []
    while len(found) < most and len(free) >= least:
        own = segments[free]
        point = _best(own, size, angle_rad)
        if point is None:
            break
        aims = _aims(point[None], own, angle_rad)[0]
        share = float(lengths(own[aims]).sum()) / total
        if aims.sum() < least or share < least_share:
            break
        found.append(VanishingPoint(point, free[aims], share, size))
        free = free[~aims]
    return tuple(found)


def _best(segments: Array, size: tuple[int, int], angle_rad: float) -> Array | None:
    """The crossing at which most length aims, refined."""
    lines = _lines(segments, size)
    longest = np.argsort(-lengths(segments))[:PAIRED]
    first, second = (longest[side] for side in np.triu_indices(len(longest), 1))
    crossings = np.cross(lines[first], lines[second])
    norms = np.linalg.norm(crossings, axis=1)
    crossings = crossings[norms > 1e-12] / norms[norms > 1e-12, None]
    if not len(crossings):
        return None
    candidates = crossings @ _scaling(size).T
    candidates /= np.linalg.norm(candidates, axis=1, keepdims=True)
    support = _aims(candidates, segments, angle_rad) @ lengths(segments)
    point = candidates[int(np.argmax(support))]
    for _ in range(ROUNDS):
        aims = _aims(point[None], segments, angle_rad)[0]
        if aims.sum() < 2:
            return None
        weighted = lines[aims] * lengths(segments[aims])[:, None]
        _, _, axes = np.linalg.svd(weighted)
        moved = _scaling(size) @ axes[-1]
        point = moved / np.linalg.norm(moved)
    return np.asarray(point)


def _scaling(size: tuple[int, int]) -> Array:
    """From coordinates about the middle of the image, in half widths, to pixels."""
    half = 0.5 * max(size)
    return np.array([[half, 0.0, 0.5 * (size[0] - 1)], [0.0, half, 0.5 * (size[1] - 1)], [0.0, 0.0, 1.0]])


def _lines(segments: Array, size: tuple[int, int]) -> Array:
    """Homogeneous lines (N, 3) through segments, about the middle of the image in half widths, of norm 1."""
    inverse = np.linalg.inv(_scaling(size))
    ends = [np.column_stack([segments[:, k : k + 2], np.ones(len(segments))]) @ inverse.T for k in (0, 2)]
    lines = np.cross(ends[0], ends[1])
    return np.asarray(lines / np.maximum(np.linalg.norm(lines[:, :2], axis=1, keepdims=True), 1e-15))


def _aims(points: Array, segments: Array, angle_rad: float) -> NDArray[np.bool_]:
    """Which of N segments aim at each of M homogeneous points, (M, N)."""
    middle = 0.5 * (segments[:, :2] + segments[:, 2:])
    along = (segments[:, 2:] - segments[:, :2]) / np.maximum(lengths(segments), 1e-9)[:, None]
    towards = points[:, None, :2] - points[:, None, 2:] * middle[None]
    cross = np.abs(towards[..., 0] * along[:, 1] - towards[..., 1] * along[:, 0])
    aims: NDArray[np.bool_] = cross < np.sin(angle_rad) * np.linalg.norm(towards, axis=2)
    return aims
