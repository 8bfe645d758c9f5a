"""What gyro and camera tell about each other before any trajectory: clocks, mounting rotation, gyro bias.

The camera turns between two frames as the gyro says between the same two moments: the angle does not depend
on how they are mounted, so it finds the offset of the clocks; then the axes find the rotation (Wahba 1965, by
singular values: Markley 1988), the bias and the offset to a fraction of a frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.signal import fftconvolve

from sequential.errors import DataError
from sequential.manifold import SO3

__all__ = ["Aligned", "Turns", "align", "turns_between"]

Array = NDArray[np.float64]
FEWEST_TURNS = 15
LONGEST_S = 0.35  # between two frames whose turn is compared
PER_FRAME = 4  # offsets tried a frame interval
ROUNDS = 12


@dataclass(frozen=True, eq=False)
class Turns:
    """Rotations of the camera between consecutive frames: begins, ends (M,) s, and vectors (M, 3) rad."""

    begins: Array
    ends: Array
    vectors: Array

    @property
    def seconds(self) -> Array:
        """How long each took, (M,)."""
        return self.ends - self.begins

    @property
    def rates(self) -> Array:
        """(M, 3) rad/s in the camera's axes."""
        return self.vectors / self.seconds[:, None]


@dataclass(frozen=True, eq=False)
class Aligned:
    """Clocks and rotation from turns alone.

    Parameters
    ----------
    time_offset_s : IMU clock less camera clock
    camera_R_imu : (3, 3)
    gyro_bias : (3,) rad/s
    correlation : of the two speeds of turning at that offset
    rival : the next best correlation, at an offset that is another one
    gain : the gyro's speed of turning over the camera's
    mirrored : an IMU with left-handed axes would fit better
    offsets_s, correlations : the curve
    residual_rad : of a turn, typical
    """

    time_offset_s: float
    camera_R_imu: Array
    gyro_bias: Array
    correlation: float
    rival: float
    gain: float
    mirrored: bool
    offsets_s: Array
    correlations: Array
    residual_rad: float


def turns_between(t: Array, board_q_camera: Array) -> Turns:
    """Turns of the camera between consecutive frames (F,) that are near enough in time."""
    usual = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
    near = np.diff(t) < max(min(LONGEST_S, 3.5 * usual), 1.5 * usual)
    vectors = SO3().local(board_q_camera[:-1], board_q_camera[1:])
    return Turns(t[:-1][near], t[1:][near], vectors[near])


def align(turns: Turns, imu_t: Array, gyro: Array, search: tuple[float, float]) -> Aligned:
    """Find the offset of the clocks within `search` (s), and the rotation.

    Raises
    ------
    DataError
        where too few turns fall into the IMU's recording at any offset.
    """
    total = np.vstack(
        [np.zeros(3), np.cumsum(0.5 * (gyro[1:] + gyro[:-1]) * np.diff(imu_t)[:, None], axis=0)]
    )
    offsets, correlations = _correlate(turns, imu_t, total, search)
    best = int(np.argmax(correlations))
    step = float(offsets[1] - offsets[0]) if len(offsets) > 1 else 0.01
    apart = np.abs(offsets - offsets[best]) > max(0.5, 4.0 * step)
    rival = float(np.max(correlations[apart], initial=-1.0))

    def misfit(offset: float) -> float:
        integrated, inside = _integrated(turns, imu_t, total, offset)
        if inside.sum() < FEWEST_TURNS:
            return 1e9
        return _wahba(turns.vectors[inside], integrated[inside], turns.seconds[inside])[2]

    around = np.clip([offsets[best] - 2.0 * step, offsets[best] + 2.0 * step], *search)
    found = minimize_scalar(misfit, bounds=around, method="bounded", options={"xatol": 1e-5})
    offset = float(found.x)
    integrated, inside = _integrated(turns, imu_t, total, offset)
    camera, own, dt = turns.vectors[inside], integrated[inside], turns.seconds[inside]
    R, bias, residual = _wahba(camera, own, dt)
    mirrored = _wahba(camera, own, dt, handed=-1.0)[2]
    gain = _gain(camera, own, dt)
    return Aligned(
        offset, R, bias, float(correlations[best]), rival, gain, mirrored < 0.5 * residual,
        offsets, correlations, residual,
    )  # fmt: skip


def _gain(camera: Array, own: Array, dt: Array) -> float:
    """How many times faster the gyro turns than the camera: by deviations from the median, free of bias."""
    sizes = [
        np.linalg.norm(one / dt[:, None] - np.median(one / dt[:, None], axis=0), axis=1)
        for one in (own, camera)
    ]
    busy = sizes[1] >= np.median(sizes[1])
    return float(np.median(sizes[0][busy]) / max(float(np.median(sizes[1][busy])), 1e-12))


