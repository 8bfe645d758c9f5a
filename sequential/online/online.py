"""A filter fed sample by sample, at the cost of a microsecond: beliefs go in and come out."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, FactorlabError
from sequential.log import nanoseconds
from sequential.model import Gaussian, StateSpace
from sequential.online.belief import Belief, Innovation
from sequential.online.failing import backwards, failure
from sequential.online.lowering import handle
from sequential.online.ports import Port, ports_of, require_input, unknown_sensor

__all__ = ["Online"]

Array = NDArray[np.float64]
NS, INFINITE = 1e9, math.inf
REST = math.nan  # s: no step at all
NO_SENSOR = -1
NOTHING, OWN_NOISE = np.zeros(0), np.zeros((0, 0))
contiguous, empty, float64 = np.ascontiguousarray, np.empty, np.float64  # looked up once, not every sample


class Online:
    """One filter on one model, called once a sample.

    The same compiled loops as in `run`, so that samples fed in order give what the whole log gives.  Nothing
    of the estimate is kept here: `predict` and `update` are functions of the belief that they are handed.
    What is kept is scratch memory, so give every thread an Online of its own.

    Parameters
    ----------
    filter : KalmanFilter(), ExtendedKalmanFilter() …; where a filter has no online form it says so
    model : the declaration, as for `run`

    Raises
    ------
    ModelError
        where the filter has no online form, or does not take the model.

    Examples
    --------
    >>> import sequential as sq
    >>> cart = sq.StateSpace(
    ...     sq.Vector(2), sq.Gaussian([0.0, 1.0], [1.0, 1.0]), sq.ConstantVelocity(0.1),
    ...     {"position": sq.LinearSensor([[1.0, 0.0]], 0.25)},
    ... )
    >>> online = sq.Online(sq.KalmanFilter(), cart)
    >>> belief = online.predict(online.start(), dt=0.1)
    >>> belief, innovation = online.update(belief, "position", 0.12)
    >>> belief.t, innovation.accepted
    (100000000, True)
    """

    __slots__ = (
        "_address",
        "_driven",
        "_failures",
        "_filter",
        "_kept",
        "_kernel",
        "_layout",
        "_model",
        "_ports",
        "_size",
    )

    def __init__(self, filter: Any, model: StateSpace) -> None:  # noqa: A002 - the word of the field
        self._filter, self._model = filter, model
        self._kept = handle(filter, model)
        self._kernel, self._address, self._layout = self._kept.step, self._kept.address, self._kept.layout
        self._size, self._failures = self._layout.size, self._kept.whole.failures
        self._ports, self._driven = ports_of(model), model.process_functions.inputs > 0

    @property
    def filter(self) -> Any:
        """The filter whose settings are used."""
        return self._filter

    @property
    def model(self) -> StateSpace:
        """The declaration."""
        return self._model

    def __reduce__(self) -> tuple[Any, ...]:
        # a copy, also in another process, needs records and scratch memory of its own
        return Online, (self._filter, self._model)

    def start(self, t: float | None = None) -> Belief:
        """The prior, at the model's start or else zero, unless a time is given (float s or int ns)."""
        return self.belief(self._model.prior, (self._model.start_ns or 0) if t is None else t)

    def belief(self, gaussian: Gaussian, t: float) -> Belief:
        """A belief of your own, at a time in float seconds or int nanoseconds."""
        layout = self._layout
        if (gaussian.mean.shape, gaussian.cov.shape) != layout.shapes:
            msg = (
                f"a belief about {layout.manifold} has a mean of shape {layout.shapes[0]} and a covariance "
                f"of shape {layout.shapes[1]}, got {gaussian.mean.shape} and {gaussian.cov.shape}"
            )
            raise DataError(msg)
        layout.manifold.check(gaussian.mean)
        return Belief(layout.pack(gaussian.mean, gaussian.cov), int(nanoseconds(t)), layout)

    def predict(self, belief: Belief, dt: float, u: ArrayLike | None = None) -> Belief:
        """The belief `dt` seconds later.

        Parameters
        ----------
        u : (inputs,) what drives the process meanwhile, for a model that has an input

        Raises
        ------
        ShapeError, TimeOrderError, NotFiniteError
        """
        driven = NOTHING if u is None and not self._driven else require_input(self._model, u)
        if not 0.0 <= dt < INFINITE:
            raise backwards(dt)
        layout = self._layout
        numbers = belief._numbers if belief._layout is layout else self._adopted(belief)
        out = empty(self._size)
        code = self._kernel(self._address, dt, NO_SENSOR, numbers, NOTHING, driven, NOTHING, OWN_NOISE, out)
        if code or self._failures:
            raise self._failed(code, None, NOTHING, driven, out)
        return Belief(out, belief._t + round(dt * NS), layout)

    def update(
        self,
        belief: Belief,
        name: str,
        z: ArrayLike,
        context: ArrayLike | None = None,
        noise_cov: ArrayLike | None = None,
    ) -> tuple[Belief, Innovation]:
        """The belief after a reading of one sensor, and how the reading compared with it.

        Parameters
        ----------
        z : (m,) or a number; NaN where a component is missing
        context : (c,) what is known about the reading, such as the landmark that was seen
        noise_cov : (m, m), (m,) variances or a number, where the reading brings its own

        Raises
        ------
        MissingStreamError, ShapeError, DataError, NotFiniteError, NotPositiveDefiniteError
        """
        return self.step(belief, None, name, z, None, context, noise_cov)

    def step(
        self,
        belief: Belief,
        dt: float | None,
        name: str,
        z: ArrayLike,
        u: ArrayLike | None = None,
        context: ArrayLike | None = None,
        noise_cov: ArrayLike | None = None,
    ) -> tuple[Belief, Innovation]:
        """`predict` by `dt` seconds, then `update`: the same result in one call of the kernel.

        Written out in one piece, since a call in Python costs as much as the update of a small filter.
        """
        port = self._ports.get(name)
        if port is None:
            raise unknown_sensor(self._model, name)
        if dt is None:
            dt, moved, driven = REST, 0, NOTHING
        elif 0.0 <= dt < INFINITE:
            moved = round(dt * NS)
            driven = NOTHING if u is None and not self._driven else require_input(self._model, u)
        else:
            raise backwards(dt)
        values = contiguous(z, float64)
        if values.shape != port.shape:
            raise port.refuse(z)
        known = port.known(context) if port.context or context is not None else NOTHING
        noise = OWN_NOISE if noise_cov is None else port.noise(noise_cov)
        layout = self._layout
        numbers = belief._numbers if belief._layout is layout else self._adopted(belief)
        out = empty(self._size)
        code = self._kernel(self._address, dt, port.index, numbers, values, driven, known, noise, out)
        if code or self._failures:
            raise self._failed(code, port, values, driven, out)
        return Belief(out, belief._t + moved, layout), Innovation(out, port.dim, layout)

    def _adopted(self, belief: Belief) -> Array:
        """The numbers of a belief that another filter made, in the layout of this one."""
        theirs, ours = belief._layout, self._layout
        if theirs == ours:
            return belief._numbers
        if theirs.shapes != ours.shapes:
            msg = f"a belief about {theirs.manifold} was handed to a model on {ours.manifold}"
            raise DataError(msg)
        return ours.pack(belief.mean, belief.cov)

    def _failed(self, code: int, port: Port | None, z: Array, u: Array, out: Array) -> FactorlabError:
        """The error for a step that failed; raises what a model function raised."""
        self._kept.whole.raise_failures()
        return failure(code, port, z, u, out[: self._layout.belief], self._layout.form)
