"""Responses to a unit step, and what follows from their parameters."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["Model", "bandwidth", "first_order", "overshoot", "rise_time", "second_order"]

Array = NDArray[np.float64]
Model = Callable[[Array, Array], Array]
CRITICAL = 1e-6  # of the damping's distance from one: there the two forms meet


def first_order(t: Array, p: Array) -> Array:
    """1 - exp(-s/τ) with s = t - begin, zero before; p = (begin, τ), s."""
    s = np.maximum(t - p[0], 0.0)
    return np.asarray(-np.expm1(-s / p[1]))


def second_order(t: Array, p: Array) -> Array:
    """Unit step of ω²/(s² + 2ζωs + ω²), zero before it begins; p = (begin, 1/ω, ζ)."""
    s = np.maximum(t - p[0], 0.0) / p[1]
    zeta = float(p[2])
    off = zeta**2 - 1.0
    if abs(off) < CRITICAL:
        return np.asarray(1.0 - np.exp(-s) * (1.0 + s))
    if off < 0.0:
        w = (-off) ** 0.5
        return np.asarray(1.0 - np.exp(-zeta * s) * (np.cos(w * s) + zeta / w * np.sin(w * s)))
    w = off**0.5
    slow, fast = zeta - w, zeta + w  # as two decays: cosh would overflow
    return np.asarray(1.0 - (fast * np.exp(-slow * s) - slow * np.exp(-fast * s)) / (2.0 * w))


def rise_time(model: Model, p: Array, low: float, high: float) -> float:
    """Seconds from a share of the step to another, the first time that each is reached."""
    return _reached(model, p, high) - (_reached(model, p, low) if low > 0.0 else 0.0)


def _reached(model: Model, p: Array, share: float) -> float:
    """Seconds after the beginning: bracket on a grid, then bisect."""
    own = np.concatenate([[0.0], p[1:]])
    slowest = p[1] * (1.0 if len(p) == 2 else 2.0 * max(p[2], 1.0))
    grid = np.linspace(0.0, 8.0 * slowest, 2001)
    above = int(np.argmax(model(grid, own) >= share))
    low, high = grid[max(above - 1, 0)], grid[above]
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if model(np.array([middle]), own)[0] >= share else (middle, high)
    return float(high)


def bandwidth(p: Array) -> float:
    """Frequency (Hz) at which the gain is 1/√2."""
    if len(p) == 2:
        return float(1.0 / (2.0 * np.pi * p[1]))
    a = 1.0 - 2.0 * p[2] ** 2
    return float(np.sqrt(a + np.sqrt(a * a + 1.0)) / (2.0 * np.pi * p[1]))


def overshoot(p: Array) -> float:
    """By which share of the step the response goes beyond it."""
    if len(p) == 2 or p[2] >= 1.0:
        return 0.0
    return float(np.exp(-np.pi * p[2] / np.sqrt(1.0 - p[2] ** 2)))
