"""Why a step failed, as a sentence."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.errors import (
    FactorlabError,
    ModelError,
    NotFiniteError,
    NotPositiveDefiniteError,
    TimeOrderError,
)
from sequential.online.ports import Port

__all__ = ["backwards", "failure"]

Array = NDArray[np.float64]
REFUSED = 1  # as in kernels.slots


def failure(code: int, port: Port | None, z: Array, u: Array, belief: Array, form: str) -> FactorlabError:
    """The error for a kernel's code; `belief` holds the mean and the covariance that it left."""
    reading = "" if port is None else f"a reading of {port.name!r}"
    if code == REFUSED:
        return NotFiniteError(refusal(reading, z, u))
    what = f"the update by {reading}" if reading else "the prediction"
    if not np.isfinite(belief).all():
        return NotFiniteError(
            f"the belief is no longer finite after {what}: a model function returned NaN or infinity, or the "
            "state diverged; evaluate step and observe at the mean that was handed in"
        )
    if form == "information":
        return ModelError(
            f"the information form cannot make {what}: the transition or the noise of the reading cannot be "
            "inverted, or no information is left on some direction; use form='ud'"
        )
    return NotPositiveDefiniteError(
        f"{what} failed, since a covariance is not positive definite: the state diverged, or noise_cov is "
        "far below the rounding of the predicted covariance; widen the prior or the noise"
    )


def refusal(reading: str, z: Array, u: Array) -> str:
    """Why a kernel refused its numbers."""
    if not np.isfinite(u).all():
        return f"the input u = {u} is not finite; a sensor may miss a reading, an input may not"
    if np.isnan(z).any() and not np.isinf(z).any():
        return f"{reading} is {z}, but its manifold is whole or missing: make every number NaN, or mend it"
    return f"{reading} is {z}; it must be finite, or NaN where a component is missing, its context finite"


def backwards(dt: float) -> TimeOrderError:
    """The error for a step into the past, or to nowhere."""
    return TimeOrderError(
        f"a step lasts zero or more seconds, got dt = {dt}; late readings are for stream(max_delay=…)"
    )
