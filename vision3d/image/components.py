"""Connected components of a mask: which pixels hang together, and how large each piece is.

>>> import numpy as np
>>> from vision3d.image import connected_components
>>> mask = np.array([[1, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 0], [1, 0, 0, 1]])
>>> connected_components(mask).areas.tolist()
[2, 1, 1, 1]
>>> connected_components(mask, connectivity=8).areas.tolist()
[3, 1, 1]
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError
from vision3d.image.pixels import Backend, as_mask, checked_backend

__all__ = ["Components", "connected_components"]

Method: TypeAlias = Literal["union-find", "breadth-first"]


@dataclass(frozen=True)
class Components:
    """The pieces of a mask, in the order of their first pixels: rows from the top, each from the left.

    Attributes
    ----------
    labels : (h, w) int32, 0 for the background, k + 1 for piece k
    areas : (n,) int64 pixels
    centroids : (n, 2) float64 pixels, x and y
    boxes : (n, 4) int32 pixels: left, top, width, height
    """

    labels: NDArray[np.int32]
    areas: NDArray[np.int64]
    centroids: NDArray[np.float64]
    boxes: NDArray[np.int32]

    def __post_init__(self) -> None:
        for array in vars(self).values():
            array.setflags(write=False)

    def __len__(self) -> int:
        return len(self.areas)

    def mask(self, k: int) -> NDArray[np.bool_]:
        """(h, w) where piece k is."""
        inside: NDArray[np.bool_] = self.labels == range(len(self))[k] + 1
        return inside

    def by_area(self) -> NDArray[np.int64]:
        """(n,) numbers of the pieces, largest first; equal ones keep their order."""
        return np.argsort(-self.areas, kind="stable")


def connected_components(
    mask: ArrayLike,
    *,
    connectivity: Literal[4, 8] = 4,
    method: Method = "union-find",
    backend: Backend = "compiled",
) -> Components:
    """Pieces of what is set in a mask (OpenCV: `connectedComponentsWithStats`).

    Parameters
    ----------
    mask : (h, w), set where it is not zero
    connectivity : 4 neighbours that share a side, or 8 that share at least a corner
    method : "union-find" passes twice over the image, "breadth-first" floods from each new pixel; same answer
    backend : "compiled" or "opencv"; "numpy" takes the compiled loops, since each step depends on the one
        before

    Raises
    ------
    ShapeError, NotFiniteError
        where the mask is none.
    """
    inside = as_mask(mask)
    if connectivity not in (4, 8):
        raise DataError(f"connected_components: connectivity {connectivity}; expected 4 or 8")
    if method not in ("union-find", "breadth-first"):
        raise DataError(f"connected_components: no method {method!r}; known are union-find and breadth-first")
    if checked_backend(backend) == "opencv":
        return _opencv(inside, connectivity)
    from vision3d.kernels import image_components as loops

    labels = np.empty(inside.shape, np.int32)
    fill = loops.two_passes if method == "union-find" else loops.breadth_first
    count = fill(inside, connectivity == 8, labels)
    ends, sums = np.empty((count + 1, 4), np.int32), np.empty((count + 1, 3))
    loops.measure(labels, ends, sums)
    boxes = np.column_stack([ends[1:, :2], ends[1:, 2:] - ends[1:, :2] + 1]).astype(np.int32)
    return Components(labels, sums[1:, 0].astype(np.int64), sums[1:, 1:] / sums[1:, :1], boxes)


def _opencv(inside: NDArray[np.uint8], connectivity: int) -> Components:
    """OpenCV numbers blocks of pixels; here its pieces get the order of everybody's."""
    import cv2

    from vision3d.kernels import image_components as loops

    count, before, stats, centroids = cv2.connectedComponentsWithStats(inside, connectivity=connectivity)
    labels: NDArray[np.int32] = np.array(before, np.int32)
    loops.renumber(labels, count - 1)
    # the old name of each new piece, from any of its pixels
    old = np.zeros(count, np.int64)
    old[labels.ravel()] = before.ravel()
    areas = stats[old[1:], cv2.CC_STAT_AREA].astype(np.int64)
    boxes = np.ascontiguousarray(stats[old[1:], :4], dtype=np.int32)
    return Components(labels, areas, np.ascontiguousarray(centroids[old[1:]]), boxes)
