"""Weighted sums over windows of an image that has been padded.

Taps are the outer loop and pixels of a row the inner one, so that rows go through wide registers.
"""

import numba as nb

from vision3d.kernels import kernel

__all__ = ["correlate"]

u8, i16, i32 = nb.uint8[:, ::1], nb.int16[:, ::1], nb.int32[:, ::1]
f32, f64 = nb.float32[:, ::1], nb.float64[:, ::1]


@kernel([nb.void(u8, i16, i16), nb.void(u8, i32, i32), nb.void(f32, f32, f32), nb.void(f64, f64, f64)])
def correlate(padded, taps, out):
    """out[y, x] = Σ taps[j, i] · padded[y + j, x + i]; padded is larger by the window minus one."""
    height, width = out.shape
    rows, columns = taps.shape
    for y in range(height):
        line = out[y]
        for x in range(width):
            line[x] = 0
        for j in range(rows):
            source = padded[y + j]
            for i in range(columns):
                tap = taps[j, i]
                if tap != 0:
                    for x in range(width):
                        line[x] += tap * source[x + i]
