"""What every recursive attitude filter does at its door, and how many recordings go through one at once."""

from __future__ import annotations

import abc
import math
import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.attitude.history import AttitudeHistory
from sequential.errors import MissingStreamError, ModelError, ShapeError
from sequential.sensors.recording import ImuRecording

__all__ = ["AttitudeFilter", "in_threads", "require_settings"]

Array = NDArray[np.float64]
NO_FIELD = np.full((1, 3), np.nan)
NO_FIELD.flags.writeable = False


@dataclass(frozen=True)
class AttitudeFilter(abc.ABC):
    """A recursive attitude filter: settings, a start, a step, and whole recordings.

    A sample is (gyro, accel, mag) with the time since the sample before; the gyro's reading holds for that
    time.  What every filter does with bad samples: one whose gyro is not finite changes nothing; a specific
    force or a field that is zero or not finite does not correct; over more than a second nothing is
    integrated.

    Parameters
    ----------
    magnetometer : use it (9-D) or not (6-D); None where the recording has one
    """

    magnetometer: bool | None = None

    @property
    @abc.abstractmethod
    def name(self) -> str:
        """Of the filter, as reports and the command line write it."""

    @property
    @abc.abstractmethod
    def settings(self) -> Array:
        """What the compiled step takes, in its order."""

    @abc.abstractmethod
    def estimate(self, recording: ImuRecording) -> AttitudeHistory:
        """Orientation at every sample of a recording.

        Raises
        ------
        MissingStreamError, DataError
            where there is no gyro, no accelerometer, or no magnetometer although one is asked for.
        """

    @abc.abstractmethod
    def start(self, gyro: ArrayLike, accel: ArrayLike) -> Array:
        """State (n,) from a first sample (3,) each; `step` takes the same sample with dt = 0."""

    @abc.abstractmethod
    def step(
        self, state: ArrayLike, gyro: ArrayLike, accel: ArrayLike, mag: ArrayLike | None, dt: float
    ) -> Array:
        """Next state (n,), dt seconds after the last sample; numbers 0-3 are the quaternion.

        The layout is that of the compiled module's first lines; `estimate` makes the same steps, bit for bit.
        """

    def estimate_many(
        self, recordings: Iterable[ImuRecording], threads: int | None = None
    ) -> list[AttitudeHistory]:
        """Every recording by `estimate`, in threads: as many as there are processors unless given."""
        return in_threads(self.estimate, recordings, threads)

    def samples(self, recording: ImuRecording) -> tuple[Array, Array, Array]:
        """Gyro, accelerometer and magnetometer of a recording, in SI; one row of NaN without the last."""
        recording.require("gyro", "accel")
        gyro, accel, mag = recording.gyro, recording.accel, recording.mag
        if self.magnetometer or (self.magnetometer is None and mag is not None):
            recording.require("mag", si=False)
        else:
            mag = None
        if gyro is None or accel is None:  # for the type checker: `require` has raised
            raise MissingStreamError("an attitude filter needs gyro and accelerometer")
        return gyro, accel, NO_FIELD if mag is None else mag


def in_threads(
    estimate: Callable[[ImuRecording], AttitudeHistory],
    recordings: Iterable[ImuRecording],
    threads: int | None = None,
) -> list[AttitudeHistory]:
    """Run an estimator that lets go of the interpreter on many recordings; results in their order."""
    workers = (os.cpu_count() or 1) if threads is None else threads
    if workers < 1:
        raise ModelError(f"threads is a number of at least 1, got {threads}")
    given = list(recordings)
    if workers == 1 or len(given) < 2:
        return [estimate(one) for one in given]
    with ThreadPoolExecutor(min(workers, len(given))) as pool:
        return list(pool.map(estimate, given))


def vector(values: ArrayLike, what: str) -> Array:
    """(3,) of one sample."""
    own = np.array(values, dtype=np.float64)
    if own.shape != (3,):
        raise ShapeError(f"{what} of one sample is (3,), got {own.shape}")
    return own


def sample(gyro: ArrayLike, accel: ArrayLike, mag: ArrayLike | None) -> tuple[Array, Array, Array]:
    """One sample as arrays; NaN where there is no field."""
    field = np.full(3, np.nan) if mag is None else vector(mag, "mag")
    return vector(gyro, "gyro"), vector(accel, "accel"), field


def own_state(state: ArrayLike, size: int, who: str) -> Array:
    """A copy of a state that may be written to."""
    own = np.array(state, dtype=np.float64)
    if own.shape != (size,):
        raise ShapeError(f"a state of {who} has shape ({size},), got {own.shape}; begin with start(…)")
    return own


def require_settings(who: str, positive: dict[str, float], *, zero: dict[str, float] | None = None) -> None:
    """Raise `ModelError` where a setting is not positive, or, of `zero`, is negative; infinity is allowed."""
    for name, value in positive.items():
        if not value > 0:
            raise ModelError(f"{who}'s {name} is a positive number, got {value}")
    for name, value in (zero or {}).items():
        if not (value >= 0 and math.isfinite(value)):
            raise ModelError(f"{who}'s {name} is a finite number, at least 0; got {value}")
