"""Smallest and largest pixel under a structuring element, on an image that has been padded."""

import numba as nb

from vision3d.kernels import kernel

__all__ = ["extreme"]

u8, f32, f64 = nb.uint8[:, ::1], nb.float32[:, ::1], nb.float64[:, ::1]
i64 = nb.int64[:, ::1]


@kernel(
    [nb.void(u8, i64, nb.boolean, u8), nb.void(f32, i64, nb.boolean, f32), nb.void(f64, i64, nb.boolean, f64)]
)
def extreme(padded, offsets, largest, out):
    """out[y, x] = max or min over k of padded[y + offsets[k, 0], x + offsets[k, 1]]."""
    height, width = out.shape
    for y in range(height):
        line = out[y]
        for k in range(len(offsets)):
            # a slice, so that the loop below need not ask whether an index is negative
            first = offsets[k, 1]
            source = padded[y + offsets[k, 0], first : first + width]
            if k == 0:
                for x in range(width):
                    line[x] = source[x]
            elif largest:
                for x in range(width):
                    v = source[x]
                    line[x] = max(line[x], v)
            else:
                for x in range(width):
                    v = source[x]
                    line[x] = min(line[x], v)
