"""The filters of the firmware as estimators: what the board computes, from the same C sources."""

from __future__ import annotations

import abc
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.attitude.estimator import NO_FIELD, AttitudeFilter, own_state, sample
from sequential.attitude.history import AttitudeHistory
from sequential.errors import ModelError
from sequential.firmware import calls
from sequential.sensors.recording import ImuRecording

__all__ = ["FirmwareFilter", "FixedPointFilter"]

Array = NDArray[np.float64]
RATES = 72, 1000  # Hz, that the fixed-point filters can count
BOARD = 100.0  # Hz, of the boards


@dataclass(frozen=True)
class FirmwareFilter(AttitudeFilter):
    """A filter of firmware/core, with the settings of the Python filter that it is the port of.

    `design` holds the settings: tune the Python filter, then hand it over, as in
    `CMahony(design=Mahony(gain=0.8))`.

    Parameters
    ----------
    magnetometer : use it (9-D) or not (6-D); None where `design` says nothing and the recording has one

    Raises
    ------
    ToolMissingError
        by every call, where the C core is not compiled and cannot be; the message says what to install.
    """

    ENTRY: ClassVar[str] = ""
    FIELDS: ClassVar[tuple[str, ...]] = ()
    KNOWS: ClassVar[tuple[str, ...]] = ("world_q_body",)  # fields of an attitude history
    SHARES_STATE: ClassVar[bool] = False  # whether `step` takes a state of the Python filter

    def __post_init__(self) -> None:
        if self.magnetometer is None:
            object.__setattr__(self, "magnetometer", self.reference.magnetometer)

    @property
    @abc.abstractmethod
    def reference(self) -> AttitudeFilter:
        """The Python filter that this one is a port of, with the same settings."""

    @property
    def name(self) -> str:
        """That of the Python filter after c-."""
        return f"c-{self.reference.name}"

    @property
    def settings(self) -> Array:
        """What the binding takes, in the order of FIELDS."""
        return np.array([float(getattr(self.reference, name)) for name in self.FIELDS])

    def start(self, gyro: ArrayLike, accel: ArrayLike) -> Array:
        """State from a first sample; its layout is the class's, and begins with the attitude."""
        first = np.hstack(sample(gyro, accel, None))
        return calls.start(self.ENTRY, self.settings, first, self._rate(None))

    def step(
        self, state: ArrayLike, gyro: ArrayLike, accel: ArrayLike, mag: ArrayLike | None, dt: float
    ) -> Array:
        """Next state, dt seconds after the last sample."""
        own = own_state(state, calls.state_size(self.ENTRY), type(self).__name__)
        next_one = np.hstack(sample(gyro, accel, mag))
        calls.step(self.ENTRY, self.settings, own, next_one, dt, self._rate(None))
        return own

    def estimate(self, recording: ImuRecording) -> AttitudeHistory:
        """Orientation at every sample of a recording, and what else the filter knows."""
        gyro, accel, mag = self.samples(recording)
        field = None if mag is NO_FIELD else mag
        known = [name for name in self.KNOWS if field is not None or name != "magnetic_disturbance"]
        rate = self._rate(recording)
        found = calls.run(self.ENTRY, known, self.settings, recording.t, gyro, accel, field, rate)
        return AttitudeHistory(recording.t, **found, name=self.name)

    def _rate(self, recording: ImuRecording | None) -> float:
        """Nominal rate, Hz; only fixed point counts in it."""
        return 0.0


@dataclass(frozen=True)
class FixedPointFilter(FirmwareFilter):
    """A filter of firmware/core in fixed point, whose time is counted in periods.

    Readings are quantised as on a board: gyro in Q24 rad/s, accelerometer and magnetometer in Q8 m/s² and µT
    (saturating at 128).

    Parameters
    ----------
    rate : nominal samples a second; None for those of the recording, or, sample by sample, 100
    """

    rate: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rate is not None and not RATES[0] <= self.rate <= RATES[1]:
            raise ModelError(f"rate is {RATES[0]} to {RATES[1]} samples a second, got {self.rate}")

    @property
    def name(self) -> str:
        """That of the Python filter between c- and -q."""
        return f"c-{self.reference.name}-q"

    def _rate(self, recording: ImuRecording | None) -> float:
        """A whole number, so that the periods of slow recordings are counted several at a time."""
        rate = self.rate or (BOARD if recording is None or len(recording) < 2 else recording.rate)
        while rate < RATES[0]:
            rate *= 2.0
        return float(round(min(rate, RATES[1])))
