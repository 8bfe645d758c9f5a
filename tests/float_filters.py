"""The float filters of the core beside the Python filters that they are to equal."""

import ctypes
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from c_structs import library, structs

from sequential.attitude import ComplementaryAttitude, Mahony, TiltKalman
from sequential.attitude.estimator import AttitudeFilter
from sequential.sensors import ImuRecording

STEP_TOLERANCE = 1e-6


def single(value: float) -> float:
    """The nearest number of single precision, so that both filters get the same."""
    return float(np.float32(value))


@dataclass(frozen=True)
class Pair:
    """A filter in C and in Python: how their states and settings correspond."""

    name: str
    modules: tuple[str, ...]
    python: AttitudeFilter
    numbers: Callable[[Any], list[float]]
    """A C state as the Python filter's state."""
    seen: Callable[[AttitudeFilter, np.ndarray], np.ndarray]
    """What of a Python state the C state is to equal."""
    suffix: str = "_step"


def mahony_numbers(state: Any) -> list[float]:
    """State of mahony_kernel."""
    return [
        *state.world_q_body, *state.gyro_bias, state.since_start, state.since_field, state.out_of_gate,
        *state.mean_gyro, *state.mean_accel, state.at_rest, float(state.heading_known), *state.lasting,
    ]  # fmt: skip


def mahony_seen(python: AttitudeFilter, state: np.ndarray) -> np.ndarray:
    """Times that only count up to a bound stop there in C."""
    assert isinstance(python, Mahony)
    own = state.copy()
    own[7] = min(own[7], python.start_time)
    own[9] = min(own[9], python.heading_timeout)
    if python.magnetometer is False:
        own[8] = 0.0
    return own


def published_seen(_python: AttitudeFilter, state: np.ndarray) -> np.ndarray:
    """Quaternion and bias: the published step has nothing else."""
    return state[:7]


MAHONY = Pair(
    "mahony_f32",
    ("mahony_f32", "mahony_f32_published", "mahony_f32_settings"),
    Mahony(),
    mahony_numbers,
    mahony_seen,
)


def complementary_numbers(state: Any) -> list[float]:
    """State of complementary_kernel."""
    return [*state.world_q_body, state.since_field, float(state.heading_known)]


def tilt_numbers(state: Any) -> list[float]:
    """State of tilt_kernel; the last rates are not kept in C."""
    return [
        *state.angle, *state.bias, *state.angle_variance, *state.covariance, *state.bias_variance,
        float(state.heading_known), 0.0, 0.0, 0.0,
    ]  # fmt: skip


def tilt_seen(_python: AttitudeFilter, state: np.ndarray) -> np.ndarray:
    """Angles on the circle, so that -π is π; without the last rates."""
    return np.concatenate([np.sin(state[:3]), np.cos(state[:3]), state[3:16]])


def all_seen(_python: AttitudeFilter, state: np.ndarray) -> np.ndarray:
    """The whole state."""
    return state


COMPLEMENTARY = Pair(
    "complementary_f32",
    ("complementary_f32", "trig_f32"),
    ComplementaryAttitude(),
    complementary_numbers,
    all_seen,
)
TILT = Pair("tilt_f32", ("tilt_f32", "angles_f32", "trig_f32"), TiltKalman(), tilt_numbers, tilt_seen)


class FloatFilter:
    """A filter of the core, compiled for this machine, with a state of its own."""

    def __init__(self, pair: Pair, compiler: str, folder: Path) -> None:
        self.pair = pair
        self.lib = library(compiler, folder, *pair.modules)
        self.types = structs("imu.h", f"{pair.name}.h")
        self.step_function = getattr(self.lib, pair.name + pair.suffix)
        self.step_function.argtypes = [ctypes.c_void_p] * 3 + [ctypes.c_float]
        self.settings = self.types[f"{pair.name}_settings"]()
        self.derived = self.types[f"{pair.name}_derived"]()
        self.state = self.types[f"{pair.name}_state"]()
        self.call("defaults", self.settings)

    def call(self, name: str, *structs_: ctypes.Structure) -> Any:
        """A function of the module, by references."""
        return getattr(self.lib, f"{self.pair.name}_{name}")(*(ctypes.byref(one) for one in structs_))

    def use(self, python: AttitudeFilter) -> None:
        """Take the settings of a Python filter, by name, and derive."""
        for field in fields(python):
            if hasattr(self.settings, field.name):
                value = getattr(python, field.name)
                setattr(self.settings, field.name, value)
        if isinstance(python, TiltKalman):
            self.settings.nis_gate = python.settings[4]
        self.call("derive", self.settings, self.derived)

    def start(self, sample: np.ndarray) -> None:
        """State from a first sample (9,): gyro, accelerometer, magnetometer."""
        self.call("start", self.state, self.derived, self._sample(sample))

    def step(self, sample: np.ndarray, dt: float) -> None:
        """One sample (9,)."""
        own = self._sample(sample)
        self.step_function(*(ctypes.addressof(one) for one in (self.state, self.derived, own)), dt)

    @property
    def numbers(self) -> np.ndarray:
        """The state as the Python filter has it."""
        return np.array(self.pair.numbers(self.state), dtype=np.float64)

    @property
    def quaternion(self) -> np.ndarray:
        """(4,) by the module's own function."""
        out = np.zeros(4, np.float32)
        getattr(self.lib, f"{self.pair.name}_attitude")(
            ctypes.byref(self.state), out.ctypes.data_as(ctypes.c_void_p)
        )
        return out.astype(np.float64)

    def run(self, samples: np.ndarray, dt: np.ndarray) -> Iterator[np.ndarray]:
        """Quaternions (4,) of a recording (N, 9), dt (N,) with dt[0] = 0."""
        self.start(samples[0])
        for sample, step in zip(samples, dt, strict=True):
            self.step(sample, float(step))
            yield self.quaternion

    def _sample(self, sample: np.ndarray) -> ctypes.Structure:
        own = np.ascontiguousarray(sample, dtype=np.float32)
        return self.types["imu_f32"].from_buffer_copy(own.tobytes())


def recorded_table(recording: ImuRecording, magnetometer: bool | None) -> tuple[np.ndarray, np.ndarray]:
    """Samples (N, 9) of single precision, and dt (N,) with 0 first."""
    mag = recording.mag if magnetometer is not False else None
    field = np.full_like(recording.gyro, np.nan) if mag is None else mag
    samples = np.hstack([recording.gyro, recording.accel, field]).astype(np.float32)
    return samples, (np.diff(recording.t, prepend=recording.t[0]) * 1e-9).astype(np.float32)


def single_settings(python: AttitudeFilter) -> AttitudeFilter:
    """The same Python filter with settings of single precision."""
    values = {one.name: getattr(python, one.name) for one in fields(python)}
    return type(python)(**{n: single(v) if isinstance(v, float) else v for n, v in values.items()})
