"""What a detector gives, and what a matcher gives: frozen arrays that belong together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, NotFiniteError, ShapeError

__all__ = ["Array", "Features", "Matches"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """Local features of one image, one row each.

    Parameters
    ----------
    pixels : (N, 2) x and y, px; the centre of the top-left pixel is (0, 0)
    descriptors : (N, D) uint8 (binary: bits packed in bytes) or float32
    size_px : (N,) diameter of the neighbourhood that is described
    angle_rad : (N,) its orientation, from x towards y
    response : (N,) how strong the detector found it; comparable within one kind and image only
    sigma_px : (N,) standard deviation of each coordinate
    kind : how they were found, one of `KINDS`
    """

    pixels: Array
    descriptors: NDArray[Any]
    size_px: Array
    angle_rad: Array
    response: Array
    sigma_px: Array
    kind: str = ""

    def __post_init__(self) -> None:
        pixels = np.asarray(self.pixels, dtype=np.float64)
        if pixels.ndim != 2 or pixels.shape[1] != 2:
            raise ShapeError(f"pixels of features are (N, 2), got shape {pixels.shape}")
        if not np.isfinite(pixels).all():
            raise NotFiniteError("pixels of features hold NaN or infinity; leave those rows out")
        own: dict[str, NDArray[Any]] = {"pixels": pixels}
        for name in ("size_px", "angle_rad", "response", "sigma_px"):
            own[name] = np.asarray(getattr(self, name), dtype=np.float64)
            if own[name].shape != (len(pixels),):
                raise ShapeError(
                    f"{name} of {len(pixels)} features is ({len(pixels)},), got {own[name].shape}"
                )
        described = np.asarray(self.descriptors)
        if described.ndim != 2 or len(described) != len(pixels):
            raise ShapeError(f"descriptors of {len(pixels)} features are (N, D), got {described.shape}")
        if described.dtype != np.uint8:
            described = described.astype(np.float32)
        own["descriptors"] = described
        for name, array in own.items():
            object.__setattr__(self, name, _frozen(array))

    def __len__(self) -> int:
        return len(self.pixels)

    @property
    def binary(self) -> bool:
        """Whether descriptors are bits, compared by Hamming's distance."""
        return bool(self.descriptors.dtype == np.uint8)

    def take(self, rows: ArrayLike) -> Features:
        """The features of some rows, in that order."""
        at = np.asarray(rows)
        return Features(
            self.pixels[at], self.descriptors[at], self.size_px[at], self.angle_rad[at], self.response[at],
            self.sigma_px[at], self.kind,
        )  # fmt: skip

    def frames(self) -> Array:
        """(N, 2, 2) similarity of each feature: takes its unit square to the image, px."""
        c, s = np.cos(self.angle_rad), np.sin(self.angle_rad)
        turn = np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)
        return np.asarray(self.size_px[:, None, None] * turn, dtype=np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class Matches:
    """Tentative pairs of features of two images, the most distinctive first (PROSAC's order).

    Parameters
    ----------
    pairs : (M, 2) rows of the first and of the second features
    distance : (M,) between their descriptors: bits, or Euclidean
    ratio : (M,) distance over that to the best feature elsewhere; 0 is distinctive, 1 ambiguous
    """

    pairs: NDArray[np.int64]
    distance: Array
    ratio: Array

    def __post_init__(self) -> None:
        pairs = np.asarray(self.pairs, dtype=np.int64)
        if pairs.ndim != 2 or pairs.shape[1] != 2:
            raise ShapeError(f"pairs of matches are (M, 2) rows of both features, got shape {pairs.shape}")
        object.__setattr__(self, "pairs", _frozen(pairs))
        for name in ("distance", "ratio"):
            values = np.asarray(getattr(self, name), dtype=np.float64)
            if values.shape != (len(pairs),):
                raise ShapeError(f"{name} of {len(pairs)} matches is ({len(pairs)},), got {values.shape}")
            object.__setattr__(self, name, _frozen(values))

    def __len__(self) -> int:
        return len(self.pairs)

    def take(self, rows: ArrayLike) -> Matches:
        """Some of the matches, in the order asked for."""
        at = np.asarray(rows)
        return Matches(self.pairs[at], self.distance[at], self.ratio[at])

    def points(self, a: Features, b: Features) -> tuple[Array, Array]:
        """Pixels (M, 2) of both ends."""
        self._require(a, b)
        return a.pixels[self.pairs[:, 0]], b.pixels[self.pairs[:, 1]]

    def sigma_px(self, a: Features, b: Features) -> tuple[Array, Array]:
        """Standard deviations (M,) of a coordinate at both ends."""
        self._require(a, b)
        return a.sigma_px[self.pairs[:, 0]], b.sigma_px[self.pairs[:, 1]]

    def warps(self, a: Features, b: Features) -> Array:
        """(M, 2, 2) how the first image's surroundings lie in the second, as size and angle say it."""
        self._require(a, b)
        first, second = a.frames()[self.pairs[:, 0]], b.frames()[self.pairs[:, 1]]
        return np.asarray(second @ np.linalg.inv(first), dtype=np.float64)

    def _require(self, a: Features, b: Features) -> None:
        if len(self.pairs) and (self.pairs.max(axis=0) >= (len(a), len(b))).any():
            raise DataError(
                f"the matches name rows up to {self.pairs.max(axis=0).tolist()}, the features are {len(a)} "
                f"and {len(b)}; give the features that were matched"
            )


def _frozen(values: NDArray[Any]) -> NDArray[Any]:
    held = np.array(values, order="C")
    held.flags.writeable = False
    return held
