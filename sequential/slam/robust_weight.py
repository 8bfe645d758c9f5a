"""The weight that a robust loss leaves to a residual."""

from __future__ import annotations

from sequential.model import Loss

__all__ = ["weight"]


def weight(loss: Loss, squared: float) -> float:
    """Weight on the information of a residual whose whitened squared norm is given (Zhang 1997, table 1)."""
    if loss.kind == "huber":
        return 1.0 if squared <= loss.k**2 else loss.k / squared**0.5
    return loss.k**2 / (loss.k**2 + squared)
