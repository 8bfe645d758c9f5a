"""The tilt Kalman filter: roll, pitch and yaw, each an angle with the bias of its rate."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.attitude.angles import tilt
from sequential.attitude.estimator import AttitudeFilter, own_state, require_settings, sample
from sequential.attitude.history import AttitudeHistory, read_only
from sequential.errors import DataError, ModelError
from sequential.log import SensorLog, Stream
from sequential.sensors.recording import ImuRecording

if TYPE_CHECKING:
    from sequential.model import StateSpace

__all__ = ["TiltKalman"]

Array = NDArray[np.float64]
CHANNELS = ("roll", "pitch")
UNKNOWN = math.pi  # rad, standard deviation of an angle that nothing is known about


@final
@dataclass(frozen=True)
class TiltKalman(AttitudeFilter):
    """The course's Kalman filter of an angle and a gyro bias, for roll, pitch and (with a field) yaw.

    Each channel predicts with the rate u of its angle and corrects with the angle that gravity, or the field
    levelled by roll and pitch, gives::

        θ ← θ + (u - b) dt         z = θ + noise,   R = tilt_sigma²

    Parameters
    ----------
    magnetometer : use it for yaw or not; None where the recording has one
    gyro_density : white noise of the rates, rad/s/√Hz; with `bias_walk`, the Q
    bias_walk : random walk of the biases, rad/s²/√Hz
    tilt_sigma : of roll and pitch by the accelerometer, rad: its σ over g at rest, more in motion
    heading_sigma : of yaw by the magnetometer, rad
    gate : probability with which a good angle is used, such as 0.999; further off ones are refused
    bias_sigma : of the biases before the first sample, rad/s

    Raises
    ------
    ModelError
        where a setting is out of its range.

    Notes
    -----
    u is the gyro turned into rates of the angles at the filter's own angles, so the biases are those of
    these rates, which are the gyro's while roll and pitch are small.  At a pitch of 90° roll and yaw lose
    their meaning (the cosine is kept above 0.05); over the top the angles fold back.  `channel` gives the
    same filter as a model of this library.  State (19,) of `step`: angles, biases, variances of the angles,
    covariances of both, variances of the biases, whether the heading is known, the last rates u.
    """

    gyro_density: float = 2e-3
    bias_walk: float = 1e-4
    tilt_sigma: float = 0.1
    heading_sigma: float = 0.3
    gate: float | None = None
    bias_sigma: float = 0.05

    def __post_init__(self) -> None:
        names = ("gyro_density", "tilt_sigma", "heading_sigma", "bias_sigma")
        require_settings(
            "TiltKalman", {n: getattr(self, n) for n in names}, zero={"bias_walk": self.bias_walk}
        )
        if self.gate is not None and not 0 < self.gate < 1:
            raise ModelError(f"TiltKalman's gate is a probability in ]0, 1[ or None, got {self.gate}")

    @property
    def name(self) -> str:
        """kalman."""
        return "kalman"

    @property
    def settings(self) -> Array:
        """(7,) for the compiled step."""
        from sequential.evaluate.consistency import chi2_quantile

        gate = math.inf if self.gate is None else chi2_quantile(self.gate, 1)
        values = (self.gyro_density, self.bias_walk, self.tilt_sigma, self.heading_sigma)
        return np.array([*(v * v for v in values), gate, UNKNOWN**2, self.bias_sigma**2])

    def start(self, gyro: ArrayLike, accel: ArrayLike) -> Array:
        """State (19,) from a first sample: the angles of the accelerometer, yaw 0."""
        from sequential.attitude.tilt_kernel import STATE, start_tilt

        state = np.zeros(STATE)
        start_tilt(state, sample(gyro, accel, None)[1], self.settings)
        return state

    def step(
        self, state: ArrayLike, gyro: ArrayLike, accel: ArrayLike, mag: ArrayLike | None, dt: float
    ) -> Array:
        """Next state (19,), dt seconds after the last sample; it begins with angles, not a quaternion."""
        from sequential.attitude.tilt_kernel import STATE, step_tilt

        own = own_state(state, STATE, "TiltKalman")
        step_tilt(own, *sample(gyro, accel, mag), dt, self.settings)
        return own

    def path(self, recording: ImuRecording) -> Array:
        """(N, 19) the state after every sample."""
        from sequential.attitude.tilt_kernel import STATE, run_tilt

        gyro, accel, mag = self.samples(recording)
        states = np.empty((len(recording), STATE))
        run_tilt(recording.t, gyro, accel, mag, self.settings, np.zeros(STATE), states)
        return states

    def estimate(self, recording: ImuRecording) -> AttitudeHistory:
        """Orientation with covariance and biases at every sample of a recording."""
        from sequential.attitude.tilt_kernel import in_body

        states = self.path(recording)
        count = len(states)
        quaternions, bias = np.empty((count, 4)), np.empty((count, 3))
        cov, bias_cov = np.empty((count, 3, 3)), np.empty((count, 3, 3))
        in_body(states, np.empty(5), quaternions, cov, bias, bias_cov)
        read_only(quaternions, cov, bias, bias_cov)
        return AttitudeHistory(
            recording.t,
            quaternions,
            cov=cov,
            gyro_bias=bias,
            gyro_bias_cov=bias_cov,
            name=self.name,
        )

    def model(self, channel: Literal["roll", "pitch"], at: float = 0.0) -> StateSpace:
        """One channel as a model: state (angle, bias), streams `rate` and the channel's name.

        Parameters
        ----------
        at : the first angle, rad
        """
        from sequential.manifold import Vector
        from sequential.model import Gaussian, StateSpace
        from sequential.models import ContinuousProcess, LinearSensor

        self._require(channel)
        density = [self.gyro_density**2, self.bias_walk**2]
        return StateSpace(
            Vector(2),
            Gaussian(np.array([at, 0.0]), np.array([self.tilt_sigma**2, self.bias_sigma**2])),
            ContinuousProcess([[0.0, -1.0], [0.0, 0.0]], np.eye(2), density, B=[[1.0], [0.0]]),
            {channel: LinearSensor([[1.0, 0.0]], self.tilt_sigma**2, gate=self.gate)},
            input="rate",
        )

    def channel(
        self, recording: ImuRecording, channel: Literal["roll", "pitch"]
    ) -> tuple[StateSpace, SensorLog]:
        """The model of one channel with the log it runs on: `run(KalmanFilter(), *…)` is this filter.

        The rates are those that this filter's own path drives the channel with, the angles those of the
        accelerometer without jumps; so the log stays the same while Q and R are tuned on it.

        Raises
        ------
        DataError
            where the pitch goes over 90°, so that the angles fold.
        """
        self._require(channel)
        column = CHANNELS.index(channel)
        states = self.path(recording)
        if np.abs(states[:, 1]).max() > math.radians(89.0):
            raise DataError(
                f"the pitch of {recording.name!r} goes over 90°, where roll and pitch fold; take a part of it"
            )
        accel = self.samples(recording)[1]
        angle = np.unwrap(tilt(accel)[:, column])
        t = recording.t
        # a rate holds from the sample before to its own
        streams = {"rate": Stream(t[:-1], states[1:, 16 + column]), channel: Stream(t[1:], angle[1:])}
        from dataclasses import replace

        model = replace(self.model(channel, float(angle[0])), start=int(t[0]))
        return model, SensorLog(streams, recording.name)

    def _require(self, channel: str) -> None:
        if channel not in CHANNELS:
            raise ModelError(f"a channel is 'roll' or 'pitch', got {channel!r}")
