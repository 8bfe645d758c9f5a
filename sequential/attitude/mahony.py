"""Mahony's filter: a proportional-integral observer on rotations."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.attitude.estimator import AttitudeFilter, own_state, require_settings, sample
from sequential.attitude.history import AttitudeHistory, read_only
from sequential.errors import ModelError
from sequential.sensors.recording import ImuRecording

__all__ = ["Mahony"]

Array = NDArray[np.float64]


@final
@dataclass(frozen=True)
class Mahony(AttitudeFilter):
    """The explicit complementary filter, with what a real board needs: limits, rejection, bias at rest.

    With v the vertical and n the reference of the field in the body frame, both by the estimate::

        e = a/|a| × v  (+ m/|m| × n)         b ← b - k_I e dt         q ← q ⊗ exp((ω - b + k_P e) dt)

    Parameters
    ----------
    magnetometer : use it (9-D) or not (6-D); None where the recording has one
    gain : k_P of the accelerometer, 1/s; the tilt forgets with a time constant of 1/k_P
    heading_gain : k_P of the magnetometer, 1/s
    integral_gain : k_I, 1/s²; 0 leaves the bias to the rest detection
    bias_limit : the bias stays within ± this on every axis, rad/s
    error_limit : e of the accelerometer is shortened to this (the sine of an angle), so that accelerations,
        which are large and short, count no more than a small tilt; infinity is the published filter
    lasting_time : the limit grows by the length of the error's mean over this, s, in the world's axes: what a
        bias does to the tilt lasts there, and is not to be held off
    heading_gate : a heading further off than this, rad, is held to be a magnetic disturbance …
    heading_timeout : … until it has been for so long, s
    start_gain, start_time : k_P begins at the first and reaches `gain` after the second, s; meanwhile neither
        the bias nor the limit of the error is at work
    rest_gyro, rest_accel : at rest, no axis departs further from its mean over half a second, rad/s and m/s²
    rest_time : for this long, s; then the bias is drawn to the mean of the gyro.  Infinity: never
    rest_constant : with this time constant, s
    tilt_by_field : let the magnetometer correct roll and pitch too, as published
    order : 1 integrates as published, |ω dt|³/12 a step short; 3 costs two products more

    Raises
    ------
    ModelError
        where a setting is out of its range.

    Notes
    -----
    Mahony, Hamel, Pflimlin 2008, Nonlinear complementary filters on the special orthogonal group, equations
    32 and 48.  As published: `Mahony.as_published(gain, integral_gain)`.  State (20,) of `step`: quaternion,
    bias (3), time, time since the last field, time out of the gate, low-passed gyro (3) and accelerometer
    (3), time at rest, whether the heading is known, lasting error (2).
    """

    gain: float = 0.5
    heading_gain: float = 0.05
    integral_gain: float = 0.0005
    bias_limit: float = 0.1
    error_limit: float = 0.05
    lasting_time: float = 20.0
    heading_gate: float = math.radians(20.0)
    heading_timeout: float = 20.0
    start_gain: float = 10.0
    start_time: float = 3.0
    rest_gyro: float = 0.035
    rest_accel: float = 0.5
    rest_time: float = 1.5
    rest_constant: float = 1.0
    tilt_by_field: bool = False
    order: Literal[1, 3] = 3

    def __post_init__(self) -> None:
        require_settings(
            "Mahony",
            {
                name: getattr(self, name)
                for name in (
                    "gain", "bias_limit", "error_limit", "lasting_time", "heading_gate", "heading_timeout",
                    "start_gain",
                    "rest_gyro", "rest_accel", "rest_time", "rest_constant",
                )
            },
            zero={n: getattr(self, n) for n in ("heading_gain", "integral_gain", "start_time")},
        )  # fmt: skip
        if self.order not in {1, 3}:
            raise ModelError(f"Mahony integrates with order 1 or 3, got {self.order}")

    @classmethod
    def as_published(
        cls, gain: float = 1.0, integral_gain: float = 0.0, *, magnetometer: bool | None = None
    ) -> Mahony:
        """The filter of the paper in its usual code: two gains, one step of Euler, nothing rejected."""
        return cls(
            magnetometer=magnetometer,
            gain=gain,
            heading_gain=gain,
            integral_gain=integral_gain,
            bias_limit=math.inf,
            error_limit=math.inf,
            heading_gate=math.inf,
            start_time=0.0,
            rest_time=math.inf,
            tilt_by_field=True,
            order=1,
        )

    @property
    def name(self) -> str:
        """mahony."""
        return "mahony"

    @property
    def settings(self) -> Array:
        """(16,) for the compiled step."""
        gate = math.cos(self.heading_gate) if self.heading_gate < math.pi else -2.0
        values = (
            self.gain, self.heading_gain, self.integral_gain, self.bias_limit, self.start_gain,
            self.start_time, 1.0 / 12.0 if self.order == 3 else 0.0, 0.0 if self.tilt_by_field else 1.0,
            self.error_limit, gate, self.heading_timeout, self.rest_gyro, self.rest_accel, self.rest_time,
            self.rest_constant, self.lasting_time,
        )  # fmt: skip
        return np.array(values)

    def start(self, gyro: ArrayLike, accel: ArrayLike) -> Array:
        """State (20,) from a first sample: level by the accelerometer, yaw 0, no bias."""
        from sequential.attitude.mahony_kernel import STATE, start_mahony

        state = np.zeros(STATE)
        start_mahony(state, *sample(gyro, accel, None)[:2])
        return state

    def step(
        self, state: ArrayLike, gyro: ArrayLike, accel: ArrayLike, mag: ArrayLike | None, dt: float
    ) -> Array:
        """Next state (20,), dt seconds after the last sample."""
        from sequential.attitude.mahony_kernel import STATE, step_mahony

        own = own_state(state, STATE, "Mahony")
        step_mahony(own, *sample(gyro, accel, mag), dt, self.settings)
        return own

    def estimate(self, recording: ImuRecording) -> AttitudeHistory:
        """Orientation, gyro bias, rest and magnetic disturbance at every sample of a recording."""
        from sequential.attitude.mahony_kernel import STATE, run_mahony

        gyro, accel, mag = self.samples(recording)
        count = len(recording)
        quaternions, bias, seen = np.empty((count, 4)), np.empty((count, 3)), np.empty((count, 2))
        run_mahony(recording.t, gyro, accel, mag, self.settings, np.zeros(STATE), quaternions, bias, seen)
        read_only(quaternions, bias)
        return AttitudeHistory(
            recording.t,
            quaternions,
            gyro_bias=bias,
            rest=seen[:, 0] > self.rest_time,
            magnetic_disturbance=seen[:, 1] > 0.0 if len(mag) == count else None,
            name=self.name,
        )
