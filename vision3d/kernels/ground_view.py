"""Paint a stripe on the ground into a small image: pixel by pixel, from the distance to its middle.

Each pixel knows its point of the ground in the robot's frame and the parallelogram that it covers there, so a
robot that moves costs three numbers, not a new projection.  Of a straight edge a pixel has the exact share:
the distance from it, over a parallelogram, is the sum of two even spreads, whose distribution is a trapezium.
"""

from __future__ import annotations

import math

from numba import types

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import f0, f1, f2, w2

__all__ = ["stripe_view"]

ground4 = types.Array(types.float64, 4, "C", readonly=True)
ground3 = types.Array(types.float64, 3, "C", readonly=True)
w_index = types.int64[::1]


@inlined
def below(t, wide, narrow):
    """The share of a pixel whose distance is below `t`, its spread along two sides being wide and narrow."""
    low = t + 0.5 * (wide + narrow)
    if low <= 0.0:
        return 0.0
    high = 0.5 * (wide + narrow) - t
    if high <= 0.0:
        return 1.0
    if t <= -0.5 * (wide - narrow):
        return 0.5 * low * low / (wide * narrow)
    if t < 0.5 * (wide - narrow):
        return (low - 0.5 * narrow) / wide
    return 1.0 - 0.5 * high * high / (wide * narrow)


@inlined
def in_view(points, pose, low, high, seen):
    """Write the segments whose x comes between low and high, as the robot sees them: start and step."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    count = 0
    dx, dy = points[0, 0] - pose[0], points[0, 1] - pose[1]
    ax, ay = c * dx + s * dy, c * dy - s * dx
    for k in range(1, points.shape[0]):
        dx, dy = points[k, 0] - pose[0], points[k, 1] - pose[1]
        bx, by = c * dx + s * dy, c * dy - s * dx
        if max(ax, bx) >= low and min(ax, bx) <= high:
            seen[count, 0], seen[count, 1], seen[count, 2], seen[count, 3] = ax, ay, bx - ax, by - ay
            count += 1
        ax, ay = bx, by
    return count


@inlined
def nearest(x, y, seen, near, count):
    """Distance to the nearest of some segments, signed beside it, and the direction in which it grows."""
    best, signed, nx, ny = math.inf, math.inf, 1.0, 0.0
    for m in range(count):
        k = near[m]
        dx, dy = x - seen[k, 0], y - seen[k, 1]
        tx, ty = seen[k, 2], seen[k, 3]
        square = tx * tx + ty * ty
        along = dx * tx + dy * ty
        t = min(max(along, 0.0), square) / square
        dx -= t * tx
        dy -= t * ty
        d = dx * dx + dy * dy
        if d < best:
            best = d
            if 0.0 < along < square or d < 1e-18:
                length = math.sqrt(square)
                nx, ny = -ty / length, tx / length
                signed = dx * nx + dy * ny
            else:
                signed = math.sqrt(d)
                nx, ny = dx / signed, dy / signed
    return signed, nx, ny


@kernel(types.void(ground3, ground4, f2, f2, f2, f0, f1, w2, w_index, w2))
def stripe_view(centres, sides, reach, points, poses, half_width, levels, seen, near, image):
    """Mean level of each pixel over several places of the robot.

    Parameters
    ----------
    centres : (h, w, 2) the point of the ground under the middle of each pixel, in the robot's frame, m;
        NaN above the horizon, where the image takes the ground's level
    sides : (h, w, 2, 2) the two sides of what the pixel covers: how x, y of the ground change from its left
        edge to its right one, and from its upper to its lower one
    reach : (h, 2) least and largest x of each row's points, half a pixel beyond
    points : (n, 2) along the middle of the stripe, in the world, m
    poses : (k, 3) x, y, heading of the robot while the shutter is open
    levels : (2,) of stripe and ground
    seen, near : (n, 4), (n,) scratch
    image : (h, w) is written
    """
    height, width = image.shape
    lowest, highest = math.inf, -math.inf
    for i in range(height):
        lowest, highest = min(lowest, reach[i, 0] - half_width), max(highest, reach[i, 1] + half_width)
    image[:, :] = levels[1]
    depth = (levels[0] - levels[1]) / poses.shape[0]
    for p in range(poses.shape[0]):
        segments = in_view(points, poses[p], lowest, highest, seen)
        for i in range(height):
            low, high = reach[i, 0] - half_width, reach[i, 1] + half_width
            count = 0
            for k in range(segments):
                a, b = seen[k, 0], seen[k, 0] + seen[k, 2]
                if max(a, b) >= low and min(a, b) <= high:
                    near[count] = k
                    count += 1
            if count == 0:
                continue
            for j in range(width):
                x, y = centres[i, j, 0], centres[i, j, 1]
                if math.isnan(x):
                    continue
                signed, nx, ny = nearest(x, y, seen, near, count)
                u = abs(sides[i, j, 0, 0] * nx + sides[i, j, 0, 1] * ny)
                v = abs(sides[i, j, 1, 0] * nx + sides[i, j, 1, 1] * ny)
                wide, narrow = max(u, v), max(min(u, v), 1e-12)
                if abs(signed) - half_width > 0.5 * (wide + narrow):
                    continue
                share = below(half_width - signed, wide, narrow) - below(-half_width - signed, wide, narrow)
                image[i, j] += share * depth
