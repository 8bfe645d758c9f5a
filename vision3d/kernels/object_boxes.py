"""Suppression of boxes that overlap a surer one."""

import numba as nb
import numpy as np

from vision3d.kernels import kernel

__all__ = ["suppress"]


@kernel(nb.int64(nb.float64[:, ::1], nb.int64[::1], nb.float32, nb.int64, nb.int64[::1]))
def suppress(boxes, labels, most_overlap, most, kept):
    """Fill `kept` with numbers of boxes, which come surest first; returns how many.

    A box is left, top, width, height.  The share is rounded to float32 by way of the distance 1 - share, as
    OpenCV does, so that boxes exactly at the limit fall on the same side.
    """
    count = 0
    for k in range(len(boxes)):
        left, top = boxes[k, 0], boxes[k, 1]
        right, bottom = left + boxes[k, 2], top + boxes[k, 3]
        area = boxes[k, 2] * boxes[k, 3]
        free = True
        for i in range(count):
            other = kept[i]
            if labels[other] != labels[k]:
                continue
            wide = min(right, boxes[other, 0] + boxes[other, 2]) - max(left, boxes[other, 0])
            high = min(bottom, boxes[other, 1] + boxes[other, 3]) - max(top, boxes[other, 1])
            both = wide * high if wide > 0.0 and high > 0.0 else 0.0
            total = area + boxes[other, 2] * boxes[other, 3]
            share = both / (total - both) if total > 2.220446049250313e-16 else 1.0
            if np.float32(1.0) - np.float32(1.0 - share) > most_overlap:
                free = False
                break
        if free:
            kept[count] = k
            count += 1
            if count == most:
                break
    return count
