"""Weighted sums over windows that are a column of taps times a row of them; the image has been padded."""

import numba as nb
import numpy as np

from vision3d.kernels import kernel

__all__ = ["separable", "separable_fixed"]

u8, i16, i32 = nb.uint8[:, ::1], nb.int16[:, ::1], nb.int32[:, ::1]
f32, f64 = nb.float32[:, ::1], nb.float64[:, ::1]
i16v, i32v, f32v, f64v = nb.int16[::1], nb.int32[::1], nb.float32[::1], nb.float64[::1]


@kernel(
    [
        nb.void(u8, i16v, i16v, i16),
        nb.void(u8, i32v, i32v, i32),
        nb.void(f32, f32v, f32v, f32),
        nb.void(f64, f64v, f64v, f64),
    ]
)
def separable(padded, along_x, along_y, out):
    """out[y, x] = Σ along_y[j] · along_x[i] · padded[y + j, x + i]: columns first, then along the row."""
    height, width = out.shape
    wide = padded.shape[1]
    total = np.empty(wide, out.dtype)
    for y in range(height):
        source = padded[y]
        tap = along_y[0]
        for x in range(wide):
            total[x] = tap * source[x]
        for j in range(1, len(along_y)):
            tap = along_y[j]
            if tap != 0:
                source = padded[y + j]
                for x in range(wide):
                    total[x] += tap * source[x]
        line = out[y]
        tap = along_x[0]
        for x in range(width):
            line[x] = tap * total[x]
        for i in range(1, len(along_x)):
            tap = along_x[i]
            if tap != 0:
                for x in range(width):
                    line[x] += tap * total[x + i]


@kernel(nb.void(u8, nb.uint16[::1], nb.uint16[::1], u8))
def separable_fixed(padded, along_x, along_y, out):
    """The same on bytes in fixed point: taps in 1/256 that sum to 256, halves rounded up at the end."""
    height, width = out.shape
    wide = padded.shape[1]
    first, total = np.empty(wide, np.uint16), np.empty(width, np.uint32)
    for y in range(height):
        for x in range(wide):
            first[x] = 0
        for j in range(len(along_y)):
            tap = along_y[j]
            source = padded[y + j]
            for x in range(wide):
                first[x] += tap * source[x]
        for x in range(width):
            total[x] = 1 << 15
        for i in range(len(along_x)):
            weight = np.uint32(along_x[i])
            for x in range(width):
                total[x] += weight * first[x + i]
        line = out[y]
        for x in range(width):
            line[x] = total[x] >> 16
