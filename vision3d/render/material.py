"""What the surfaces of a scene are covered with: photographs, or pictures drawn at random.

    stone = leaves(rng)                     # opaque leaves of every size, one upon another
    poster = photograph(read_image("poster.png"))

Leaves of power-law sizes look the same from near and from far, as photographs of the world do, and give
detectors corners and blobs at every scale (Lee, Mumford and Huang 2001, "Occlusion models for natural
images").
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, ShapeError

__all__ = ["Material", "bricks", "leaves", "photograph", "plain", "speckles"]

DARKEST, LIGHTEST = 0.06, 0.94


@dataclass(frozen=True, eq=False)
class Material:
    """A picture of reflectance, 0 (black) to 1 (white), that continues with itself beyond its edges.

    Parameters
    ----------
    picture : (h, w) float32
    """

    picture: NDArray[np.float32]

    def __post_init__(self) -> None:
        picture = np.array(self.picture, dtype=np.float32)
        if picture.ndim != 2 or picture.size == 0:
            raise ShapeError(
                f"a material is a picture (h, w) of at least one pixel, got shape {picture.shape}"
            )
        if not np.isfinite(picture).all():
            raise ModelError("the reflectance of a material must be finite; it has NaN or infinity")
        picture.setflags(write=False)
        object.__setattr__(self, "picture", picture)

    @cached_property
    def levels(self) -> tuple[NDArray[np.float32], ...]:
        """The picture and its means, each half as wide and high as the one before, down to one pixel."""
        import cv2

        levels = [self.picture]
        while max(levels[-1].shape) > 1:
            height, width = levels[-1].shape
            half = (max(1, width // 2), max(1, height // 2))
            smaller = cv2.resize(levels[-1], half, interpolation=cv2.INTER_AREA).reshape(half[::-1])
            smaller.setflags(write=False)
            levels.append(np.asarray(smaller, dtype=np.float32))
        return tuple(levels)


def photograph(image: ArrayLike) -> Material:
    """A photograph as a material: grey (h, w) or BGR (h, w, 3) of 8 bits, or reflectance 0-1 (h, w)."""
    given = np.asarray(image)
    if given.ndim == 3 and given.shape[2] == 3:
        given = (given @ np.array([0.114, 0.587, 0.299])).round().astype(given.dtype)
    if given.dtype == np.uint8:
        return Material(given.astype(np.float32) / np.float32(255.0))
    return Material(given.astype(np.float32))


def plain(reflectance: float = 0.6) -> Material:
    """One reflectance: a surface on which nothing can be found."""
    return Material(np.full((1, 1), reflectance, dtype=np.float32))


def leaves(
    rng: np.random.Generator,
    size: int = 1024,
    *,
    count: int = 9000,
    radii_px: tuple[float, float] = (2.5, 160.0),
) -> Material:
    """Discs and polygons of random reflectance that cover one another; the number of radius r falls as r^-3.

    Parameters
    ----------
    size : width and height, px
    count : of leaves
    radii_px : the smallest and the largest, px
    """
    import cv2

    low, high = radii_px
    # the inverse of the distribution r^-3 between its bounds; the last drawn lie on top
    share = rng.uniform(size=count)
    radii = (low**-2 - share * (low**-2 - high**-2)) ** -0.5
    centres, tones = rng.uniform(0, size, (count, 2)), rng.uniform(DARKEST, LIGHTEST, count)
    corners, turns = rng.integers(3, 9, count), rng.uniform(0, 2 * np.pi, count)
    picture = np.full((size, size), 0.5, dtype=np.float32)
    for k in range(count):
        n = 24 if corners[k] > 6 else int(corners[k])
        angles = turns[k] + np.arange(n) * (2 * np.pi / n)
        if n < 24:
            angles = angles + rng.uniform(-0.9, 0.9, n) * np.pi / n
        outline = radii[k] * np.column_stack([np.cos(angles), np.sin(angles)])
        for centre in _wrapped(centres[k], float(radii[k]), size):
            points = np.round((outline + centre) * 256).astype(np.int32)
            cv2.fillPoly(picture, [points.reshape(-1, 1, 2)], float(tones[k]), cv2.LINE_8, 8)
    grain = rng.normal(0.0, 0.02, picture.shape).astype(np.float32)
    return Material(np.clip(picture + grain, 0.0, 1.0))


def _wrapped(centre: NDArray[np.float64], radius: float, size: int) -> list[NDArray[np.float64]]:
    """The centre, and where it lies again so that the picture continues with itself."""
    shifts: list[list[float]] = []
    for value in centre:
        own = [0.0]
        if value < radius:
            own.append(size)
        if value > size - radius:
            own.append(-size)
        shifts.append(own)
    return [centre + np.array([dx, dy]) for dx in shifts[0] for dy in shifts[1]]


def speckles(rng: np.random.Generator, size: int = 1024, *, smallest_px: float = 2.0) -> Material:
    """Smooth noise with as much contrast in each octave of size: texture without an edge or a corner."""
    import cv2

    total = np.zeros((size, size), dtype=np.float32)
    sigma = smallest_px
    while sigma < size / 16:
        noise = rng.standard_normal((size, size)).astype(np.float32)
        pad = int(4 * sigma)
        blurred = cv2.GaussianBlur(np.pad(noise, pad, mode="wrap"), (0, 0), sigma)[pad:-pad, pad:-pad]
        total += blurred / np.float32(blurred.std())
        sigma *= 2.0
    total *= np.float32(0.2 / total.std())
    return Material(np.clip(0.5 + total, DARKEST, LIGHTEST))


def bricks(
    columns: int = 8, rows: int = 16, *, brick_px: tuple[int, int] = (64, 32), joint_px: int = 4
) -> Material:
    """A wall of equal bricks: the same picture again and again, which matching cannot tell apart."""
    width, height = brick_px
    if rows % 2 or min(columns, rows, width - joint_px, height - joint_px) < 1:
        raise ModelError(
            f"bricks come in an even number of rows and are wider than their joint; got {columns} by {rows} "
            f"of {brick_px} px with joints of {joint_px} px"
        )
    x, y = np.arange(columns * width), np.arange(rows * height)
    shifted = (x[None] + (y[:, None] // height % 2) * (width // 2)) % width
    joint = (shifted < joint_px) | (y[:, None] % height < joint_px)
    # a stain on each brick, the same on all, gives detectors something to hold
    stain = (shifted - 0.3 * width) ** 2 + (y[:, None] % height - 0.6 * height) ** 2 < (0.15 * height) ** 2
    return Material(np.where(joint, 0.85, np.where(stain, 0.15, 0.4)).astype(np.float32))
