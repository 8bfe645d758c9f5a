"""What gravity tells of an accelerometer and a gyro: its length at rest, and how it turns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.manifold.quaternion import quaternion_exp, quaternion_inverse, quaternion_multiply, rotate

__all__ = ["is_calm", "level_at_rest", "quietest", "right_factor", "too_far", "turning_errors"]

Array = NDArray[np.float64]
CALM = 0.05  # spread of the quietest part over its level, up to which it counts as rest
FEWEST, WINDOWS = 30, 300  # half seconds from which scales can be told apart, and as many as are used
CLEAR = 0.75  # of the error without turning, below which a factor explains what is seen
FAIR = 0.6  # rad: a mean angle above this explains nothing


def level_at_rest(values: Array, rate: float) -> float:
    """Median length of a vector over the tenth of the recording in which it changes least."""
    return float(np.median(np.linalg.norm(values[quietest(values, rate)], axis=1)))


def is_calm(values: Array, rate: float) -> bool:
    """Whether the quietest tenth is as good as still: its spread is a twentieth of its length."""
    calm = values[quietest(values, rate)]
    width = max(int(0.5 * rate), 5) if np.isfinite(rate) else 5
    blocks = [calm[k : k + width] for k in range(0, len(calm), width)]
    spread = float(np.median([np.linalg.norm(block.std(axis=0)) for block in blocks]))
    return spread < CALM * float(np.median(np.linalg.norm(calm, axis=1)))


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


def turning_errors(gyro: Array, t: NDArray[np.int64], accel: Array, factors: Array) -> Array | None:
    """Mean angle by which the accelerometer's direction is missed after half a second, rad.

    For each factor (K,) that may bring the gyro to rad/s, and last for no turn at all, (K + 1,).  The half
    seconds are those that turn more than most; the gyro's bias is its median where the accelerometer
    rests.  None where there are too few.
    """
    steps = np.diff(t) * 1e-9
    usual = float(np.median(steps)) if len(steps) else 0.0
    count = max(round(0.5 / usual), 4) if usual > 0 else 0
    if count == 0 or len(steps) < 5 * count:
        return None
    free = 0.5 * (gyro[1:] + gyro[:-1])
    if is_calm(accel, 1.0 / usual):
        free = free - np.median(gyro[quietest(accel, 1.0 / usual)], axis=0)
    starts = np.arange(0, len(steps) - count, max(count // 2, 1))
    rows = starts[:, None] + np.arange(count)
    whole = (steps[rows] < 3.0 * usual).all(axis=1)
    edge = max(count // 20, 1)
    first, before = _direction(accel[rows[:, :edge]].mean(axis=1))
    last, after = _direction(accel[rows[:, count - edge :]].mean(axis=1))
    typical = np.median(np.linalg.norm(accel, axis=1))
    fair = whole & (np.abs(before / typical - 1.0) < 0.3) & (np.abs(after / typical - 1.0) < 0.3)
    chosen = np.flatnonzero(fair if fair.sum() >= 0.3 * whole.sum() else whole)
    if len(chosen) < FEWEST:
        return None
    turned = np.linalg.norm((free[rows[chosen]] * steps[rows[chosen]][:, :, None]).sum(axis=1), axis=1)
    chosen = chosen[turned >= np.quantile(turned, 0.6)]
    chosen = chosen[:: max(len(chosen) // WINDOWS, 1)]
    scales = np.append(factors, 0.0)[:, None, None]
    q = np.zeros((len(scales), len(chosen), 4))
    q[..., 0] = 1.0
    for k in range((edge - 1) // 2, count - 1 - (edge - 1) // 2):
        row = rows[chosen, k]
        q = quaternion_multiply(q, quaternion_exp(scales * (free[row] * steps[row][:, None])))
    seen = rotate(quaternion_inverse(q), np.broadcast_to(first[chosen], (*q.shape[:2], 3)))
    cosine = np.clip(np.einsum("kmi,mi->km", seen, last[chosen]), -1.0, 1.0)
    return np.asarray(np.arccos(cosine).mean(axis=1))


def right_factor(errors: Array | None) -> int | None:
    """Index of the factor that turns gravity clearly better than the others and than none, or None."""
    if errors is None:
        return None
    best = int(np.argmin(errors[:-1]))
    others = np.delete(errors[:-1], best)
    clear = errors[best] < min(CLEAR * errors[-1], FAIR) and bool((errors[best] < CLEAR * others).all())
    return best if clear else None


def too_far(errors: Array | None, index: int = 0) -> bool:
    """Whether a factor makes the gyro turn where the accelerometer sees that nothing of the kind happens."""
    return errors is not None and errors[-1] < FAIR and bool(errors[index] > 1.5 * errors[-1] + 0.1)


def _direction(vectors: Array) -> tuple[Array, Array]:
    length = np.linalg.norm(vectors, axis=1)
    return vectors / np.maximum(length, 1e-12)[:, None], length
