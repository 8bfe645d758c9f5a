"""Objects of one picture under one roof, whichever way they were found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from vision3d.image import Components, connected_components
from vision3d.objects import (
    ColourRange,
    Layout,
    LightMargin,
    ObjectNetwork,
    Preparation,
    find_blobs,
    hue_margin,
    light_margin,
)

__all__ = ["COLOURS", "Found", "Item", "NetworkSettings", "by_colour", "by_network", "colour_of"]

Picture = NDArray[np.uint8]
# pure enough and not too dark; a start for a look at the mask, not a measurement
COLOURS = {
    "red": "hsv:170-8,110-255,60-255",
    "orange": "hsv:6-20,130-255,80-255",
    "yellow": "hsv:20-34,90-255,80-255",
    "green": "hsv:35-85,70-255,40-255",
    "cyan": "hsv:80-100,80-255,60-255",
    "blue": "hsv:95-130,90-255,40-255",
    "magenta": "hsv:140-172,80-255,60-255",
}


@dataclass(frozen=True, slots=True)
class Item:
    """One object.

    Attributes
    ----------
    name : of its colour or class
    centre : (x, y) px: the centroid of its pixels, or the middle of its box
    box : (left, top, width, height) px
    area : pixels; None where only a box is known
    score : of the network; None for a colour
    cut : whether it touches the edge of the picture
    """

    name: str
    centre: tuple[float, float]
    box: tuple[float, float, float, float]
    area: int | None = None
    score: float | None = None
    cut: bool = False


@dataclass(frozen=True, eq=False)
class Found:
    """What was found in a picture.

    Attributes
    ----------
    picture : name of the file
    image : (h, w, 3) BGR
    way : how objects were told
    items : largest, or surest, first
    mask : (h, w) uint8: 255 on objects, the class's number for maps; None where only boxes are known
    colour, light, specks, hue : of the way by colour: the range, and how safely objects lie in it
    facts : of the way by network: file, layout, canvas
    limits : what decided: least area, least score …
    """

    picture: str
    image: Picture
    way: Literal["colour", "boxes", "map"]
    items: tuple[Item, ...]
    mask: NDArray[np.uint8] | None = None
    colour: ColourRange | None = None
    light: LightMargin | None = None
    specks: float = 0.0
    hue: float = float("nan")
    facts: Mapping[str, Any] = field(default_factory=dict)
    limits: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class NetworkSettings:
    """How a network is fed and read; see `vision3d.objects.ObjectNetwork`."""

    layout: Layout | None = None
    names: tuple[str, ...] = ()
    preparation: Preparation = field(default_factory=Preparation)
    least_score: float = 0.25
    most_overlap: float = 0.45
    least_area: int = 50


def colour_of(text: str) -> ColourRange:
    """A range from its text, or from the name of a colour.

    Raises
    ------
    DataError
        where it is neither.
    """
    if ":" in text:
        return ColourRange.from_text(text)
    if (name := text.strip().lower()) not in COLOURS:
        raise DataError(
            f"no colour {text!r}; known are {', '.join(COLOURS)}, or a range such as {COLOURS['red']}"
        )
    return ColourRange.from_text(COLOURS[name])


def by_colour(
    picture: str,
    image: Picture,
    colour: ColourRange,
    *,
    name: str = "",
    least_area: int = 50,
    open_px: int = 3,
    close_px: int = 5,
) -> Found:
    """Objects of a colour, with how they stand a change of light."""
    options = {"least_area": least_area, "open_px": open_px, "close_px": close_px}
    blobs = find_blobs(image, colour, **options)
    items = tuple(
        Item(name or "object", one.centroid, one.box, area=one.area, cut=one.cut) for one in blobs.objects
    )
    light = light_margin(image, colour, **options) if items else None
    hue = hue_margin(image, colour, **options)
    return Found(
        picture, image, "colour", items, blobs.mask, colour, light, blobs.specks, hue, limits=dict(options)
    )


def by_network(picture: str, image: Picture, model: Path, settings: NetworkSettings) -> Found:
    """Boxes of a detector, or pieces of the classes of a map, whichever the network gives."""
    network = ObjectNetwork(
        model, layout=settings.layout, names=settings.names, preparation=settings.preparation
    )
    outputs, _ = network.raw(image)
    layout = network.layout(outputs)
    facts = {
        "model": model.name,
        "layout": layout,
        "layout_guessed": settings.layout is None,
        "canvas": list(network.size),
        "outputs": {k: list(shape) for k, shape in network.file.outputs.items()},
        "named": bool(network.names),
    }
    if layout == "mask":
        return _pieces(picture, image, network, settings, facts)
    found = network.detect(image, least_score=settings.least_score, most_overlap=settings.most_overlap)
    rows, columns = image.shape[:2]
    items: list[Item] = []
    mask: Picture | None = None
    if found.masks is not None:
        mask = np.where(found.masks.any(axis=0), 255, 0).astype(np.uint8)
    for k in range(len(found)):
        left, top, width, height = (float(v) for v in found.boxes[k])
        cut = left <= 0 or top <= 0 or left + width >= columns or top + height >= rows
        centre = (float(found.centres[k, 0]), float(found.centres[k, 1]))
        score = float(found.scores[k])
        area = None
        if found.masks is not None and (area := int(found.masks[k].sum())):
            y, x = np.nonzero(found.masks[k])
            centre = (float(x.mean()), float(y.mean()))
        items.append(Item(found.name(k), centre, (left, top, width, height), area, score, cut))
    limits = {"least_score": settings.least_score, "most_overlap": settings.most_overlap}
    return Found(picture, image, "boxes", tuple(items), mask, facts=facts, limits=limits)


def _pieces(
    picture: str, image: Picture, network: ObjectNetwork, settings: NetworkSettings, facts: dict[str, Any]
) -> Found:
    """Connected pieces of every class but the first, which is the background."""
    found = network.segment(image)
    items: list[Item] = []
    shares: dict[str, float] = {}
    numbers: dict[str, int] = {}
    for label in sorted({int(one) for one in np.unique(found.labels)}):
        shares[found.name(label)] = float(np.mean(found.labels == label))
        numbers[found.name(label)] = label
        if label == 0:
            continue
        inside = found.mask(label, least_confidence=settings.least_score)
        pieces = connected_components(inside, connectivity=8)
        sure = np.bincount(pieces.labels.ravel(), weights=found.confidence.ravel())
        items += [
            _item(found.name(label), pieces, int(k), float(sure[k + 1] / pieces.areas[k]))
            for k in pieces.by_area()
            if pieces.areas[k] >= settings.least_area
        ]
    items.sort(key=lambda one: -(one.area or 0))
    limits = {"least_score": settings.least_score, "least_area": settings.least_area}
    mask = np.minimum(found.labels, 255).astype(np.uint8)
    facts |= {"shares": shares, "numbers": numbers}
    return Found(picture, image, "map", tuple(items), mask, facts=facts, limits=limits)


def _item(name: str, pieces: Components, k: int, score: float) -> Item:
    left, top, width, height = (int(v) for v in pieces.boxes[k])
    rows, columns = pieces.labels.shape
    cut = left == 0 or top == 0 or left + width == columns or top + height == rows
    x, y = (float(v) for v in pieces.centroids[k])
    return Item(name, (x, y), (left, top, width, height), int(pieces.areas[k]), score, cut)
