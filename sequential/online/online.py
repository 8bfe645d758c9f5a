"""A filter fed sample by sample, at the cost of a microsecond: beliefs go in and come out."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, TimeOrderError
from sequential.log import NS, nanoseconds
from sequential.model import Gaussian, StateSpace
from sequential.online.belief import Belief, Innovation
from sequential.online.ports import ports_of, require_input, unknown_sensor
from sequential.online.stepper import NOTHING, OWN_NOISE, REST, Stepper

__all__ = ["Online"]

Array = NDArray[np.float64]
INFINITE = math.inf
contiguous, float64 = np.ascontiguousarray, np.float64  # looked up once, not on every sample


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

    __slots__ = ("_driven", "_move", "_ports", "_stepper", "_take", "filter", "model")

    def __init__(self, filter: Any, model: StateSpace) -> None:  # noqa: A002 - the word of the field
        self.filter, self.model = filter, model
        self._stepper = Stepper(filter, model)
        self._move, self._take = self._stepper.move, self._stepper.take
        self._ports, self._driven = ports_of(model), model.process_functions.inputs > 0

    def start(self, t: float | None = None) -> Belief:
        """The prior, at the model's start or else zero, unless a time is given (float s or int ns)."""
        return self.belief(self.model.prior, (self.model.start_ns or 0) if t is None else t)

    def belief(self, gaussian: Gaussian, t: float) -> Belief:
        """A belief of your own, at a time in float seconds or int nanoseconds."""
        layout = self._stepper.layout
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
        given = NOTHING if u is None and not self._driven else require_input(self.model, u)
        if not 0.0 <= dt < INFINITE:
            raise backwards(dt)
        return self._move(belief, round(dt * NS), dt, given)

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
        port = self._ports.get(name)
        if port is None:
            raise unknown_sensor(self.model, name)
        values = contiguous(z, float64)
        if values.shape != port.shape:
            raise port.refuse(z)
        known = port.known(context) if port.context or context is not None else NOTHING
        noise = OWN_NOISE if noise_cov is None else port.noise(noise_cov)
        return self._take(belief, 0, REST, NOTHING, port, values, known, noise)

    def step(
        self,
        belief: Belief,
        dt: float,
        name: str,
        z: ArrayLike,
        u: ArrayLike | None = None,
        context: ArrayLike | None = None,
        noise_cov: ArrayLike | None = None,
    ) -> tuple[Belief, Innovation]:
        """`predict` by `dt` seconds, then `update`: the same result in one call of the kernel."""
        port = self._ports.get(name)
        if port is None:
            raise unknown_sensor(self.model, name)
        given = NOTHING if u is None and not self._driven else require_input(self.model, u)
        if not 0.0 <= dt < INFINITE:
            raise backwards(dt)
        values = contiguous(z, float64)
        if values.shape != port.shape:
            raise port.refuse(z)
        known = port.known(context) if port.context or context is not None else NOTHING
        noise = OWN_NOISE if noise_cov is None else port.noise(noise_cov)
        return self._take(belief, round(dt * NS), dt, given, port, values, known, noise)


def backwards(dt: float) -> TimeOrderError:
    """The error for a step into the past, or to nowhere."""
    return TimeOrderError(
        f"a step lasts zero or more seconds, got dt = {dt}; late readings are for stream(max_delay=…)"
    )
