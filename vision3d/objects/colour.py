"""Which pixels have a colour: a box in HSV or Lab, and how to learn it from a sample.

    red = ColourRange.from_text("hsv:170-8,120-255,60-255")      # hue passes through zero
    mask = red.mask(image)

Hue is an angle, in OpenCV's steps of 2° (0 to 179), so that red lies on both sides of zero: a range whose
lower end is above its upper one goes through it.  Hue and Lab's a and b outlive a change of light better than
BGR does, but thresholds set under one lamp still want a look under another: see `light_margin`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, ShapeError
from vision3d.image.colour import hsv, lab
from vision3d.image.pixels import as_image, as_mask

__all__ = ["ColourRange", "learn_colour"]

Space: TypeAlias = Literal["hsv", "lab", "bgr"]
HUES = 180
# what a channel may be: the first of HSV is an angle
SPANS: dict[str, tuple[tuple[float, float], ...]] = {
    "hsv": ((0, 179), (0, 255), (0, 255)),
    "lab": ((0, 100), (-128, 127), (-128, 127)),
    "bgr": ((0, 255), (0, 255), (0, 255)),
}
PATTERN = re.compile(r"\s*(-?\d+(?:\.\d+)?)\s*(?:-|\.\.|to)\s*(-?\d+(?:\.\d+)?)\s*")


@dataclass(frozen=True)
class ColourRange:
    """A box in a colour space, ends included.

    Parameters
    ----------
    space : "hsv" in OpenCV's bytes (hue 0-179, saturation and value 0-255), "lab" in CIE units, or "bgr"
    low, high : three channels each; in HSV a lower hue above the upper one goes through zero
    """

    space: Space
    low: tuple[float, float, float]
    high: tuple[float, float, float]

    def __post_init__(self) -> None:
        if self.space not in get_args(Space):
            raise DataError(f"no colour space {self.space!r}; known are {', '.join(get_args(Space))}")
        for k, (least, most) in enumerate(SPANS[self.space]):
            low, high = self.low[k], self.high[k]
            if not (least <= low <= most and least <= high <= most):
                raise DataError(
                    f"channel {self.space[k]} of {self.space} runs from {low:g} to {high:g}; expected within"
                    f" {least:g} to {most:g}"
                )
            if low > high and not (self.space == "hsv" and k == 0):
                raise DataError(
                    f"channel {self.space[k]} of {self.space} runs from {low:g} down to {high:g}; only a"
                    " hue may go through zero: exchange them"
                )

    @classmethod
    def from_text(cls, text: str) -> ColourRange:
        """Read "hsv:170-8,120-255,60-255": a space, and a range for each channel (* for all of it).

        Raises
        ------
        DataError
            where it is not written so.
        """
        space, _, rest = text.partition(":")
        space = space.strip().lower()
        if space not in SPANS:
            raise DataError(f"colour {text!r}; expected hsv:H-H,S-S,V-V, lab:… or bgr:…")
        parts = rest.split(",")
        if len(parts) != 3:
            raise DataError(
                f"colour {text!r} has {len(parts)} ranges; expected three, such as 20-35,80-255,*"
            )
        ends = [_ends(part, span, text) for part, span in zip(parts, SPANS[space], strict=True)]
        low, high = (tuple(end[k] for end in ends) for k in (0, 1))
        return cls(space, low, high)  # type: ignore[arg-type]

    def __str__(self) -> str:
        joint = ".." if self.space == "lab" else "-"
        parts = (f"{a:g}{joint}{b:g}" for a, b in zip(self.low, self.high, strict=True))
        return f"{self.space}:{','.join(parts)}"

    def with_hue_moved(self, steps: float) -> ColourRange:
        """The range with both ends of hue moved outwards, or inwards where `steps` is negative.

        A range that is not of HSV, or that has no ends of hue to move, is given back as it is.
        """
        width = (self.high[0] - self.low[0]) % HUES
        if self.space != "hsv" or width >= HUES - 1 or not 0 < width + 2 * steps < HUES - 1:
            return self
        low, high = (self.low[0] - steps) % HUES, (self.high[0] + steps) % HUES
        return replace(self, low=(low, *self.low[1:]), high=(high, *self.high[1:]))

    def mask(self, image: ArrayLike) -> NDArray[np.uint8]:
        """(h, w) 255 where a BGR image has the colour, 0 elsewhere."""
        channels = in_space(image, self.space)
        inside = np.ones(channels.shape[:2], bool)
        for k, (low, high) in enumerate(zip(self.low, self.high, strict=True)):
            one = channels[:, :, k]
            if low <= high:
                inside &= (one >= low) & (one <= high)
            else:  # through zero
                inside &= (one >= low) | (one <= high)
        return inside.astype(np.uint8) * np.uint8(255)


def learn_colour(
    image: ArrayLike,
    sample: ArrayLike,
    *,
    space: Space = "hsv",
    kept: float = 0.95,
    margin: tuple[float, float, float] = (5.0, 30.0, 40.0),
) -> ColourRange:
    """The range that holds most pixels of a sample, and a margin around it.

    Parameters
    ----------
    image : (h, w, 3) BGR
    sample : (h, w) mask, or a box (left, top, width, height), of pixels with the colour
    kept : share of them that each channel's range must hold; the rest may be reflections and shadows
    margin : added at both ends of each channel, in its own units

    Raises
    ------
    DataError
        where the sample is empty, or grey: then hue says nothing, and Lab or brightness should be asked.
    """
    channels = in_space(image, space).astype(np.float64)
    inside = _inside(sample, channels.shape[:2])
    pixels = channels[inside]
    if len(pixels) == 0:
        raise DataError(
            "the sample of a colour has no pixel inside the image; give a box that lies on the object"
        )
    tails = (50 * (1 - kept), 50 * (1 + kept))
    low, high = [], []
    for k, (least, most) in enumerate(SPANS[space]):
        values = pixels[:, k]
        if space == "hsv" and k == 0:
            ends = _hue_range(values, pixels[:, 1], tails, margin[0])
        else:
            a, b = np.percentile(values, tails)
            ends = (max(a - margin[k], least), min(b + margin[k], most))
        low.append(float(np.floor(ends[0])))
        high.append(float(np.ceil(ends[1])))
    return ColourRange(space, (low[0], low[1], low[2]), (high[0], high[1], high[2]))


def in_space(image: ArrayLike, space: Space) -> NDArray[Any]:
    """(h, w, 3) channels of a BGR image in a colour space."""
    if space == "hsv":
        return hsv(image, backend="opencv")
    if space == "lab":
        return lab(image, backend="opencv")
    pixels = as_image(image)
    if pixels.ndim != 3 or pixels.shape[2] < 3:
        raise ShapeError(
            f"image has shape {pixels.shape}; expected (height, width, 3): a grey one has no colour"
        )
    return pixels[:, :, :3]


def _ends(part: str, span: tuple[float, float], text: str) -> tuple[float, float]:
    if part.strip() == "*":
        return span
    found = PATTERN.fullmatch(part)
    if found is None:
        raise DataError(
            f"colour {text!r}: {part.strip()!r} is no range; expected two numbers, such as 20-35, or *"
        )
    return float(found[1]), float(found[2])


def _inside(sample: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    given = np.asarray(sample)
    if given.shape == (4,):
        left, top, width, height = (int(k) for k in given)
        inside = np.zeros(shape, bool)
        inside[max(top, 0) : max(top + height, 0), max(left, 0) : max(left + width, 0)] = True
        return inside
    if given.shape != shape:
        raise ShapeError(
            f"sample has shape {given.shape}; expected a mask {shape}, or (left, top, width, height)"
        )
    return as_mask(given).astype(bool)


def _hue_range(
    hue: NDArray[np.float64], saturation: NDArray[np.float64], tails: tuple[float, float], margin: float
) -> tuple[float, float]:
    """Percentiles around the mean direction, pure colours weighing more."""
    turned = np.exp(2j * np.pi * hue / HUES) * saturation
    if np.median(saturation) < 25 or abs(turned.sum()) < 0.5 * saturation.sum():
        raise DataError(
            f"the sample has no one hue (median saturation {np.median(saturation):.0f} of 255); sample a"
            " plain piece of the object, or use lab"
        )
    centre = np.angle(turned.sum()) / (2 * np.pi) * HUES
    apart = (hue - centre + HUES / 2) % HUES - HUES / 2
    a, b = np.percentile(apart[saturation >= 20], tails)
    if b - a + 2 * margin >= HUES - 1:
        return 0.0, HUES - 1.0
    return np.floor(centre + a - margin) % HUES, np.ceil(centre + b + margin) % HUES
