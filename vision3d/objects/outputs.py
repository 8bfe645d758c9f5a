"""From a network's numbers to boxes or classes of pixels, whichever family it is of.

    layout     shape of the output       a row is
    yolo       (1, 4 + C, N)             cx cy w h, a score for each class (YOLOv8 and later)
    yolov5     (1, N, 5 + C)             cx cy w h, objectness, a score for each class (YOLOv5 to v7)
    final      (1, N, 6)                 x₁ y₁ x₂ y₂, score, class: suppressed already (YOLOv10)
    ssd        (1, 1, N, 7)              image, class, score, x₁ y₁ x₂ y₂ over the image's size
    ssd-pair   (1, N, 4) and (1, N, C)   x₁ y₁ x₂ y₂ over the image's size; scores, background first
    mask       (1, C, H, W)              a score for each class at each cell; one alone: object or not

Where the number of classes is known, what YOLO's rows hold beyond them is kept as coefficients (of masks in
"-seg" models, whose second output holds the maps; of key points in others).

YOLO's boxes are in pixels of the canvas.  Six numbers a row are "final" where rows are at most a thousand,
and "yolov5" with one class where there are more; where that is wrong, the caller names the layout.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ShapeError

__all__ = ["LAYOUTS", "Candidates", "Layout", "candidates", "class_scores", "guess_layout"]

Layout: TypeAlias = Literal["yolo", "yolov5", "final", "ssd", "ssd-pair", "mask"]
LAYOUTS: tuple[Layout, ...] = ("yolo", "yolov5", "final", "ssd", "ssd-pair", "mask")
Floats = NDArray[np.float64]
MANY = 1000  # rows: grids have more cells, lists of final boxes fewer


class Candidates(NamedTuple):
    """Boxes of the canvas before suppression: (n, 4) left, top, width, height; (n,) scores; (n,) classes.

    `coefficients` (n, m) are numbers of each row beyond its classes.
    """

    boxes: Floats
    scores: Floats
    labels: NDArray[np.int64]
    coefficients: Floats


def guess_layout(shapes: Sequence[tuple[int, ...]]) -> Layout:
    """The family that outputs of these shapes belong to.

    Raises
    ------
    ShapeError
        where they belong to none that is known.
    """
    if sorted(len(shape) for shape in shapes) == [3, 4]:  # boxes, and the maps that masks are mixed of
        return guess_layout([shape for shape in shapes if len(shape) == 3])
    if len(shapes) == 2:
        last = sorted(shape[-1] for shape in shapes if len(shape) == 3)
        if len(last) == 2 and 4 in last:
            return "ssd-pair"
    if len(shapes) == 1:
        shape = shapes[0]
        if len(shape) == 4:
            return "ssd" if shape[1] == 1 and shape[3] == 7 else "mask"
        if len(shape) == 3:
            _, rows, columns = shape
            if columns == 6 and rows <= MANY:
                return "final"
            if rows < columns and rows > 4:
                return "yolo"
            if columns > 5:
                return "yolov5"
    said = ", ".join(str(shape) for shape in shapes)
    raise ShapeError(
        f"the network's outputs have shapes {said}, which belong to no family known here"
        f" ({', '.join(LAYOUTS)}); name the one it is, or take the raw outputs"
    )


def candidates(
    outputs: Sequence[NDArray[np.float32]],
    layout: Layout,
    canvas_size: tuple[int, int],
    least_score: float,
    classes: int = 0,
) -> Candidates:
    """Boxes with a score above the least one.

    Parameters
    ----------
    outputs : of the network
    canvas_size : (width, height) px of its input
    classes : how many there are; 0 where that is unknown, and all that YOLO's rows hold are classes

    Raises
    ------
    ShapeError
        where outputs are not of that layout, or scores not between 0 and 1.
    """
    coefficients: Floats | None = None
    size = np.array([*canvas_size, *canvas_size], dtype=np.float64)
    match layout:
        case "yolo" | "yolov5":
            rows = _two_dimensional(outputs, layout)
            rows = rows.T if layout == "yolo" else rows
            first = 4 if layout == "yolo" else 5
            _at_least(rows, first + max(classes, 1), layout)
            scores, coefficients = np.split(rows[:, first:], [classes or rows.shape[1]], axis=1)
            labels = scores.argmax(axis=1)
            best = scores[np.arange(len(rows)), labels] * (rows[:, 4] if layout == "yolov5" else 1.0)
            boxes = np.hstack([rows[:, :2] - rows[:, 2:4] / 2, rows[:, 2:4]])
        case "final":
            rows = _two_dimensional(outputs, layout)
            _at_least(rows, 6, layout)
            best, labels = rows[:, 4], rows[:, 5]
            boxes = _from_corners(rows[:, :4])
        case "ssd":
            rows = _two_dimensional(outputs, layout)
            _at_least(rows, 7, layout)
            rows = rows[rows[:, 0] >= 0]  # -1 ends the list
            best, labels = rows[:, 2], rows[:, 1]
            boxes = _from_corners(rows[:, 3:7] * size)
        case "ssd-pair":
            boxes, best, labels = _pair(outputs, size)
        case _:
            raise DataError(
                f"layout {layout!r} gives no boxes; known for boxes are {', '.join(LAYOUTS[:-1])}"
            )
    most = float(best[np.isfinite(best)].max(initial=0.0))
    if most > 1.001:
        raise ShapeError(
            f"{layout}: scores run up to {most:.3g}, expected 0 to 1; the outputs are of another layout, of a"
            " model that does more than detect (give the names of its classes), or not yet probabilities"
        )
    kept = np.isfinite(best) & (best > least_score) & np.isfinite(boxes).all(axis=1)
    boxes = boxes[kept]
    boxes[:, 2:] = np.maximum(boxes[:, 2:], 0.0)
    more = np.zeros((len(kept), 0)) if coefficients is None else coefficients
    return Candidates(boxes, np.asarray(best[kept], np.float64), labels[kept].astype(np.int64), more[kept])


def class_scores(outputs: Sequence[NDArray[np.float32]]) -> NDArray[np.float32]:
    """(C, H, W) probabilities of classes, background and object where the network gives one channel.

    Outputs that are no probabilities yet are passed through softmax, a single channel through the logistic.

    Raises
    ------
    ShapeError
        where the first output is no map.
    """
    found = np.asarray(outputs[0], np.float32)
    if found.ndim != 4 or found.shape[0] != 1:
        raise ShapeError(
            f"mask: the output has shape {found.shape}; expected (1, classes, height, width): another layout?"
        )
    found = found[0]
    if not np.isfinite(found).all():
        raise DataError("the network's map holds NaN or infinity; its input or its weights are at fault")
    if len(found) == 1:
        share = found[0] if found.min() >= 0 and found.max() <= 1 else 1 / (1 + np.exp(-found[0]))
        return np.asarray(np.stack([1 - share, share]), np.float32)
    total = found.sum(axis=0)
    if found.min() >= 0 and np.allclose(total, 1, atol=1e-3):
        return np.asarray(found, np.float32)
    odds = np.exp(found - found.max(axis=0))
    return np.asarray(odds / odds.sum(axis=0), np.float32)


def _pair(outputs: Sequence[NDArray[np.float32]], size: Floats) -> tuple[Floats, Floats, NDArray[np.int64]]:
    rows = [np.asarray(one, np.float64).reshape(-1, one.shape[-1]) for one in outputs]
    corners, scores = rows if rows[0].shape[1] == 4 else rows[::-1]
    if corners.shape[1] != 4 or len(corners) != len(scores) or scores.shape[1] < 2:
        said = ", ".join(str(one.shape) for one in outputs)
        raise ShapeError(f"ssd-pair: outputs have shapes {said}; expected (1, N, 4) and (1, N, classes)")
    labels = scores[:, 1:].argmax(axis=1) + 1
    return _from_corners(corners * size), scores[np.arange(len(labels)), labels], labels


def _two_dimensional(outputs: Sequence[NDArray[np.float32]], layout: Layout) -> Floats:
    tables = [one for one in outputs if one.ndim == 3] or list(outputs)
    found = np.asarray(tables[0], np.float64)
    if found.ndim < 2 or any(n != 1 for n in found.shape[:-2]):
        raise ShapeError(
            f"{layout}: the output has shape {found.shape}; expected (1, rows, columns): another layout?"
        )
    return found.reshape(found.shape[-2:])


def _at_least(rows: Floats, columns: int, layout: Layout) -> None:
    exactly = layout in ("final", "ssd")
    if rows.shape[1] < columns or (exactly and rows.shape[1] != columns):
        wanted = f"{columns}{'' if exactly else ' or more'}"
        raise ShapeError(
            f"{layout}: rows have {rows.shape[1]} numbers; expected {wanted}: another layout, or names?"
        )


def _from_corners(corners: Floats) -> Floats:
    return np.hstack([corners[:, :2], corners[:, 2:] - corners[:, :2]])
