"""What one image says about a board: which of its points were seen, where, and how surely."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import NotFiniteError, ShapeError

__all__ = ["View"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class View:
    """Points of a board and where one image shows them; arrays are copied and read-only.

    Parameters
    ----------
    name : of the image
    size : (width, height) of the image in pixels
    points : (N, 3) on the board, in metres
    pixels : (N, 2) in the image; the centre of the top left pixel is (0, 0)
    ids : (N,) numbers of the points on the board
    sigma_px : (N,) standard deviation of each pixel coordinate; one number stands for all
    findings : what is worth knowing about this view, a sentence each

    Raises
    ------
    ShapeError, NotFiniteError
        if the arrays do not go together, a number is not finite, or a sigma is not positive.
    """

    name: str
    size: tuple[int, int]
    points: Array
    pixels: Array
    ids: Integers
    sigma_px: Array
    findings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        pixels = np.array(self.pixels, dtype=np.float64)
        n = len(pixels) if pixels.ndim else 0
        points, ids = np.array(self.points, dtype=np.float64), np.array(self.ids, dtype=np.int64)
        sigma_px = np.array(np.broadcast_to(np.asarray(self.sigma_px, dtype=np.float64), (n,)))
        given = {"pixels": (pixels, (n, 2)), "points": (points, (n, 3)), "ids": (ids, (n,))}
        for name, (array, shape) in given.items():
            if array.shape != shape:
                raise ShapeError(f"view {self.name!r}: {name} of {n} points are {shape}, got {array.shape}")
        if not (np.isfinite(points).all() and np.isfinite(pixels).all()):
            raise NotFiniteError(f"view {self.name!r}: points and pixels are finite; leave others out")
        if not (np.isfinite(sigma_px).all() and (sigma_px > 0.0).all()):
            raise NotFiniteError(f"view {self.name!r}: every sigma_px is a positive number of pixels")
        arrays = {"points": points, "pixels": pixels, "ids": ids, "sigma_px": sigma_px}
        for name, array in arrays.items():
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        object.__setattr__(self, "size", (int(self.size[0]), int(self.size[1])))
        object.__setattr__(self, "findings", tuple(self.findings))

    def __len__(self) -> int:
        return len(self.ids)

    def subset(self, keep: NDArray[np.bool_] | Integers) -> View:
        """The view of some of its points: a mask (N,) or indices."""
        return View(
            self.name, self.size, self.points[keep], self.pixels[keep], self.ids[keep], self.sigma_px[keep],
            self.findings,
        )  # fmt: skip
