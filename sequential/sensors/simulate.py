"""Recordings whose truth is known: an exact motion, seen by sensors with declared errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, ShapeError
from sequential.log import nanoseconds, seconds
from sequential.manifold.quaternion import quaternion_inverse, rotate
from sequential.noise import ImuNoise
from sequential.sensors.gravity import STANDARD_GRAVITY
from sequential.sensors.motion import Motion
from sequential.sensors.recording import ImuRecording

__all__ = ["ImuErrors", "ImuSimulation", "ImuTruth", "simulate_imu"]

Array = NDArray[np.float64]
FIELD = (0.0, 22.0, -42.0)  # µT, east north up: middle latitudes of the north
ZERO = (0.0, 0.0, 0.0)
QUIET = ImuNoise(0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class ImuErrors:
    """How the sensors err: raw = clip(round(matrix @ true + offset + noise)), sensor by sensor.

    Parameters
    ----------
    noise : white noise and bias walks, in data-sheet densities
    gyro_bias, accel_bias : (3,) at the start, rad/s and m/s²
    gyro_matrix, accel_matrix : (3, 3) gain and misalignment; None is the identity
    gyro_per_degree, accel_per_degree : (3,) change of bias with temperature, from 25 °C
    mag_matrix, mag_offset, mag_sigma : soft iron (3, 3), hard iron (3,) µT, white noise µT a sample
    gyro_lsb, accel_lsb, mag_lsb : resolution, in the sensor's unit; 0 does not round
    gyro_range, accel_range, mag_range : full scale, in the sensor's unit
    """

    noise: ImuNoise = QUIET
    gyro_bias: ArrayLike = ZERO
    accel_bias: ArrayLike = ZERO
    gyro_matrix: ArrayLike | None = None
    accel_matrix: ArrayLike | None = None
    gyro_per_degree: ArrayLike = ZERO
    accel_per_degree: ArrayLike = ZERO
    mag_matrix: ArrayLike | None = None
    mag_offset: ArrayLike = ZERO
    mag_sigma: float = 0.0
    gyro_lsb: float = 0.0
    accel_lsb: float = 0.0
    mag_lsb: float = 0.0
    gyro_range: float = float("inf")
    accel_range: float = float("inf")
    mag_range: float = float("inf")


class ImuTruth(NamedTuple):
    """What was so at every sample; N as in the recording."""

    t: NDArray[np.int64]  # ns
    world_q_body: Array  # (N, 4), world east north up
    angular_rate: Array  # (N, 3) body, rad/s
    specific_force: Array  # (N, 3) body, m/s²
    field: Array  # (N, 3) body, µT, disturbances included
    gyro_bias: Array  # (N, 3) rad/s
    accel_bias: Array  # (N, 3) m/s²
    rest: NDArray[np.bool_]  # (N,)


class ImuSimulation(NamedTuple):
    """One draw: what the sensors said, and what was so."""

    recording: ImuRecording
    truth: ImuTruth


def simulate_imu(
    motion: Motion,
    rng: np.random.Generator,
    *,
    rate: float = 100.0,
    errors: ImuErrors | None = None,
    gravity: float = STANDARD_GRAVITY,
    field: ArrayLike | None = FIELD,
    disturbance: Callable[[Array], Array] | None = None,
    mag_every: int = 1,
    temperature: ArrayLike | Callable[[Array], Array] | None = None,
    jitter: float = 0.0,
    name: str = "simulated",
) -> ImuSimulation:
    """Record a motion with an IMU that lies flat in the body frame and turns about its own centre.

    Parameters
    ----------
    rate : Hz
    errors : of the sensors; without, they are perfect
    gravity : m/s², along -z of the world
    field : (3,) magnetic field in the world, µT; None leaves the magnetometer out
    disturbance : gives the magnetic field (N, 3) that is added, µT in the world, at times (N,) s
    mag_every : the magnetometer reads at one sample in this many; the rows between are NaN
    temperature : °C, one for all, one a sample, or a function of times (N,) s
    jitter : standard deviation of the stamps about their grid, s; truth is taken at the moment of sampling

    Raises
    ------
    DataError, ShapeError
    """
    if not (np.isfinite(rate) and rate > 0) or mag_every < 1 or jitter < 0:
        msg = f"rate {rate} must be positive, mag_every {mag_every} at least 1, jitter {jitter} not negative"
        raise DataError(msg)
    own = ImuErrors() if errors is None else errors
    stamps = nanoseconds(_times(motion.duration, rate, jitter, rng))
    t = seconds(stamps)
    heat = None if temperature is None else _temperature(temperature, t)
    truth = _truth(motion, stamps, own, heat, gravity, field, disturbance, rng)
    steps = np.diff(t, append=t[-1] + 1.0 / rate)
    gyro_noise = own.noise.gyro_density * rng.normal(size=(len(t), 3)) / np.sqrt(steps)[:, None]
    accel_noise = own.noise.accel_density * rng.normal(size=(len(t), 3)) / np.sqrt(steps)[:, None]
    gyro = _apply(own.gyro_matrix, truth.angular_rate) + truth.gyro_bias + gyro_noise
    accel = _apply(own.accel_matrix, truth.specific_force) + truth.accel_bias + accel_noise
    mag = None
    if field is not None:
        mag = _apply(own.mag_matrix, truth.field) + _vector(own.mag_offset)
        mag = _read(mag + own.mag_sigma * rng.normal(size=mag.shape), own.mag_lsb, own.mag_range)
        mag[np.arange(len(t)) % mag_every != 0] = np.nan
    accel = _read(accel, own.accel_lsb, own.accel_range)
    gyro = _read(gyro, own.gyro_lsb, own.gyro_range)
    return ImuSimulation(ImuRecording(stamps, accel, gyro, mag, heat, name), truth)


def _times(duration: float, rate: float, jitter: float, rng: np.random.Generator) -> Array:
    t = np.arange(int(np.floor(duration * rate + 1e-9)) + 1) / rate
    if jitter > 0:
        t = t + np.clip(jitter * rng.normal(size=len(t)), -0.45 / rate, 0.45 / rate)
    return t - min(float(t[0]), 0.0)


def _temperature(given: ArrayLike | Callable[[Array], Array], t: Array) -> Array:
    values = given(t) if callable(given) else given
    return np.array(np.broadcast_to(np.asarray(values, dtype=np.float64), t.shape))


def _truth(
    motion: Motion,
    stamps: NDArray[np.int64],
    errors: ImuErrors,
    heat: Array | None,
    gravity: float,
    field: ArrayLike | None,
    disturbance: Callable[[Array], Array] | None,
    rng: np.random.Generator,
) -> ImuTruth:
    t = seconds(stamps)
    q, angular_rate = motion.attitude(t)
    body = quaternion_inverse(q)
    force = rotate(body, motion.acceleration(t) + np.array([0.0, 0.0, gravity]))
    around = np.zeros((len(t), 3)) + (_vector(ZERO) if field is None else _vector(field))
    if disturbance is not None:
        around = around + disturbance(t)
    steps = np.sqrt(np.diff(t, prepend=t[0]))[:, None]
    warmth = np.zeros((len(t), 1)) if heat is None else (heat - 25.0)[:, None]
    biases = [
        _vector(start) + warmth * _vector(slope) + np.cumsum(walk * steps * rng.normal(size=(len(t), 3)), 0)
        for start, slope, walk in (
            (errors.gyro_bias, errors.gyro_per_degree, errors.noise.gyro_bias_walk),
            (errors.accel_bias, errors.accel_per_degree, errors.noise.accel_bias_walk),
        )
    ]
    rest = motion.rest(t)
    return ImuTruth(stamps, q, angular_rate, force, rotate(body, around), biases[0], biases[1], rest)


def _vector(given: ArrayLike) -> Array:
    values = np.asarray(given, dtype=np.float64)
    if values.shape != (3,):
        msg = f"a bias, offset or field has 3 components, got shape {values.shape}"
        raise ShapeError(msg)
    return values


def _apply(matrix: ArrayLike | None, values: Array) -> Array:
    return values.copy() if matrix is None else values @ np.asarray(matrix, dtype=np.float64).T


def _read(values: Array, lsb: float, full_scale: float) -> Array:
    """What the converter makes of it: whole steps, within the range."""
    if lsb > 0:
        values = np.round(values / lsb) * lsb
    return np.clip(values, -full_scale, full_scale)
