"""What is printed on a plane: cells, a distance to a curve, or a picture.

A texture lies in the plane z = 0 of its own frame, x to the right and y down in metres, seen from negative z.
Reflectance is 0 (black) to 1 (white); nothing is painted outside the texture or where it is below 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, ShapeError

__all__ = ["DARK", "LIGHT", "PAPER", "Texture", "cells", "distance_field", "picture"]

DARK, LIGHT, PAPER = 0.12, 0.85, 0.9  # ink and paper, as a camera sees them
_CELLS, _DISTANCE, _PICTURE = 0, 1, 2  # as in vision3d.kernels.render


@dataclass(frozen=True, slots=True, eq=False)
class Texture:
    """A texture as the renderer takes it; made by `cells`, `distance_field` or `picture`.

    Attributes
    ----------
    kind : 0 cells, 1 distance field, 2 picture
    x_edges, y_edges : edges of cells, or crossings of a regular grid, m, increasing
    values : reflectance of each cell or crossing, or signed distance, m; (rows, columns) float32
    radii, inner : radius (m) of the disc in the middle of each cell, and its reflectance
    """

    kind: int
    x_edges: NDArray[np.float64]
    y_edges: NDArray[np.float64]
    values: NDArray[np.float32]
    radii: NDArray[np.float32]
    inner: NDArray[np.float32]

    def __post_init__(self) -> None:
        for name in ("x_edges", "y_edges"):
            edges = np.ascontiguousarray(getattr(self, name), dtype=np.float64)
            if edges.ndim != 1 or len(edges) < 2 or not (np.diff(edges) > 0).all():
                raise ModelError(f"{name} of a texture must increase, and be two or more; got {edges}")
            _frozen(self, name, edges)
        for name in ("values", "radii", "inner"):
            _frozen(self, name, np.ascontiguousarray(getattr(self, name), dtype=np.float32))
        step = 1 if self.kind == _CELLS else 0
        expected = (len(self.y_edges) - step, len(self.x_edges) - step)
        if self.values.shape != expected:
            raise ShapeError(
                f"values of a texture must be {expected}, rows by columns; got {self.values.shape}"
            )

    @property
    def is_picture(self) -> bool:
        """Whether it is smooth, without edges of its own."""
        return self.kind == _PICTURE

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height, m."""
        return float(self.x_edges[-1] - self.x_edges[0]), float(self.y_edges[-1] - self.y_edges[0])

    @property
    def outline(self) -> NDArray[np.float64]:
        """The four corners (4, 3) of the texture in its own frame, m, clockwise from the top left."""
        left, right, top, bottom = self.x_edges[0], self.x_edges[-1], self.y_edges[0], self.y_edges[-1]
        return np.array([[left, top, 0], [right, top, 0], [right, bottom, 0], [left, bottom, 0]])


def cells(
    x_edges: ArrayLike,
    y_edges: ArrayLike,
    values: ArrayLike,
    radii: ArrayLike | None = None,
    inner: ArrayLike | None = None,
) -> Texture:
    """Rectangles of one reflectance each, exact at any resolution.

    Parameters
    ----------
    x_edges, y_edges : (m + 1,) and (n + 1,) m, increasing
    values : (n, m) reflectance, below 0 where there is nothing
    radii, inner : (n, m) radius (m) and reflectance of a disc in the middle of each cell; 0 for none

    Raises
    ------
    ModelError, ShapeError
        where edges do not increase or the shapes disagree.
    """
    grid = np.asarray(values, dtype=np.float32)
    none = np.zeros_like(grid)
    discs = none if radii is None else np.asarray(radii, dtype=np.float32)
    inside = none if inner is None else np.asarray(inner, dtype=np.float32)
    if not discs.shape == inside.shape == grid.shape:
        raise ShapeError(f"discs of shape {discs.shape} and {inside.shape} do not fit cells {grid.shape}")
    return Texture(_CELLS, _array(x_edges), _array(y_edges), grid, discs, inside)


def distance_field(
    x: ArrayLike, y: ArrayLike, distance_m: ArrayLike, *, within: float = DARK, without: float = PAPER
) -> Texture:
    """Two reflectances, parted where a distance is zero: edges stay sharp on a coarse grid.

    Parameters
    ----------
    x, y : (m,) and (n,) m, equally spaced
    distance_m : (n, m) signed distance to the edge, negative inside the shape
    within, without : reflectance inside and outside
    """
    none = np.zeros((1, 1), dtype=np.float32)
    sides = np.array([[within, without]], dtype=np.float32)
    return Texture(_DISTANCE, _even(x), _even(y), np.asarray(distance_m, np.float32), none, sides)


def picture(image: ArrayLike, width_m: float, *, centre: tuple[float, float] = (0.0, 0.0)) -> Texture:
    """A photograph or drawing on the plane, interpolated; grey levels of 8 bits, or reflectance 0-1.

    Parameters
    ----------
    image : (h, w) uint8, or floats 0-1
    width_m : distance from the centre of the leftmost pixel to that of the rightmost
    centre : where the middle of the picture lies, m
    """
    grey = np.asarray(image)
    if grey.ndim != 2 or min(grey.shape) < 2:
        raise ShapeError(f"a picture must be (h, w) grey levels, 2 by 2 or more; got shape {grey.shape}")
    values = grey.astype(np.float32) / (255.0 if grey.dtype == np.uint8 else 1.0)
    height, width = grey.shape
    step = width_m / (width - 1)
    x = centre[0] + step * (np.arange(width) - 0.5 * (width - 1))
    y = centre[1] + step * (np.arange(height) - 0.5 * (height - 1))
    none = np.zeros((1, 1), dtype=np.float32)
    return Texture(_PICTURE, x, y, values, none, none)


def _array(values: ArrayLike) -> NDArray[np.float64]:
    return np.asarray(values, dtype=np.float64)


def _even(values: ArrayLike) -> NDArray[np.float64]:
    """Crossings of a grid, which must be regular."""
    grid = _array(values)
    steps = np.diff(grid)
    if len(grid) < 2 or not np.allclose(steps, steps[0], rtol=1e-6, atol=0.0):
        raise ModelError("the grid of a distance field must have equal steps; take np.linspace")
    return grid


def _frozen(texture: Any, name: str, array: NDArray[Any]) -> None:
    held = array.copy()
    held.setflags(write=False)
    object.__setattr__(texture, name, held)
