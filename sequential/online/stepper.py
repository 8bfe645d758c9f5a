"""The call of a kernel, and the sentence for a step that fails."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, NotFiniteError, NotPositiveDefiniteError
from sequential.model import StateSpace
from sequential.online.belief import Belief, Innovation
from sequential.online.lowering import handle
from sequential.online.ports import Port

__all__ = ["NOTHING", "OWN_NOISE", "Stepper"]

Array = NDArray[np.float64]
NOTHING, OWN_NOISE = np.zeros(0), np.zeros((0, 0))
REST = math.nan  # s: no step at all
NO_SENSOR = -1
REFUSED = 1  # as in kernels.slots
empty = np.empty  # looked up once, not on every sample


class Stepper:
    """A filter on a model, as two functions of a belief; arguments have been looked at before.

    Holds scratch memory, hence belongs to one thread.
    """

    __slots__ = ("address", "failures", "kept", "kernel", "layout", "size")

    def __init__(self, estimator: Any, model: StateSpace) -> None:
        self.kept = handle(estimator, model)
        self.kernel, self.address, self.layout = self.kept.step, self.kept.address, self.kept.layout
        self.size, self.failures = self.layout.size, self.kept.whole.failures

    def move(self, belief: Belief, ns: int, dt: float, u: Array) -> Belief:
        """The belief `ns` nanoseconds or `dt` seconds later, driven by u (inputs,)."""
        layout = self.layout
        numbers = belief._numbers if belief._layout is layout else self.adopted(belief)  # noqa: SLF001
        out = empty(self.size)
        code = self.kernel(self.address, dt, NO_SENSOR, numbers, NOTHING, u, NOTHING, OWN_NOISE, out)
        if code or self.failures:
            self.explain(code, None, NOTHING, u, out)
        return Belief(out, belief._t + ns, layout)  # noqa: SLF001

    def take(
        self, belief: Belief, ns: int, dt: float, u: Array, port: Port, z: Array, known: Array, noise: Array
    ) -> tuple[Belief, Innovation]:
        """Move by `dt` seconds, unless NaN, and take the reading z (m,) in."""
        layout = self.layout
        numbers = belief._numbers if belief._layout is layout else self.adopted(belief)  # noqa: SLF001
        out = empty(self.size)
        code = self.kernel(self.address, dt, port.index, numbers, z, u, known, noise, out)
        if code or self.failures:
            self.explain(code, port, z, u, out)
        return Belief(out, belief._t + ns, layout), Innovation(out, port.dim, layout)  # noqa: SLF001

    def adopted(self, belief: Belief) -> Array:
        """The numbers of a belief that another filter made, in the layout of this one."""
        theirs, ours = belief._layout, self.layout  # noqa: SLF001
        if theirs == ours:
            return belief._numbers  # noqa: SLF001
        if theirs.shapes != ours.shapes:
            msg = f"a belief about {theirs.manifold} was handed to a model on {ours.manifold}"
            raise DataError(msg)
        return ours.pack(belief.mean, belief.cov)

    def explain(self, code: int, port: Port | None, z: Array, u: Array, out: Array) -> None:
        """Raise what a model function raised, or the sentence for a step that failed."""
        self.kept.whole.raise_failures()
        reading = "" if port is None else f"a reading of {port.name!r}"
        if code == REFUSED:
            raise NotFiniteError(refusal(reading, z, u))
        what = f"the update by {reading}" if reading else "the prediction"
        if not np.isfinite(out[: self.layout.belief]).all():
            msg = (
                f"the belief is no longer finite after {what}: a model function returned NaN or infinity, or "
                "the state diverged; evaluate step and observe at the mean that was handed in"
            )
            raise NotFiniteError(msg)
        msg = (
            f"{what} failed, since a covariance is not positive definite: the state diverged, or noise_cov "
            "is far below the rounding of the predicted covariance; widen the prior or the noise"
        )
        raise NotPositiveDefiniteError(msg)


def refusal(reading: str, z: Array, u: Array) -> str:
    """Why a kernel refused its numbers."""
    if not np.isfinite(u).all():
        return f"the input u = {u} is not finite; a sensor may miss a reading, an input may not"
    if np.isnan(z).any() and not np.isinf(z).any():
        return f"{reading} is {z}, but its manifold is whole or missing: make every number NaN, or mend it"
    return f"{reading} is {z}; it must be finite, or NaN where a component is missing, its context finite"
