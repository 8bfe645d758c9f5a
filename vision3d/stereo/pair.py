"""Two pictures that may be a rectified pair: what is refused, and what is measured before matching."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ShapeError

__all__ = ["Light", "levelled", "light_of", "require_pair"]

Image = NDArray[np.uint8]
QUANTILES = np.linspace(0.05, 0.95, 19)
SAME_GAIN, SAME_OFFSET = 0.03, 3.0  # exposures nearer than this are left as they are


class Light(NamedTuple):
    """How the right picture's levels become the left one's: ``gain · level + offset`` in channels (c,)."""

    gain: NDArray[np.float64]
    offset: NDArray[np.float64]

    @property
    def differs(self) -> bool:
        """Whether by enough to matter."""
        return bool((np.abs(self.gain - 1.0) > SAME_GAIN).any() or (np.abs(self.offset) > SAME_OFFSET).any())


def light_of(left: Image, right: Image) -> Light:
    """Compare the quantiles of both pictures (h, w, c), which see nearly the same."""
    gains, offsets = [], []
    for channel in range(left.shape[2]):
        a, b = (np.quantile(one[..., channel], QUANTILES) for one in (left, right))
        spread = float(np.var(b))
        gain = float(np.mean((a - a.mean()) * (b - b.mean())) / spread) if spread > 1.0 else 1.0
        gain = gain if gain > 0.0 else 1.0
        gains.append(gain)
        offsets.append(float(a.mean() - gain * b.mean()))
    return Light(np.array(gains), np.array(offsets))


def levelled(left: Image, right: Image) -> Image:
    """The right picture in the left one's light."""
    light = light_of(left, right)
    if not light.differs:
        return right
    return np.clip(np.rint(right * light.gain + light.offset), 0, 255).astype(np.uint8)


def require_pair(left: Any, right: Any, least_side: int = 16) -> tuple[Image, Image]:
    """Both pictures as contiguous (h, w, c) uint8 with as many channels.

    Raises
    ------
    ShapeError
        where they are no pictures, or differ in size.
    DataError
        where they are too small for a window, or the same picture twice.
    """
    pair = []
    for side, given in (("left", left), ("right", right)):
        image = np.asarray(given)
        if image.dtype != np.uint8 or image.ndim not in (2, 3) or image.shape[2:] not in ((), (1,), (3,)):
            raise ShapeError(
                f"the {side} picture must be (h, w) or (h, w, 3) of 8 bits; got {image.shape} {image.dtype}"
            )
        pair.append(image.reshape(*image.shape[:2], -1))
    a, b = pair
    if a.shape[:2] != b.shape[:2]:
        raise ShapeError(
            f"a rectified pair has one size; the left picture has {a.shape[1]}x{a.shape[0]} px, the right "
            f"one {b.shape[1]}x{b.shape[0]} px: rectify them together, without cutting or scaling afterwards"
        )
    if min(a.shape[:2]) < least_side:
        raise DataError(
            f"pictures of {a.shape[1]}x{a.shape[0]} px are too small to match; {least_side} px a side do"
        )
    if a.shape[2] != b.shape[2]:
        a, b = (one.mean(axis=2, keepdims=True).round().astype(np.uint8) for one in (a, b))
    if np.array_equal(a, b):
        raise DataError(
            "the left and the right picture are the same, so nothing has moved and nothing has a depth; give "
            "the picture of the other camera"
        )
    return np.ascontiguousarray(a), np.ascontiguousarray(b)
