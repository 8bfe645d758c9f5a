"""The error-state attitude filter on SO(3): inclination, heading, gyro bias, and how well each is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.attitude.error_state_layout import STATE
from sequential.attitude.estimator import AttitudeFilter, own_state, require_settings, sample
from sequential.attitude.history import AttitudeHistory
from sequential.errors import ModelError
from sequential.sensors.recording import ImuRecording

__all__ = ["ErrorStateAttitude"]

Array = NDArray[np.float64]
DEGREE = float(np.pi / 180.0)
WIDTHS = {"world_q_body": 4, "heading_free": 4, "cov": 9, "cov_6d": 9, "gyro_bias": 3, "gyro_bias_cov": 9}
GYRO_ERROR_TIME = 0.5  # s over which an error that grows with the rate keeps its sign
MAY_BE_ZERO = {
    "bias_walk",
    "iron_walk",
    "iron_doubt",
    "reference_walk",
    "iron_sigma",
    "delay",
    "delay_sigma",
    "field_doubt",
    "bias_memory",
    "latency",
    "latency_sigma",
    "tilt_floor",
    "heading_floor",
    "tilt_scale",
    "heading_scale",
}


@final
@dataclass(frozen=True)
class ErrorStateAttitude(AttitudeFilter):
    """Kalman filter on the error of the attitude: with and without magnetometer at once, with covariances.

    The gyro is integrated at every sample.  Once a `block` two filters correct it:

    * inclination, gyro bias, horizontal velocity and position, (θ, b, v, p): the specific force, turned
      into the frame of the gyro, moves v and p; what it leaves over, a + 2 α v + α² p, is white noise.  That
      is a linear acceleration that averages to zero because velocity and position stay bounded.  The level
      of the noise follows the data.  At rest the gyro reads its bias.
    * heading δ, reference field, residual hard iron and the delay of the magnetometer: the field of a
      block against its reference, trusted the less the farther it is from it.  It changes neither
      inclination nor bias, so that `heading_free` is the answer of a filter without magnetometer.

    Every setting is a time, an angle or a noise: none depends on the rate of the samples.  Stamps may be
    irregular; over a gap the covariance grows.  A field that repeats the reading before, bit for bit, is no
    news, so that a stuck magnetometer is the same as none.

    Parameters
    ----------
    magnetometer : use it (9-D) or not (6-D); None where the recording has one
    block : s between corrections; shorter costs time, longer lags behind quick turns
    gyro_noise : rad/s/√Hz, white
    tilt_scale, heading_scale : share of the rate by which the gyro may be wrong (scale, misalignment), as it
        acts on inclination and on heading; large: quicker corrections by the other sensors, noisier
    bias_walk : rad/s/√s; large: the bias follows sooner, and is disturbed by motion
    bias_sigma : rad/s, of the bias at the start
    motion_bandwidth : α, 1/s: slower motion than this is held to be bounded; small: trusts the accelerometer
        less in slow motion
    motion_spread : how much more noise is assumed than the innovations show; large: slower inclination
    motion_floor : m²/s³, the least level of that noise
    motion_time : s over which its level is followed
    velocity_sigma, position_sigma : m/s, m, at the start and after a gap
    gravity : m/s²
    rest_rate_change, rest_force_change : rad/s, m/s²: rest ends where a block is farther than this from the
        low-passed readings
    rest_rate : rad/s: a steady rate above this is no rest; it bounds the bias that rest can show
    rest_time, rest_filter : s that rest must last, and time constant of the low-pass
    rest_noise : rad/s/√Hz of the gyro's mean at rest, bias instability included
    field_noise : √s times the length of the field: slow disturbances indoors, not the sensor's noise; large:
        heading follows the gyro longer
    field_gate : share of the field's length by which strength and dip may err before the field is disturbed
    field_doubt : factor on the square of such an error in the noise; large: a disturbed field counts less
    bias_memory : s over which a bias that is still unknown turns the heading the same way
    iron_sigma, iron_walk : share of the field, and of it per √s: hard iron left by the calibration
    iron_doubt : 1/s, by which the square of a disturbance makes the hard iron unsure: a magnet on the sensor
        is learned; 0 lets only the walk change it
    reference_sigma, reference_walk : the same for the reference field
    delay, delay_sigma : s by which the field lags the gyro at the start; the filter learns it while turning
    latency, latency_sigma : s by which gyro readings lag their stamps (the low-pass of a MEMS gyro delays by
        2 to 5 ms), made up for in what is reported, and how well that is known
    tilt_floor : rad in the covariance of the inclination that no filter averages away (accelerometer bias)
    heading_floor : the same for the heading, as a share of the field that is hard or soft iron
    start_tilt_sigma, start_heading_sigma : rad
    start_known : rad; until the inclination is known to this, the heading is begun anew at every block
    start_motion : m²/s³, level of the linear acceleration at the start
    gap : s between samples above which the rotation in between counts as unknown

    Raises
    ------
    ModelError
        where a setting is out of its range.

    Notes
    -----
    Error-state filter: Solà 2017, Quaternion kinematics for the error-state Kalman filter, §7 (global
    error).  That linear acceleration averages to zero in an almost inertial frame, and that the heading is
    best kept apart: Laidig and Seel 2023, VQF, Information Fusion 91, there with low-pass filters.
    Parameters were chosen on trials 01, 07, 16, 24 and 29 of BROAD.
    """

    block: float = 0.05
    gyro_noise: float = 0.01 * DEGREE
    tilt_scale: float = 0.0008
    heading_scale: float = 0.004
    bias_walk: float = 0.0005 * DEGREE
    bias_sigma: float = 0.5 * DEGREE
    motion_bandwidth: float = 1.5
    motion_spread: float = 0.85
    motion_floor: float = 1e-4
    motion_time: float = 1.0
    velocity_sigma: float = 0.5
    position_sigma: float = 0.3
    gravity: float = 9.80665
    rest_rate_change: float = 2.0 * DEGREE
    rest_force_change: float = 0.3
    rest_rate: float = 2.0 * DEGREE
    rest_time: float = 1.0
    rest_filter: float = 0.5
    rest_noise: float = 0.03 * DEGREE
    field_noise: float = 0.05
    field_gate: float = 0.06
    field_doubt: float = 100.0
    bias_memory: float = 10.0
    iron_sigma: float = 0.005
    iron_walk: float = 0.0005
    iron_doubt: float = 0.1
    reference_sigma: float = 0.1
    reference_walk: float = 0.0005
    delay: float = 0.01
    delay_sigma: float = 0.005
    latency: float = 0.004
    latency_sigma: float = 0.001
    tilt_floor: float = 0.2 * DEGREE
    heading_floor: float = 0.02
    start_tilt_sigma: float = 0.2
    start_heading_sigma: float = 0.3
    start_known: float = 0.1
    start_motion: float = 1.0
    gap: float = 0.25

    def __post_init__(self) -> None:
        given = {
            name: getattr(self, name) for name in type(self).__dataclass_fields__ if name != "magnetometer"
        }
        require_settings(
            "ErrorStateAttitude",
            {name: value for name, value in given.items() if name not in MAY_BE_ZERO},
            zero={name: value for name, value in given.items() if name in MAY_BE_ZERO},
        )
        if self.gap < self.block:
            raise ModelError(f"gap is at least block, got {self.gap} and {self.block} s")

    @property
    def name(self) -> str:
        """error-state."""
        return "error-state"

    @property
    def settings(self) -> Array:
        """What the compiled step takes, in the order of `error_state_layout`."""
        keep = 2.0 * GYRO_ERROR_TIME
        values = [self.block, self.gap, self.gyro_noise**2]
        values += [self.tilt_scale**2 * keep, self.heading_scale**2 * keep]
        values += [self.bias_walk**2, self.bias_sigma**2]
        values += [self.motion_bandwidth, self.motion_spread, self.motion_floor, self.motion_time]
        values += [self.velocity_sigma**2, self.position_sigma**2, self.gravity]
        values += [self.rest_rate_change**2, self.rest_force_change**2, self.rest_time, self.rest_rate]
        values += [self.rest_filter, self.rest_noise**2]
        values += [self.field_noise**2, self.field_gate**2, self.field_doubt, 2.0 * self.bias_memory]
        values += [
            self.iron_sigma**2,
            self.iron_walk**2,
            self.iron_doubt,
            self.reference_walk**2,
            self.reference_sigma**2,
        ]
        values += [self.delay, self.delay_sigma**2]
        values += [self.latency, self.latency_sigma**2, self.tilt_floor**2, self.heading_floor**2]
        values += [self.start_tilt_sigma**2, self.start_heading_sigma**2]
        values += [self.start_known**2, self.start_motion]
        return np.array(values)

    def start(self, gyro: ArrayLike, accel: ArrayLike) -> Array:
        """State (n,) from a first sample; `step` takes the same sample with dt = 0."""
        from sequential.attitude.error_state_step_kernel import start_error_state

        state = np.zeros(STATE)
        start_error_state(state, sample(gyro, accel, None)[1], self.settings)
        return state

    def step(
        self, state: ArrayLike, gyro: ArrayLike, accel: ArrayLike, mag: ArrayLike | None, dt: float
    ) -> Array:
        """Next state (n,), dt seconds after the last sample; its layout is that of `error_state_layout`.

        Numbers 0-3 are the quaternion without magnetometer; `report` gives both attitudes.
        """
        from sequential.attitude.error_state_step_kernel import step_error_state

        own = own_state(state, STATE, "ErrorStateAttitude")
        step_error_state(own, *sample(gyro, accel, mag), dt, self.settings)
        return own

    def report(self, state: ArrayLike, gyro: ArrayLike) -> tuple[Array, Array]:
        """Quaternions (4,) with and without magnetometer of a state, `latency` after its last sample."""
        from sequential.attitude.error_state_kernel import report

        both = np.empty((2, 1, 4))
        rate = sample(gyro, np.zeros(3), None)[0]
        report(own_state(state, STATE, "ErrorStateAttitude"), rate, self.settings, 0, both[0], both[1])
        return both[0, 0], both[1, 0]

    def estimate(self, recording: ImuRecording) -> AttitudeHistory:
        """Orientation at every sample of a recording, causal: row k knows nothing later than sample k.

        Without magnetometer `world_q_body` and `heading_free` are the same, and the heading counts from an
        arbitrary direction.
        """
        from sequential.attitude.error_state_kernel import run_error_state

        gyro, accel, mag = self.samples(recording)
        n = len(recording)
        # one block of memory, so that the system maps it in few pieces, and nothing is copied
        numbers, flags = np.empty(n * sum(WIDTHS.values())), np.empty(2 * n, np.bool_)
        columns = _columns(numbers, flags, n).values()
        run_error_state(recording.t, gyro, accel, mag, self.settings, np.zeros(STATE), *columns)
        numbers.flags.writeable = flags.flags.writeable = False
        return AttitudeHistory(recording.t, **_columns(numbers, flags, n), name=self.name)


def _columns(numbers: Array, flags: NDArray[np.bool_], n: int) -> dict[str, Any]:
    """Fields of an attitude history, in the order of the compiled loop, as views of two blocks."""
    columns, start = {}, 0
    for name, width in WIDTHS.items():
        part = numbers[start : start + n * width]
        columns[name] = part.reshape((n, 3, 3) if width == 9 else (n, width))
        start += n * width
    return {**columns, "rest": flags[:n], "magnetic_disturbance": flags[n:]}
