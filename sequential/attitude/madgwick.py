"""Madgwick's filter: one step down the gradient for every sample."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.attitude.estimator import AttitudeFilter, own_state, require_settings, sample
from sequential.attitude.history import AttitudeHistory, read_only
from sequential.errors import ModelError
from sequential.sensors.recording import ImuRecording

__all__ = ["Madgwick"]

Array = NDArray[np.float64]


@final
@dataclass(frozen=True)
class Madgwick(AttitudeFilter):
    """Gyro integration, corrected at a constant rate β down the gradient of the other sensors' errors.

        q ← q + (½ q ⊗ ω - β ∇f/|∇f|) dt,  normalised

    Parameters
    ----------
    magnetometer : use it (9-D) or not (6-D); None where the recording has one
    gain : β, rad/s, about √¾ of the error of the gyro (equation 50)
    start_gain, start_time : β begins at the first and reaches `gain` after the second, s
    settle : let no step go beyond the minimum; as published, the attitude at rest trembles by β dt
    order : 1 integrates as published, |ω dt|³/12 a step short; 3 costs two products more

    Raises
    ------
    ModelError
        where a setting is out of its range.

    Notes
    -----
    Madgwick 2010, An efficient orientation filter for inertial and inertial/magnetic sensor arrays.  The
    reference of the field is recomputed at every sample (equations 45 and 46).  A sample without field is
    one of the filter without magnetometer.  State (6,) of `step`: quaternion, time, whether the heading is
    known.  As published: `Madgwick.as_published(β)`.
    """

    gain: float = 0.08
    start_gain: float = 2.0
    start_time: float = 3.0
    settle: bool = True
    order: Literal[1, 3] = 3

    def __post_init__(self) -> None:
        require_settings(
            "Madgwick",
            {"start_gain": self.start_gain},
            zero={"gain": self.gain, "start_time": self.start_time},
        )
        if self.order not in {1, 3}:
            raise ModelError(f"Madgwick integrates with order 1 or 3, got {self.order}")

    @classmethod
    def as_published(cls, gain: float = 0.1, *, magnetometer: bool | None = None) -> Madgwick:
        """The filter of the report in its usual code: β from the first sample on, one step of Euler."""
        return cls(magnetometer, gain, start_time=0.0, settle=False, order=1)

    @property
    def name(self) -> str:
        """madgwick."""
        return "madgwick"

    @property
    def settings(self) -> Array:
        """(5,) for the compiled step."""
        third = 1.0 / 12.0 if self.order == 3 else 0.0
        # the curvature of both errors together is at most 8
        largest = 1.0 / 8.0 if self.settle else np.inf
        return np.array([self.gain, self.start_gain, self.start_time, third, largest])

    def start(self, gyro: ArrayLike, accel: ArrayLike) -> Array:
        """State (6,) from a first sample: level by the accelerometer, yaw 0."""
        from sequential.attitude.madgwick_kernel import STATE, start_madgwick

        state = np.zeros(STATE)
        start_madgwick(state, sample(gyro, accel, None)[1])
        return state

    def step(
        self, state: ArrayLike, gyro: ArrayLike, accel: ArrayLike, mag: ArrayLike | None, dt: float
    ) -> Array:
        """Next state (6,), dt seconds after the last sample."""
        from sequential.attitude.madgwick_kernel import STATE, step_madgwick

        own = own_state(state, STATE, "Madgwick")
        step_madgwick(own, *sample(gyro, accel, mag), dt, self.settings)
        return own

    def estimate(self, recording: ImuRecording) -> AttitudeHistory:
        """Orientation at every sample of a recording."""
        from sequential.attitude.madgwick_kernel import STATE, run_madgwick

        gyro, accel, mag = self.samples(recording)
        quaternions = np.empty((len(recording), 4))
        run_madgwick(recording.t, gyro, accel, mag, self.settings, np.zeros(STATE), quaternions)
        read_only(quaternions)
        return AttitudeHistory(recording.t, quaternions, name=self.name)
