"""Objects told by their colour: threshold, opening, closing, components.

>>> import numpy as np
>>> from vision3d.objects import largest_object
>>> mask = np.zeros((6, 8), bool)
>>> mask[1:4, 2:5] = True
>>> mask[5, 7] = True
>>> largest_object(mask, 4)
(3.0, 2.0)
>>> largest_object(mask, 10) is None
True
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError
from vision3d.image.components import Components, connected_components
from vision3d.image.morphology import closing, opening, structuring_element
from vision3d.image.pixels import as_image
from vision3d.objects.colour import ColourRange

__all__ = ["Blob", "Blobs", "LightMargin", "find_blobs", "hue_margin", "largest_object", "light_margin"]


@dataclass(frozen=True, slots=True)
class Blob:
    """One piece of a mask.

    Attributes
    ----------
    area : pixels
    centroid : (x, y), px; the centre of the top-left pixel is (0, 0)
    box : (left, top, width, height), px
    cut : whether it touches the edge of the image, so that area and centroid are those of a part
    """

    area: int
    centroid: tuple[float, float]
    box: tuple[int, int, int, int]
    cut: bool


@dataclass(frozen=True)
class Blobs:
    """What was found, largest first.

    Attributes
    ----------
    mask : (h, w) uint8, 255 inside objects
    specks : share of the pixels of the colour that cleaning and the least area took away
    """

    objects: tuple[Blob, ...]
    mask: NDArray[np.uint8]
    specks: float

    def __post_init__(self) -> None:
        self.mask.setflags(write=False)

    def __len__(self) -> int:
        return len(self.objects)


@dataclass(frozen=True, slots=True)
class LightMargin:
    """How the largest object's area changes with the light.

    Attributes
    ----------
    darker, brighter : its area over that under the light of the picture; 1 is best, 0 is lost
    factor : by which the light was multiplied, and divided
    """

    darker: float
    brighter: float
    factor: float


def find_blobs(
    image: ArrayLike,
    colour: ColourRange,
    *,
    least_area: int = 50,
    open_px: int = 3,
    close_px: int = 5,
    connectivity: int = 8,
) -> Blobs:
    """Objects of a colour in a BGR image.

    Parameters
    ----------
    image : (h, w, 3) uint8
    least_area : pixels; smaller pieces are none
    open_px : diameter of the opening, which removes specks and hairs thinner than it; 1 for none
    close_px : diameter of the closing, which fills gaps narrower than it, reflections say; 1 for none
    connectivity : 4 or 8
    """
    raw = colour.mask(image)
    mask = raw
    if open_px > 1:
        mask = opening(mask, structuring_element(open_px, "ellipse"), backend="opencv")
    if close_px > 1:
        mask = closing(mask, structuring_element(close_px, "ellipse"), backend="opencv")
    found = connected_components(mask, connectivity=connectivity, backend="opencv")  # type: ignore[arg-type]
    kept = [k for k in found.by_area() if found.areas[k] >= least_area]
    table = np.zeros(len(found) + 1, np.uint8)
    table[[k + 1 for k in kept]] = 255
    inside: NDArray[np.uint8] = table[found.labels]
    total = np.count_nonzero(raw)
    lost = 1.0 - np.count_nonzero(raw & inside) / total if total else 0.0
    return Blobs(tuple(_blob(found, int(k)) for k in kept), inside, float(lost))


def _blob(found: Components, k: int) -> Blob:
    left, top, width, height = (int(v) for v in found.boxes[k])
    rows, columns = found.labels.shape
    x, y = (float(v) for v in found.centroids[k])
    cut = left == 0 or top == 0 or left + width == columns or top + height == rows
    return Blob(int(found.areas[k]), (x, y), (left, top, width, height), cut)


def largest_object(
    mask: ArrayLike, least_area: int = 1, *, connectivity: int = 4
) -> tuple[float, float] | None:
    """The centroid (x, y) of the largest piece of a mask, or None where none has `least_area` pixels.

    Of equally large ones the first in reading order counts.
    """
    found = connected_components(mask, connectivity=connectivity)  # type: ignore[arg-type]
    if len(found) == 0:
        return None
    k = int(found.by_area()[0])
    if found.areas[k] < least_area:
        return None
    x, y = found.centroids[k]
    return float(x), float(y)


def light_margin(image: ArrayLike, colour: ColourRange, factor: float = 0.6, **options: int) -> LightMargin:
    """The largest object again, with the light multiplied by `factor`, and divided by it.

    What a camera without its own exposure control would see under a weaker and a stronger lamp: levels are
    taken for sRGB's and the light, not the levels, is scaled; bright pixels saturate as they would.

    Parameters
    ----------
    options : those of `find_blobs`
    """
    if not 0 < factor < 1:
        raise DataError(f"light_margin: a factor of {factor}; expected between 0 and 1")
    pixels = as_image(image)
    here = find_blobs(pixels, colour, **options)
    if not here.objects:
        return LightMargin(0.0, 0.0, factor)
    # the largest object itself: another that appears elsewhere is none
    left, top, width, height = here.objects[0].box
    window = (slice(top, top + height), slice(left, left + width))
    before = np.count_nonzero(here.mask[window])

    def after(light: float) -> float:
        levels = np.arange(256) / 255.0
        linear = np.where(levels <= 0.04045, levels / 12.92, ((levels + 0.055) / 1.055) ** 2.4) * light
        back = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.power(linear, 1 / 2.4) - 0.055)
        table = np.rint(255 * np.clip(back, 0, 1)).astype(np.uint8)
        return np.count_nonzero(find_blobs(table[pixels], colour, **options).mask[window]) / before

    return LightMargin(after(factor), after(1 / factor), factor)


def hue_margin(image: ArrayLike, colour: ColourRange, steps: float = 3.0, **options: int) -> float:
    """By how much objects change when the ends of hue are moved by some steps of 2°, out and in.

    Returns
    -------
    difference of their pixels over those now: near 0 where the ends lie between colours; large where one
    of them cuts through the colour of something, so that a little other light moves its outline.  NaN where
    there is no object, or no hue to move.

    Parameters
    ----------
    options : those of `find_blobs`
    """
    wide, narrow = colour.with_hue_moved(steps), colour.with_hue_moved(-steps)
    now = np.count_nonzero(find_blobs(image, colour, **options).mask)
    if now == 0 or colour in (wide, narrow):
        return float("nan")
    areas = [np.count_nonzero(find_blobs(image, one, **options).mask) for one in (wide, narrow)]
    return (areas[0] - areas[1]) / now
