"""Light between pixels, and its slopes: cubic convolution of the four by four around (Catmull and Rom)."""

from __future__ import annotations

import math

from vision3d.kernels import inlined

__all__ = ["cubic", "cubic_slope", "inside", "slopes_at", "value_at"]


@inlined
def cubic(f, w):
    """Weights of four neighbours at a fraction f past the second (Catmull and Rom)."""
    w[0] = f * (-0.5 + f * (1.0 - 0.5 * f))
    w[1] = 1.0 + f * f * (-2.5 + 1.5 * f)
    w[2] = f * (0.5 + f * (2.0 - 1.5 * f))
    w[3] = f * f * (-0.5 + 0.5 * f)


@inlined
def cubic_slope(f, w):
    """Derivatives of those weights."""
    w[0] = -0.5 + f * (2.0 - 1.5 * f)
    w[1] = f * (-5.0 + 4.5 * f)
    w[2] = 0.5 + f * (4.0 - 4.5 * f)
    w[3] = f * (-1.0 + 1.5 * f)


@inlined
def value_at(picture, x, y, wx, wy):
    """The image between its pixels, 1 to size - 2."""
    i, j = math.floor(x), math.floor(y)
    cubic(x - i, wx)
    cubic(y - j, wy)
    total = 0.0
    for n in range(4):
        line = picture[j - 1 + n]
        total += wy[n] * (wx[0] * line[i - 1] + wx[1] * line[i] + wx[2] * line[i + 1] + wx[3] * line[i + 2])
    return total


@inlined
def slopes_at(picture, x, y, wx, wy, out):
    """Its derivatives by x and y."""
    i, j = math.floor(x), math.floor(y)
    cubic_slope(x - i, wx)
    cubic(y - j, wy)
    dx = 0.0
    for n in range(4):
        for m in range(4):
            dx += wy[n] * wx[m] * picture[j - 1 + n, i - 1 + m]
    cubic(x - i, wx)
    cubic_slope(y - j, wy)
    dy = 0.0
    for n in range(4):
        for m in range(4):
            dy += wy[n] * wx[m] * picture[j - 1 + n, i - 1 + m]
    out[0], out[1] = dx, dy


@inlined
def inside(picture, x, y):
    """Whether all sixteen neighbours exist."""
    return 1.0 <= x < picture.shape[1] - 2.0 and 1.0 <= y < picture.shape[0] - 2.0
