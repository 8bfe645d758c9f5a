"""What one image says about a board: which of its points were seen, where, and how surely."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import NotFiniteError, ShapeError

__all__ = ["Detections", "Missed", "View", "ViewAudit"]

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


@dataclass(frozen=True)
class Missed:
    """An image in which the board was not found.

    Parameters
    ----------
    name : of the image
    reason : a sentence: what was looked for, what was seen instead, what to do
    seen : columns and rows of the grid that was seen instead; None where there was none
    """

    name: str
    reason: str
    seen: tuple[int, int] | None = None


@dataclass(frozen=True)
class ViewAudit:
    """How far the points of one view can be trusted; rows go with those of the view.

    Parameters
    ----------
    name : of the image
    finder : what found the board
    spacing_px : (N,) distance to the nearest neighbour
    window_px : (N,) half-width of the window in which each point was refined
    allowed_px : (N,) half-width of the largest window that keeps the neighbours out, 0.35 spacings
    residuals : (N, 2) px against a plane seen through a radial distortion of the view's own; empty where
        the view has too few points
    scatter_px : standard deviation of a coordinate of those residuals; NaN where there are none
    noise_px : the same as the noise of the pixels alone predicts
    blur_px, contrast : standard deviation of the blur, and half the step from dark to light in grey levels
        (medians); NaN where they are not measured
    suspicious : ids of points whose residual is no chance
    lost : ids of points that were found and could not be refined; they are not in the view
    moved : ids and px of points that a forced window carries away from where they are
    mirrored : the image is a mirror image
    """

    name: str
    finder: str
    spacing_px: Array
    window_px: Array
    allowed_px: Array
    residuals: Array
    scatter_px: float
    noise_px: float
    blur_px: float = float("nan")
    contrast: float = float("nan")
    suspicious: tuple[int, ...] = ()
    lost: tuple[int, ...] = ()
    moved: tuple[tuple[int, float], ...] = ()
    mirrored: bool = False

    @property
    def window_too_large(self) -> bool:
        """Whether a window reaches beyond what the spacing allows, by more than half a pixel."""
        return bool(np.any(self.window_px > self.allowed_px + 0.5))


@dataclass(frozen=True)
class Detections:
    """What a set of images says about a board.

    Parameters
    ----------
    views : the images that show it
    missed : the images that do not, each with its reason
    audits : one for each view
    findings : what is worth knowing about the set, a sentence each
    """

    views: tuple[View, ...]
    missed: tuple[Missed, ...] = ()
    audits: tuple[ViewAudit, ...] = ()
    findings: tuple[str, ...] = ()
