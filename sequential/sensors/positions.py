"""Which way is up in a dwell: the six positions, and where on the sphere one more dwell would help most."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.sensors.dwells import Dwells

__all__ = ["POSITIONS", "best_next_direction", "missing_positions", "up_directions"]

Array = NDArray[np.float64]
POSITIONS = ("+x", "-x", "+y", "-y", "+z", "-z")  # the axis that points up
NEAR = np.cos(np.radians(35.0))


def up_directions(means: Array, *, si: bool) -> Array:
    """Unit vectors (K, 3) of what the accelerometer reads at rest; raw counts are centred on their middle."""
    centred = means if si else means - (means.min(axis=0) + means.max(axis=0)) / 2
    return np.asarray(centred / np.maximum(np.linalg.norm(centred, axis=1), 1e-12)[:, None])


def missing_positions(dwells: Dwells) -> tuple[str, ...]:
    """Which of the six positions no dwell is within 35 degrees of, as `z axis down`."""
    if dwells.accel is None:
        return POSITIONS
    up = up_directions(dwells.accel, si=dwells.accel_unit == "m/s^2")
    near = np.vstack([np.eye(3), -np.eye(3)])[[0, 3, 1, 4, 2, 5]] @ up.T
    return tuple(
        f"{name[1]} axis {'up' if name[0] == '+' else 'down'}"
        for name, row in zip(POSITIONS, near, strict=True)
        if row.max() < NEAR
    )


def best_next_direction(up: Array) -> tuple[Array, str]:
    """Direction (3,) farthest from all dwells `up` (K, 3), and how to hold the sensor, in words."""
    k = np.arange(600) + 0.5
    z = 1 - 2 * k / 600
    angle = np.pi * (1 + 5**0.5) * k  # Fibonacci's lattice on the sphere
    lattice = np.stack([np.sqrt(1 - z**2) * np.cos(angle), np.sqrt(1 - z**2) * np.sin(angle), z], axis=1)
    farthest = lattice[int(np.argmin((lattice @ up.T).max(axis=1)))]
    order = np.argsort(-np.abs(farthest))
    words = [
        f"{'xyz'[a]} axis {'up' if farthest[a] > 0 else 'down'}" for a in order if abs(farthest[a]) > 0.4
    ]
    return np.asarray(farthest), " and ".join(words) + (", half way" if len(words) > 1 else "")
