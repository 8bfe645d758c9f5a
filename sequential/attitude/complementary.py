"""The complementary filter on rotations: the short term of the gyro, the long term of gravity and north."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.attitude.estimator import AttitudeFilter, own_state, require_settings, sample
from sequential.attitude.history import AttitudeHistory, read_only
from sequential.sensors.recording import ImuRecording

__all__ = ["ComplementaryAttitude"]

Array = NDArray[np.float64]


@final
@dataclass(frozen=True)
class ComplementaryAttitude(AttitudeFilter):
    """The textbook's angle = (1 - a)(angle + ω dt) + a · accelerometer, without its singular angles.

    The attitude turns with the gyro, then a share a = 1 - exp(-dt/τ) of the angle between its vertical and
    the measured one is closed about the axis across both; likewise for the heading.  About a single axis
    that is the recursion above.

    Parameters
    ----------
    magnetometer : use it (9-D) or not (6-D); None where the recording has one
    time_constant : τ of roll and pitch, s
    heading_time_constant : τ of the heading, s

    Raises
    ------
    ModelError
        where a setting is not positive.

    Notes
    -----
    A constant gyro bias b stays in the angles as b·τ.  State (6,) of `step`: quaternion, time since the last
    field, whether the heading is known.
    """

    time_constant: float = 5.0
    heading_time_constant: float = 10.0

    def __post_init__(self) -> None:
        require_settings(
            "ComplementaryAttitude",
            {"time_constant": self.time_constant, "heading_time_constant": self.heading_time_constant},
        )

    @property
    def name(self) -> str:
        """complementary."""
        return "complementary"

    @property
    def settings(self) -> Array:
        """(2,) for the compiled step."""
        return np.array([self.time_constant, self.heading_time_constant], dtype=np.float64)

    def start(self, gyro: ArrayLike, accel: ArrayLike) -> Array:
        """State (6,) from a first sample: level by the accelerometer, yaw 0."""
        from sequential.attitude.complementary_kernel import STATE, start_complementary

        state = np.zeros(STATE)
        start_complementary(state, sample(gyro, accel, None)[1])
        return state

    def step(
        self, state: ArrayLike, gyro: ArrayLike, accel: ArrayLike, mag: ArrayLike | None, dt: float
    ) -> Array:
        """Next state (6,), dt seconds after the last sample."""
        from sequential.attitude.complementary_kernel import STATE, step_complementary

        own = own_state(state, STATE, "ComplementaryAttitude")
        step_complementary(own, *sample(gyro, accel, mag), dt, self.settings)
        return own

    def estimate(self, recording: ImuRecording) -> AttitudeHistory:
        """Orientation at every sample of a recording."""
        from sequential.attitude.complementary_kernel import STATE, run_complementary

        gyro, accel, mag = self.samples(recording)
        quaternions = np.empty((len(recording), 4))
        run_complementary(recording.t, gyro, accel, mag, self.settings, np.zeros(STATE), quaternions)
        read_only(quaternions)
        return AttitudeHistory(recording.t, quaternions, name=self.name)
