"""What gravity tells of an accelerometer and a gyro: its length at rest, and how it turns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["level_at_rest", "quietest", "turning_ratio"]

Array = NDArray[np.float64]
EXPLAINED = 0.3  # share of gravity's turning that the gyro must account for before it is believed


def level_at_rest(values: Array, rate: float) -> float:
    """Median length of a vector over the tenth of the recording in which it changes least."""
    return float(np.median(np.linalg.norm(values[quietest(values, rate)], axis=1)))


def quietest(values: Array, rate: float) -> NDArray[np.bool_]:
    """(N,) the half seconds in which a vector changes least, a tenth of all."""
    width = max(int(0.5 * rate), 5) if np.isfinite(rate) else 5
    count = len(values) // width
    if count < 1:
        return np.ones(len(values), dtype=bool)
    spread = values[: count * width].reshape(count, width, 3).std(axis=1).sum(axis=1)
    calm = np.zeros(count, dtype=bool)
    calm[np.argsort(spread)[: max(count // 10, 1)]] = True
    return np.concatenate([np.repeat(calm, width), np.zeros(len(values) - count * width, dtype=bool)])


def turning_ratio(gyro: Array, t: NDArray[np.int64], accel: Array) -> float | None:
    """How much of the gyro's turning gravity shows, by least squares; None where little turns.

    Gravity is fixed in the world, so its direction in the body follows du = -(∫ω dt) × u.  Means over tenths
    of a second keep the body's own acceleration and the noise small beside it; the gyro's bias is its median
    where the accelerometer rests.
    """
    s = (t - t[0]) * 1e-9
    if s[-1] < 1.0:
        return None
    steps = np.diff(s)
    free = gyro - np.median(gyro[quietest(accel, 1.0 / float(np.median(steps)))], axis=0)
    grid = np.arange(0.0, s[-1], 0.1)
    up, length = _direction(np.diff(_integral(accel, s, grid), axis=0))
    angle = _integral(free, s, grid)
    turned = 0.5 * (angle[2:] - angle[:-2])  # from the middle of one tenth to the middle of the next
    expected = -np.cross(turned, 0.5 * (up[1:] + up[:-1]))
    seen = np.diff(up, axis=0)
    fair = (np.abs(length / np.median(length) - 1.0) < 0.2) & _covered(s, steps, grid)
    use = fair[1:] & fair[:-1] & (np.linalg.norm(seen, axis=1) < 0.5)
    power, whole = float((expected[use] ** 2).sum()), float((seen[use] ** 2).sum())
    if use.sum() < 10 or power == 0.0 or whole == 0.0:
        return None
    ratio = float((expected[use] * seen[use]).sum() / power)
    explained = 1.0 - float(((seen[use] - ratio * expected[use]) ** 2).sum()) / whole
    return ratio if explained > EXPLAINED else None


def _integral(values: Array, s: Array, grid: Array) -> Array:
    """(M, 3) integral of a vector from the beginning to the moments of a grid."""
    parts = 0.5 * (values[1:] + values[:-1]) * np.diff(s)[:, None]
    total = np.vstack([np.zeros(3), np.cumsum(parts, axis=0)])
    return np.stack([np.interp(grid, s, total[:, k]) for k in range(3)], axis=1)


def _direction(vectors: Array) -> tuple[Array, Array]:
    length = np.linalg.norm(vectors, axis=1)
    return vectors / np.maximum(length, 1e-12)[:, None], length


def _covered(s: Array, steps: Array, grid: Array) -> NDArray[np.bool_]:
    """(M-1,) tenths of a second into which no pause of the recording reaches."""
    whole = np.ones(len(grid) - 1, dtype=bool)
    for k in np.flatnonzero(steps > 0.1):
        whole[max(int(s[k] / 0.1), 0) : int(s[k + 1] / 0.1) + 1] = False
    return whole