def _integrated(turns: Turns, imu_t: Array, total: Array, offset: float) -> tuple[Array, NDArray[np.bool_]]:
    """The gyro's turns (M, 3) over the same intervals, and which lie in its recording."""
    begins, ends = turns.begins + offset, turns.ends + offset
    inside = (begins >= imu_t[0]) & (ends <= imu_t[-1])
    both = [np.column_stack([np.interp(t, imu_t, total[:, k]) for k in range(3)]) for t in (begins, ends)]
    return both[1] - both[0], inside


def _correlate(turns: Turns, imu_t: Array, total: Array, search: tuple[float, float]) -> tuple[Array, Array]:
    """Pearson's correlation of the two speeds of turning at every offset, over what overlaps there."""
    step = float(np.median(turns.seconds)) / PER_FRAME
    width = float(np.median(turns.seconds))
    middles = 0.5 * (turns.begins + turns.ends)
    cells = np.round((middles - middles[0]) / step).astype(np.int64)
    a, mask = np.zeros(cells[-1] + 1), np.zeros(cells[-1] + 1)
    a[cells], mask[cells] = np.linalg.norm(turns.rates, axis=1), 1.0
    # the gyro's mean over the length of a turn, on the same lattice
    low = middles[0] + search[0]
    t = np.arange(low, middles[-1] + search[1] + step, step)
    inside = (t - width / 2 >= imu_t[0]) & (t + width / 2 <= imu_t[-1])
    near = [
        np.column_stack([np.interp(t + half, imu_t, total[:, k]) for k in range(3)])
        for half in (-width / 2, width / 2)
    ]
    b = np.where(inside, np.linalg.norm(near[1] - near[0], axis=1) / width, 0.0)
    if len(t) < len(a):
        t, b, inside = (np.pad(x, (0, len(a) - len(t))) for x in (t, b, inside))

    def slid(x: Array, y: Array) -> Array:
        return np.asarray(fftconvolve(y, x[::-1], mode="valid"))

    seen = inside.astype(np.float64)
    count = np.maximum(np.round(slid(mask, seen)), 0.0)
    sums = slid(a, seen), slid(mask, b), slid(a, b), slid(a * a, seen), slid(mask, b * b)
    n = np.maximum(count, 1.0)
    covariance = sums[2] / n - sums[0] * sums[1] / n**2
    spread = np.maximum(sums[3] / n - (sums[0] / n) ** 2, 0.0) * np.maximum(
        sums[4] / n - (sums[1] / n) ** 2, 0.0
    )
    enough = count >= max(FEWEST_TURNS, 0.25 * min(len(middles), count.max()))
    floor = 1e-9 * max(float(spread.max()), 1e-30)
    value = np.where(enough & (spread > floor), covariance / np.sqrt(np.maximum(spread, floor)), -1.0)
    if not enough.any():
        raise DataError(
            f"fewer than {FEWEST_TURNS} pairs of frames fall into the IMU's recording at any offset of the "
            f"clocks from {search[0]:.2f} to {search[1]:.2f} s; are both of the same time?"
        )
    return np.asarray(search[0] + step * np.arange(len(value))), np.asarray(value, dtype=np.float64)


def _wahba(camera: Array, own: Array, dt: Array, handed: float = 1.0) -> tuple[Array, Array, float]:
    """Rotation and bias with camera = R (own - bias dt), wrong turns weighted down; the typical misfit."""
    weight = np.ones(len(camera))
    R, bias, residual = np.eye(3), np.zeros(3), 1.0
    for _ in range(ROUNDS):
        left = weight[:, None] * camera
        # the bias makes a part in proportion to dt, which is taken out of both before the axes are compared
        share = weight * dt / np.sum(weight * dt**2)
        rest_camera = camera - dt[:, None] * (share @ camera)
        rest_own = own - dt[:, None] * (share @ own)
        left = weight[:, None] * rest_camera
        U, _, Vt = np.linalg.svd(left.T @ rest_own)
        R = U @ np.diag([1.0, 1.0, handed * np.sign(np.linalg.det(U @ Vt))]) @ Vt
        bias = share @ own - R.T @ (share @ camera)
        misfit = np.linalg.norm(camera - (own - bias * dt[:, None]) @ R.T, axis=1)
        residual = max(float(np.median(misfit)), 1e-12)
        weight = 1.0 / (1.0 + (misfit / (2.0 * residual)) ** 2)
    return R, bias, residual
