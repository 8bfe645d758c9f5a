"""Boxes of detectors: how much two overlap, and which of many on one object to keep.

A box is (left, top, width, height) in pixels counted from the image's edge: (2, 3, 4, 5) covers the pixels of
columns 2 to 5 and rows 3 to 7, and its centre is the point (3.5, 5.0), as pixels are counted from their
centres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, NotFiniteError, ShapeError

__all__ = ["Detections", "iou", "non_maximum_suppression"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Detections:
    """What a detector found in one image, surest first.

    Attributes
    ----------
    boxes : (n, 4) left, top, width, height, px
    scores : (n,) 0 to 1
    labels : (n,) int64 numbers of classes
    names : of the classes, by number; may be empty
    masks : (n, h, w) pixels of each, where the network tells them
    """

    boxes: Floats
    scores: Floats
    labels: NDArray[np.int64]
    names: tuple[str, ...] = ()
    masks: NDArray[np.bool_] | None = None

    def __post_init__(self) -> None:
        for array in (self.boxes, self.scores, self.labels, self.masks):
            if array is not None:
                array.setflags(write=False)

    def __len__(self) -> int:
        return len(self.scores)

    def name(self, k: int) -> str:
        """What detection k is called: the name of its class, or its number."""
        label = int(self.labels[k])
        return self.names[label] if 0 <= label < len(self.names) else f"class {label}"

    @property
    def centres(self) -> Floats:
        """(n, 2) middle points, px; the centre of the top-left pixel is (0, 0)."""
        centres: Floats = self.boxes[:, :2] + self.boxes[:, 2:] / 2 - 0.5
        return centres


def iou(a: ArrayLike, b: ArrayLike) -> Floats:
    """Intersection over union of every box of one list with every box of another.

    Parameters
    ----------
    a, b : (n, 4) and (m, 4) left, top, width, height

    Returns
    -------
    (n, m) 0 where they are apart, 1 where they are the same; two boxes without area are the same
    """
    first, second = _boxes(a), _boxes(b)
    low = np.maximum(first[:, None, :2], second[None, :, :2])
    high = np.minimum(first[:, None, :2] + first[:, None, 2:], second[None, :, :2] + second[None, :, 2:])
    both = np.clip(high - low, 0.0, None).prod(axis=2)
    areas = first[:, 2:].prod(axis=1)[:, None] + second[:, 2:].prod(axis=1)[None, :]
    union = areas - both
    share: Floats = np.divide(both, union, out=np.ones_like(both), where=areas > np.finfo(np.float64).eps)
    return share


def non_maximum_suppression(
    boxes: ArrayLike,
    scores: ArrayLike,
    *,
    least_score: float = 0.25,
    most_overlap: float = 0.45,
    labels: ArrayLike | None = None,
    most: int = 0,
) -> NDArray[np.int64]:
    """Which boxes stand for objects: the surest, and no other that overlaps one taken (OpenCV: `NMSBoxes`).

    Parameters
    ----------
    boxes : (n, 4) left, top, width, height
    scores : (n,)
    least_score : only scores above it count
    most_overlap : intersection over union with a surer one; above it a box is taken for the same object
    labels : (n,) classes; boxes of different ones do not suppress each other (OpenCV: `NMSBoxesBatched`)
    most : how many boxes at most; 0 for all

    Returns
    -------
    (k,) int64 numbers of boxes, surest first; equal scores keep their order
    """
    rows = _boxes(boxes)
    sure = np.asarray(scores, dtype=np.float64)
    if sure.shape != (len(rows),):
        raise ShapeError(f"scores have shape {sure.shape}; expected ({len(rows)},), one for each box")
    if not np.isfinite(sure).all():
        raise NotFiniteError("a score is NaN or infinite; the network or its input is at fault")
    kinds = np.zeros(len(rows), np.int64) if labels is None else np.asarray(labels, dtype=np.int64)
    if kinds.shape != sure.shape:
        raise ShapeError(f"labels have shape {kinds.shape}; expected {sure.shape}, one for each box")
    if not 0 <= most_overlap <= 1:
        raise DataError(f"non_maximum_suppression: most_overlap {most_overlap}; expected 0 to 1")
    from vision3d.kernels import object_boxes

    order = np.flatnonzero(sure > least_score)
    order = order[np.argsort(-sure[order], kind="stable")]
    kept = np.empty(len(order), np.int64)
    count = object_boxes.suppress(
        np.ascontiguousarray(rows[order]), kinds[order], np.float32(most_overlap), most or len(order), kept
    )
    chosen: NDArray[np.int64] = order[kept[:count]]
    return chosen


def _boxes(given: ArrayLike) -> Floats:
    rows = np.asarray(given, dtype=np.float64)
    rows = rows.reshape(-1, 4) if rows.size == 0 or rows.shape == (4,) else rows
    if rows.ndim != 2 or rows.shape[1] != 4:
        raise ShapeError(f"boxes have shape {rows.shape}; expected (n, 4): left, top, width, height")
    if not np.isfinite(rows).all():
        raise NotFiniteError("a box holds NaN or infinity; the network or its input is at fault")
    if (rows[:, 2:] < 0).any():
        raise DataError(
            "a box has a negative width or height; expected left, top, width, height, not corners"
        )
    return rows
