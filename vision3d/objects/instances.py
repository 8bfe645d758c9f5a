"""A mask for every box, from networks that give few maps and a mixture of them for each object (YOLACT).

Bolya et al. (2019): the mask of an object is σ(Σ cₖ Pₖ), the prototypes P being maps over the whole canvas
and the coefficients c a part of the object's row; what lies outside of its box is cut off.  YOLO's "-seg"
models do so.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ShapeError
from vision3d.objects.letterbox import Placement

__all__ = ["instance_masks"]


def instance_masks(
    coefficients: NDArray[np.float64],
    prototypes: NDArray[np.float32],
    boxes: NDArray[np.float64],
    placement: Placement,
) -> NDArray[np.bool_]:
    """Pixels of each object.

    Parameters
    ----------
    coefficients : (n, m)
    prototypes : (1, m, H, W) maps over the canvas
    boxes : (n, 4) left, top, width, height in pixels of the image
    placement : of the image on the canvas

    Returns
    -------
    (n, h, w)

    Raises
    ------
    ShapeError
        where there is not one prototype for each coefficient.
    """
    import cv2

    maps = np.asarray(prototypes, np.float32)
    if maps.ndim != 4 or maps.shape[0] != 1 or maps.shape[1] != coefficients.shape[1]:
        raise ShapeError(
            f"the network gives {coefficients.shape[1]} coefficients an object and maps of shape"
            f" {maps.shape}; expected (1, coefficients, height, width)"
        )
    width, height = placement.image_size
    rows, columns = placement.crop((maps.shape[3], maps.shape[2]))
    inside = maps[0][:, rows, columns]
    y, x = np.arange(height)[:, None] + 0.5, np.arange(width)[None, :] + 0.5
    masks = np.zeros((len(boxes), height, width), bool)
    for k, (left, top, wide, high) in enumerate(boxes):
        # the sign of the odds is the side of one half that σ lies on
        odds = np.tensordot(coefficients[k].astype(np.float32), inside, axes=1)
        full = cv2.resize(np.ascontiguousarray(odds), (width, height))
        box = (x > left) & (x < left + wide) & (y > top) & (y < top + high)
        masks[k] = (np.asarray(full) > 0) & box
    return masks
