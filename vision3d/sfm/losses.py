"""Robust losses ρ(s) of a squared residual s: what an outlier costs, and the weight that it keeps.

| name | ρ(s), with b = scale² | weight ρ'(s) |
|---|---|---|
| none | s | 1 |
| huber | s where s ≤ b, else 2 √(b s) − b | 1, else √(b / s) |
| soft_l1 | 2 b (√(1 + s / b) − 1) | 1 / √(1 + s / b) |
| cauchy | b log(1 + s / b) | 1 / (1 + s / b) |

These are Ceres' and therefore COLMAP's, so that ½ Σ ρ is the same number there and here.
Triggs et al. 2000, "Bundle adjustment - a modern synthesis", section 4.3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError

__all__ = ["LOSSES", "check_loss", "loss_of"]

Array = NDArray[np.float64]

LOSSES = ("none", "huber", "soft_l1", "cauchy")


def check_loss(loss: str | None, scale: float) -> str:
    """The name of a loss; raises `ModelError` for an unknown one or for a scale that is not positive."""
    name = loss or "none"
    if name not in LOSSES:
        raise ModelError(f"no loss {loss!r}; known are {', '.join(LOSSES)}")
    if not (np.isfinite(scale) and scale > 0.0):
        raise ModelError(f"the scale of a loss is a positive number of pixels, got {scale}")
    return name


def loss_of(name: str, squares: Array, scale: float) -> tuple[Array, Array]:
    """ρ (N,) and its derivative (N,) of squared residuals (N,), both in the unit of the squares."""
    b = scale * scale
    if name == "huber":
        within = squares <= b
        root = np.sqrt(b * np.where(within, b, squares))
        return np.where(within, squares, 2.0 * root - b), np.where(within, 1.0, b / root)
    if name == "soft_l1":
        root = np.sqrt(1.0 + squares / b)
        return 2.0 * b * (root - 1.0), 1.0 / root
    if name == "cauchy":
        return b * np.log1p(squares / b), 1.0 / (1.0 + squares / b)
    return squares, np.ones_like(squares)
