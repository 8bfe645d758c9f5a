"""Lines to follow, and where a robot stands beside one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from vision3d.render.ground import GroundLine

__all__ = ["CURVES", "Track", "track"]

Array = NDArray[np.float64]
WIDTH_M = 0.02
STEP_M = 0.01  # between points
LENGTH_M = 16.0  # along x, of those that are not closed
NEAR_M = 0.6  # how far along the line from the last place the next one is looked for


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
    lengths : (N,) m along it
    headings : (N,) rad of its direction, without jumps
    closed : whether its end is its beginning
    """

    line: GroundLine
    lengths: Array
    headings: Array
    closed: bool

    @property
    def points(self) -> Array:
        """(N, 2) m."""
        return self.line.points

    @property
    def length_m(self) -> float:
        """From its beginning to its end."""
        return float(self.lengths[-1])

    def at(self, s_m: float) -> Array:
        """(3,) place and direction at an arc length."""
        s = s_m % self.length_m if self.closed else s_m
        columns = (self.points[:, 0], self.points[:, 1], self.headings)
        return np.array([np.interp(s, self.lengths, column) for column in columns])

    def around(self, s_m: float) -> NDArray[np.int64]:
        """Indices of the points within `NEAR_M` along the line."""
        middle, half = round(s_m / STEP_M), round(NEAR_M / STEP_M)
        count = len(self.lengths) - 1
        window = np.arange(middle - half, middle + half + 1)
        return window % count if self.closed else window[(window >= 0) & (window <= count)]

    def nearest(self, place: Array, s_m: float) -> tuple[float, float]:
        """Arc length of the nearest point near `s_m`, and how far to its left the place is, m."""
        near = self.around(s_m)
        away = place[:2] - self.points[near]
        k = int(near[np.argmin(np.einsum("ij,ij->i", away, away))])
        c, s = np.cos(self.headings[k]), np.sin(self.headings[k])
        dx, dy = place[:2] - self.points[k]
        return float(self.lengths[k] + c * dx + s * dy), float(c * dy - s * dx)

    def crossing(self, pose: Array, ahead_m: float, s_m: float) -> Array | None:
        """(3,) where the line crosses what lies `ahead_m` in front of a robot, to its left and right.

        Place and direction in the world; of several crossings the one nearest to the robot's axis, None
        where there is none near `s_m`, the robot's own arc length.
        """
        near = self.around(s_m + ahead_m)
        c, s = np.cos(pose[2]), np.sin(pose[2])
        away = self.points[near] - pose[:2]
        x = c * away[:, 0] + s * away[:, 1] - ahead_m
        found = np.flatnonzero((x[:-1] <= 0.0) & (x[1:] > 0.0))
        if not len(found):
            return None
        y = c * away[found, 1] - s * away[found, 0]
        k = int(found[np.argmin(np.abs(y))])
        share = -x[k] / (x[k + 1] - x[k])
        first, second = near[k], near[k + 1]
        place = self.points[first] + share * (self.points[second] - self.points[first])
        turn = self.headings[second] - self.headings[first]
        turn -= 2 * np.pi * np.round(turn / (2 * np.pi))  # where a closed line begins anew
        return np.array([place[0], place[1], self.headings[first] + share * turn])


def track(name: str, seed: int = 0) -> Track:
    """A curve by name, one of `CURVES`."""
    if closed := name == "circuit":
        points = _loop()
    else:
        x = np.arange(-0.5, LENGTH_M, 0.002)
        points = np.column_stack([x, GRAPHS[name](x, np.random.default_rng([seed, 19]))])
    points = _evenly(points, closed=closed)
    along = np.gradient(points, axis=0)
    if closed:
        along[0] = along[-1] = points[1] - points[-2]
    headings = np.unwrap(np.arctan2(along[:, 1], along[:, 0]))
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    lengths = np.concatenate([[0.0], np.cumsum(steps)])
    return Track(GroundLine(points, WIDTH_M), lengths, headings, closed)


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
