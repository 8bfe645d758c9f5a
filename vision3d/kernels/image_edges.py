"""Thin edges, and the lines that edge pixels vote for."""

import numba as nb
import numpy as np

from vision3d.kernels import kernel

__all__ = ["hysteresis", "line_votes", "ridges"]

TANGENT = 13573  # of 22.5°, in 1/2¹⁵


@kernel(nb.void(nb.int32[:, ::1], nb.int32[:, ::1], nb.int32[:, ::1], nb.int64, nb.int64, nb.uint8[:, ::1]))
def ridges(dx, dy, length, low, high, out):
    """2 on a crest of the gradient's length above `high`, 1 above `low`, 0 elsewhere.

    All three are padded by one pixel, `length` by zeros.  Across which two neighbours a crest must stand out
    is told by the gradient's direction, in quarters of a half turn.
    """
    height, width = out.shape
    for y in range(height):
        for x in range(width):
            m = length[y + 1, x + 1]
            out[y, x] = 0
            if m <= low:
                continue
            gx, gy = dx[y + 1, x + 1], dy[y + 1, x + 1]
            ax, ay = abs(gx) * TANGENT, abs(gy) << 15
            if ay < ax:
                crest = m > length[y + 1, x] and m >= length[y + 1, x + 2]
            elif ay > ax + (abs(gx) << 16):
                crest = m > length[y, x + 1] and m >= length[y + 2, x + 1]
            else:
                side = -1 if (gx ^ gy) < 0 else 1
                crest = m > length[y, x + 1 - side] and m > length[y + 2, x + 1 + side]
            if crest:
                out[y, x] = 2 if m > high else 1


@kernel(nb.void(nb.uint8[:, ::1]))
def hysteresis(edges):
    """Turn what is 2, and what is 1 and hangs together with it, to 255; the rest to 0."""
    height, width = edges.shape
    stack = np.empty(height * width, np.int64)
    used = 0
    for y in range(height):
        for x in range(width):
            if edges[y, x] == 2:
                edges[y, x] = 255
                stack[used] = y * width + x
                used += 1
    while used > 0:
        used -= 1
        y, x = stack[used] // width, stack[used] % width
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                if edges[v, u] == 1:
                    edges[v, u] = 255
                    stack[used] = v * width + u
                    used += 1
    for y in range(height):
        for x in range(width):
            if edges[y, x] == 1:
                edges[y, x] = 0


@kernel(
    nb.void(nb.float32[::1], nb.float32[::1], nb.float32[::1], nb.float32[::1], nb.int64, nb.int32[:, ::1])
)
def line_votes(x, y, cosine, sine, middle, votes):
    """Each edge pixel votes, at every angle, for the line through it: votes[k, rho + middle] + 1."""
    for k in range(len(cosine)):
        line = votes[k]
        c, s = cosine[k], sine[k]
        for i in range(len(x)):
            line[int(np.rint(x[i] * c + y[i] * s)) + middle] += 1
