"""The corners of all views in the flat arrays that the adjustment's kernel reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vision3d.views import View

__all__ = ["Problem"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Problem:
    """Corners of all views one after the other: M in all.

    Attributes
    ----------
    points, pixels : Array
        (M, 3) on the board, m; (M, 2) in the image, px.
    sigma_px : Array
        (M,), standard deviation of every corner, per axis, before scaling.
    bend : Array
        (M, 2): how far along z the two numbers of a bent board push each point: 1 in the middle of the
        board and 0 at its ends, along x and along y.
    starts : NDArray[np.int64]
        (V + 1,): view v has the corners starts[v] to starts[v + 1].
    size : tuple[int, int]
        Width and height of the images.
    floor_px : float
        What `sigma_px` has in it besides what the views state.
    scale : float
        Standard deviation of the residuals in units of `sigma_px`, as far as it is known: what is believed of
        the coefficients of some lenses is weighed against residuals by it.
    """

    points: Array
    pixels: Array
    sigma_px: Array
    bend: Array
    starts: NDArray[np.int64]
    size: tuple[int, int]
    floor_px: float = 0.0
    scale: float = 1.0

    @classmethod
    def of(cls, views: Sequence[View], floor_px: float = 0.0, scale: float = 1.0) -> Problem:
        """Lay out the corners of the views, a floor below their sigmas: see `vision3d.calibrate.noise`."""
        points = np.concatenate([np.asarray(view.points, np.float64) for view in views])
        counts = [len(view.points) for view in views]
        return cls(
            points,
            np.concatenate([np.asarray(view.pixels, np.float64) for view in views]),
            np.hypot(np.concatenate([np.asarray(view.sigma_px, np.float64) for view in views]), floor_px),
            _bend(points),
            np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
            views[0].size,
            floor_px,
            scale,
        )

    @classmethod
    def of_points(
        cls, points: Array, sigma_px: float, starts: NDArray[np.int64], size: tuple[int, int]
    ) -> Problem:
        """Points that nobody has seen yet, for what they would tell."""
        n = len(points)
        nowhere = np.zeros((n, 2))
        return cls(points, nowhere, np.full(n, sigma_px), _bend(points), starts.astype(np.int64), size)

    @property
    def count(self) -> int:
        """How many views there are."""
        return len(self.starts) - 1

    @property
    def owner(self) -> NDArray[np.int64]:
        """Number of the view of every corner, (M,)."""
        return np.repeat(np.arange(self.count), np.diff(self.starts))

    def only(self, chosen: Sequence[int] | NDArray[np.int64]) -> Problem:
        """The same with the chosen views alone."""
        rows = np.concatenate([np.arange(self.starts[v], self.starts[v + 1]) for v in chosen])
        counts = np.diff(self.starts)[np.asarray(chosen, np.int64)]
        starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
        return replace(
            self,
            points=self.points[rows],
            pixels=self.pixels[rows],
            sigma_px=self.sigma_px[rows],
            bend=self.bend[rows],
            starts=starts,
        )

    def split(self, values: Array) -> tuple[Array, ...]:
        """Cut an array (M, ...) into one array a view."""
        return tuple(np.split(values, self.starts[1:-1]))


def _bend(points: Array) -> Array:
    """A parabola along each axis of the board, 1 in its middle and 0 at its ends."""
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    reach = np.where(high > low, 0.5 * (high - low), 1.0)
    at = (points[:, :2] - 0.5 * (low + high)) / reach
    return np.ascontiguousarray(1.0 - at**2)
