"""What the attitude smoothers believe about sensors and motion: one declaration for chain and graph."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError

__all__ = ["AttitudeModel"]

Array = NDArray[np.float64]
EAST = 9  # of the state that `smoother_steps_kernel` describes
ZERO_ALLOWED = frozenset({"latency", "latency_sigma", "gyro_matrix_sigma", "accel_bias_sigma", "delay_sigma",
                          "heading_sigma", "gyro_scale_noise"})  # fmt: skip


@dataclass(frozen=True, slots=True)
class AttitudeModel:
    """Noises in data-sheet densities, spreads of what is constant, and how long a body can keep accelerating.

    Parameters
    ----------
    interval : of a node, s; inside it the gyro is integrated and nothing is estimated
    gyro_noise : rad/s/√Hz
    gyro_scale_noise : √s; with |ω| rad/s it adds |ω| times this to the gyro's noise density: what gain,
        misalignment and timing leave, taken for white
    gyro_bias_walk : rad/s/√s
    gyro_bias_sigma : of the first bias, rad/s
    gyro_matrix_sigma : of each entry of the constant gain and misalignment of the gyro; 0 leaves it out
    accel_noise : m/s²/√Hz
    accel_bias_sigma : of the constant bias, m/s²; 0 leaves it out
    speed_spread : m/√s: the velocity is white about zero with this density.  Over a time T the mean
        velocity is 0 ± this/√T, so accelerations that go on for long count as tilt
    rest_gyro_noise : of the gyro as a reading of its bias, where the body rests, rad/s/√Hz
    rest_turn : rotation of a body at rest, rad/√s
    rest_speed : m/√s, as `speed_spread`
    mag_noise : √s, share of the field's norm; white
    disturbance_sigma, disturbance_time : share of the norm, s: a disturbance towards east that comes and goes
    delay_sigma : of the constant delay of the magnetometer behind the gyro, s; 0 leaves it out
    mag_scatter : share of the norm; a field that is off by this much in any direction counts a quarter
    mag_gate : sigmas beyond which the first pass trusts a heading less
    heading_sigma : of what no rotation tells about magnetic north, rad; added to the covariance alone
    latency : how far the inertial stamps are late, s, as low-pass filters in the sensor make them; the
        attitude is reported ahead by it
    latency_sigma : s, in the covariance
    gravity : m/s²
    """

    interval: float = 0.2
    gyro_noise: float = math.radians(0.02)
    gyro_scale_noise: float = 0.001
    gyro_bias_walk: float = math.radians(0.01)
    gyro_bias_sigma: float = math.radians(2.0)
    gyro_matrix_sigma: float = 0.003
    accel_noise: float = 0.01
    accel_bias_sigma: float = 0.013
    speed_spread: float = 3.0
    rest_gyro_noise: float = math.radians(0.01)
    rest_turn: float = math.radians(0.005)
    rest_speed: float = 0.005
    mag_noise: float = 0.03
    disturbance_sigma: float = 0.016
    disturbance_time: float = 5.0
    delay_sigma: float = 0.02
    mag_scatter: float = 0.18
    mag_gate: float = 3.0
    heading_sigma: float = math.radians(2.0)
    latency: float = 0.002
    latency_sigma: float = 0.001
    gravity: float = 9.80665

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and (value > 0 or (value == 0 and field.name in ZERO_ALLOWED))):
                rule = "zero or positive" if field.name in ZERO_ALLOWED else "positive"
                raise ModelError(f"AttitudeModel.{field.name} must be {rule}, got {value!r}")

    def settings(self) -> Array:
        """(15,) in the order of `smoother_steps_kernel`."""
        return np.array([
            self.gyro_noise, self.gyro_scale_noise, self.gyro_bias_walk, self.accel_noise, self.speed_spread,
            self.rest_gyro_noise, self.rest_speed, self.mag_noise, self.disturbance_sigma,
            self.disturbance_time, self.gravity, self.mag_gate, 1.0, 1.0, self.rest_turn,
        ])  # fmt: skip

    def prior(self, *, heading: bool) -> Array:
        """(23, 23) covariance of the first state; without a magnetometer its heading is a choice."""
        sigma = np.zeros(23)
        sigma[0:3] = 0.5, 0.5, 1.0 if heading else 1e-4
        sigma[3:6], sigma[6:9] = self.gyro_bias_sigma, 1.0
        sigma[9] = self.disturbance_sigma if heading else 0.0
        sigma[10] = self.delay_sigma if heading else 0.0
        sigma[11:14], sigma[14:23] = self.accel_bias_sigma, self.gyro_matrix_sigma
        return np.diag(sigma**2)
