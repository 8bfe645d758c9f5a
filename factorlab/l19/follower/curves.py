"""Lines to follow, and where a robot stands beside one."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from vision3d.render.ground import GroundLine

__all__ = ["CURVES", "Track", "track"]

Array = NDArray[np.float64]
WIDTH_M = 0.02
STEP_M = 0.01  # between points
LENGTH_M = 16.0  # along x, of those that are not closed
PADDING = 60  # points, how far along the line from the last place the next one is looked for


def _sine(x: Array, amplitude_m: float, wave_m: float) -> Array:
    """A wave that begins straight."""
    share = np.clip(x, 0.0, 1.0)
    return amplitude_m * np.sin(2 * np.pi * x / wave_m) * share**2 * (3.0 - 2.0 * share)


def _straight(x: Array, rng: np.random.Generator) -> Array:
    return np.zeros_like(x)


def _wave(x: Array, rng: np.random.Generator) -> Array:
    return _sine(x, 0.15, 2.0)


def _slalom(x: Array, rng: np.random.Generator) -> Array:
    return _sine(x, 0.12, 1.2)


def _at_random(x: Array, rng: np.random.Generator) -> Array:
    lengths = rng.permutation([1.3, 1.9, 2.8])
    return sum((_sine(x, rng.uniform(-0.1, 0.1), length) for length in lengths), np.zeros_like(x))


GRAPHS: dict[str, Callable[[Array, np.random.Generator], Array]] = {
    "sinus": _wave,
    "droite": _straight,
    "slalom": _slalom,
    "hasard": _at_random,
}
CURVES = MappingProxyType(
    {
        "sinus": "y = 15 cm × sin(2πx / 2 m)",
        "droite": "une droite",
        "slalom": "y = 12 cm × sin(2πx / 1,2 m) : virages serrés",
        "hasard": "des virages tirés au sort par la graine",
        "circuit": "une boucle fermée, sans fin",
    }
)


@dataclass(frozen=True, eq=False)
class Track:
    """A line on the ground that is driven along.

    Attributes
    ----------
    line : the stripe that the camera sees
    closed : whether its end is its beginning
    """

    line: GroundLine
    closed: bool

    @property
    def points(self) -> Array:
        """(N, 2) m."""
        return self.line.points

    @property
    def length_m(self) -> float:
        """From its beginning to its end."""
        return float(self.line.lengths[-1])

    @cached_property
    def table(self) -> Array:
        """(M, 4) x m, y m, direction rad without jumps, arc length m; a closed line goes on at both ends."""
        along = np.gradient(self.points, axis=0)
        if self.closed:
            along[0] = along[-1] = self.points[1] - self.points[-2]
        headings = np.unwrap(np.arctan2(along[:, 1], along[:, 0]))
        whole = np.column_stack([self.points, headings, self.line.lengths])
        if not self.closed:
            return whole
        round_once = np.array([0.0, 0.0, headings[-1] - headings[0], self.length_m])
        return np.vstack([whole[-PADDING - 1 : -1] - round_once, whole, whole[1 : PADDING + 1] + round_once])

    def at(self, s_m: float) -> Array:
        """(3,) place and direction at an arc length."""
        return np.array([np.interp(self._wrapped(s_m), self.table[:, 3], self.table[:, k]) for k in range(3)])

    def nearest(self, place: Array, s_m: float) -> tuple[float, float]:
        """Arc length of the nearest point near `s_m`, and how far to its left the place is, m."""
        near = self._near(s_m)
        dx, dy = place[0] - near[:, 0], place[1] - near[:, 1]
        k = int(np.argmin(dx * dx + dy * dy))
        c, s = math.cos(near[k, 2]), math.sin(near[k, 2])
        length = float(near[k, 3] + c * dx[k] + s * dy[k])
        return self._wrapped(length), float(c * dy[k] - s * dx[k])

    def crossings(self, pose: Array, ahead_m: Array, s_m: float) -> Array | None:
        """(k, 3) where the line crosses what lies `ahead_m` (k,) in front of a robot, to its left and right.

        Places and directions in the world; of several crossings the one nearest to the robot's axis.  None
        where one of them is not there near `s_m`, the robot's own arc length.
        """
        near = self._near(s_m)
        c, s = math.cos(pose[2]), math.sin(pose[2])
        dx, dy = near[:, 0] - pose[0], near[:, 1] - pose[1]
        x = c * dx + s * dy
        out = np.empty((len(ahead_m), 3))
        for row, ahead in zip(out, ahead_m.tolist(), strict=True):
            before = x <= ahead
            found = np.flatnonzero(before[:-1] > before[1:])
            if not len(found):
                return None
            k = found[0]
            if len(found) > 1:
                k = found[np.argmin(np.abs(c * dy[found] - s * dx[found]))]
            row[:] = near[k, :3] + (ahead - x[k]) / (x[k + 1] - x[k]) * (near[k + 1, :3] - near[k, :3])
        return out

    def _wrapped(self, s_m: float) -> float:
        return s_m % self.length_m if self.closed else s_m

    def _near(self, s_m: float) -> Array:
        """The rows of the table within `PADDING` along the line."""
        middle = round(self._wrapped(s_m) / STEP_M) + (PADDING if self.closed else 0)
        last = len(self.table) - 2  # two rows at least
        return self.table[min(max(middle - PADDING, 0), last) : max(middle + PADDING + 1, 2)]


def track(name: str, seed: int = 0) -> Track:
    """A curve by name, one of `CURVES`."""
    if closed := name == "circuit":
        points = _loop()
    else:
        x = np.arange(-0.5, LENGTH_M, 0.002)
        points = np.column_stack([x, GRAPHS[name](x, np.random.default_rng([seed, 19]))])
    return Track(GroundLine(_evenly(points, closed=closed), WIDTH_M), closed)


def _loop() -> Array:
    """A bean that begins at the origin along x."""
    angle = np.linspace(0.0, 2 * np.pi, 4000)
    radius = 1.0 + 0.22 * np.cos(2 * angle) + 0.12 * np.sin(3 * angle)
    points = radius[:, None] * np.column_stack([np.sin(angle), -np.cos(angle)])
    first = points[1] - points[0]
    turn = np.arctan2(first[1], first[0])
    c, s = np.cos(turn), np.sin(turn)
    whole: Array = (points - points[0]) @ np.array([[c, -s], [s, c]])
    return whole


def _evenly(points: Array, *, closed: bool) -> Array:
    """Points at (nearly) `STEP_M` from each other; the last of a closed line is the first again."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    lengths = np.concatenate([[0.0], np.cumsum(steps)])
    count = round(lengths[-1] / STEP_M)
    wanted = np.linspace(0.0, lengths[-1], count + 1) if closed else np.arange(0.0, lengths[-1], STEP_M)
    return np.column_stack([np.interp(wanted, lengths, points[:, k]) for k in (0, 1)])
