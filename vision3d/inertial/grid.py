"""Knots of the trajectory and nodes of the biases: which of them act at which time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Grid", "Located"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Located:
    """Times on a grid.

    Parameters
    ----------
    first : (N,) first control value that acts
    u : (N,) local time in its interval of knots
    step_s : (N,) length of that interval
    node : (N,) bias node before each time
    share : (N,) how far from that node to the next
    """

    first: Integers
    u: Array
    step_s: Array
    node: Integers
    share: Array


@dataclass(frozen=True, eq=False)
class Grid:
    """Uniform knots over stretches of time that have data, and nodes of the biases over all of it.

    Parameters
    ----------
    begins, ends : (S,) of the stretches, s; between them nothing is estimated
    step_s : between knots, about: every stretch holds a whole number of intervals
    order : of the splines
    node_step_s : between nodes of the biases
    """

    begins: Array
    ends: Array
    step_s: float
    order: int
    node_step_s: float

    @staticmethod
    def over(stretches: Sequence[tuple[float, float]], step_s: float, order: int, node_s: float) -> Grid:
        """A grid over stretches (begin, end); nodes are spread evenly, about `node_s` apart."""
        begins, ends = (np.array(column, dtype=np.float64) for column in zip(*stretches, strict=True))
        whole = float(ends[-1] - begins[0])
        return Grid(begins, ends, step_s, order, whole / max(1, round(whole / node_s)))

    @property
    def intervals(self) -> Integers:
        """Intervals of knots in every stretch, (S,)."""
        return np.maximum(1, np.round((self.ends - self.begins) / self.step_s)).astype(np.int64)

    @property
    def steps_s(self) -> Array:
        """Length of the intervals of every stretch, (S,)."""
        return np.asarray((self.ends - self.begins) / self.intervals)

    @property
    def bases(self) -> Integers:
        """First control value of every stretch, (S,)."""
        own = self.intervals + self.order - 1
        return np.concatenate([[0], np.cumsum(own)[:-1]]).astype(np.int64)

    @property
    def count(self) -> int:
        """Control values of all stretches."""
        return int(np.sum(self.intervals + self.order - 1))

    @property
    def nodes(self) -> int:
        """Nodes of the biases."""
        return max(1, round(float(self.ends[-1] - self.begins[0]) / self.node_step_s)) + 1

    def inside(self, t: Array, margin_s: float = 0.0) -> NDArray[np.bool_]:
        """Which times (N,) lie in a stretch, at least `margin_s` from its ends."""
        where = self._stretch(t)
        return (t >= self.begins[where] + margin_s) & (t <= self.ends[where] - margin_s)

    def locate(self, t: Array) -> Located:
        """Where times (N,) are; those a little outside belong to the nearest interval."""
        where = self._stretch(t)
        step = self.steps_s[where]
        position = (t - self.begins[where]) / step
        interval = np.clip(np.floor(position).astype(np.int64), 0, self.intervals[where] - 1)
        middle = (interval + 0.5) * step + self.begins[where]
        nodes = np.floor((middle - self.begins[0]) / self.node_step_s).astype(np.int64)
        node = np.clip(nodes, 0, self.nodes - 2)
        share = (t - self.begins[0]) / self.node_step_s - node
        return Located(self.bases[where] + interval, position - interval, step, node, share)

    @property
    def centres(self) -> Array:
        """Times (K,) at which a control value acts most."""
        own = [
            begin + (np.arange(n + self.order - 1) - 0.5 * (self.order - 2)) * step
            for begin, n, step in zip(self.begins, self.intervals, self.steps_s, strict=True)
        ]
        return np.concatenate(own)

    @property
    def node_times(self) -> Array:
        """Times (B,) of the nodes of the biases."""
        return np.asarray(self.begins[0] + self.node_step_s * np.arange(self.nodes))

    def _stretch(self, t: Array) -> Integers:
        """The stretch that holds each time, or the nearest one."""
        middles = 0.5 * (self.ends[:-1] + self.begins[1:])
        return np.searchsorted(middles, t).astype(np.int64)
