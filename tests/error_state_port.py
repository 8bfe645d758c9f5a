"""The error-state filter of firmware/core, called from Python, and its state as the Python one has it."""

import ctypes
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from c_structs import structs

from sequential.attitude import ErrorStateAttitude
from sequential.attitude import error_state_layout as at

CORE = Path(__file__).resolve().parents[1] / "firmware" / "core"
SOURCES = sorted(CORE.glob("error_state*_f32.c"))
FLAGS = [
    *("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Werror"),
    *("-ffp-contract=off", "-fno-math-errno", "-O2"),
]
STRUCTS = structs("error_state_f32.h")
State, Derived, Settings = (STRUCTS[f"error_state_f32_{name}"] for name in ("state", "derived", "settings"))
SAMPLE = np.dtype([("gyro", "<f4", 3), ("accel", "<f4", 3), ("mag", "<f4", 3)])
STRICT = ("-fsanitize=undefined", "-fno-sanitize-recover=all", "-static-libubsan")
NEED_SETTINGS = ("covariance", "covariance_6d")
NAN = np.full(3, np.nan)
# where a number or a run of numbers stands in the Python state, by the name of the field in C
PLACES = {
    "turn": at.Q, "level": at.LEVEL,
    "still": at.STILL, "slow_rate": at.SLOW_GYRO, "slow_force": at.SLOW_ACCEL, "started": at.STARTED,
    "resting": at.RESTING, "disturbed": at.DISTURBED, "heading_known": at.NORTH_KNOWN,
    "unseen": at.UNSEEN, "half": at.HALF,
    "last_field": at.LAST_FIELD, "pending": at.PENDING, "watching": at.SEEN, "begin": at.START,
    "mean_force": at.MEAN_FORCE, "age": at.AGE, "last_rate": at.LAST_RATE,
}  # fmt: skip
VALUES = {"tilt": (3, at.BIAS, 7), "heading": (1, at.NORTH, 6)}  # first number in C, in Python, how many
SUMS = {
    "force": at.FORCE, "field": at.FIELD, "turned": at.TURNED, "rate_squared": at.RATE_SQUARED,
    "samples": at.SAMPLES, "forces": at.FORCES, "fields": at.FIELDS, "rate": at.RATE,
    "specific": at.SPECIFIC, "elapsed": at.ELAPSED,
}  # fmt: skip
COVARIANCES = {"tilt_cov": (at.P, at.ERRORS), "heading_cov": (at.D, at.HEADING_ERRORS)}
SATURATED = {"still": "rest_time", "age": 1.0, "unseen": 0.5}  # Python counts on, without a difference


def samples_of(gyro, accel, mag=None):
    """(N,) of `struct imu_f32`; without a field its numbers are NaN."""
    out = np.zeros(len(gyro), SAMPLE)
    out["gyro"], out["accel"], out["mag"] = gyro, accel, np.nan if mag is None else mag
    return out


@dataclass
class Found:
    """What the port says of every sample, as `AttitudeHistory` does."""

    world_q_body: np.ndarray
    heading_free: np.ndarray
    cov: np.ndarray
    cov_6d: np.ndarray
    gyro_bias: np.ndarray
    gyro_bias_cov: np.ndarray
    rest: np.ndarray
    magnetic_disturbance: np.ndarray
    closing: np.ndarray
    """Where rest and field of a block wait for the next sample."""


class Port:
    """The compiled filter with settings of an `ErrorStateAttitude`."""

    def __init__(self, library: Path, design: ErrorStateAttitude | None = None):
        self.calls = ctypes.CDLL(str(library))
        self.step = self.calls.error_state_f32_step
        self.step.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_float]
        self.step.restype = None
        self.design = design or ErrorStateAttitude()
        self.settings = Settings()
        for name, _ in Settings._fields_:
            setattr(self.settings, name, getattr(self.design, name))
        self.derived = Derived()
        self.calls.error_state_f32_derive(ctypes.byref(self.settings), ctypes.byref(self.derived))

    def start(self, sample):
        """State from a first sample, one entry of `samples_of`."""
        state, one = State(), np.array(sample, SAMPLE)
        self.calls.error_state_f32_start(ctypes.byref(state), ctypes.byref(self.derived), _at(one))
        return state

    def run(self, samples, dt, state=None, every=1):
        """Step over samples, dt (N,) seconds after the one before, and ask at each `every`-th; `Found`."""
        state = state or self.start(samples[0])
        widths = {"attitude": 4, "heading_free": 4, "covariance": 9, "covariance_6d": 9, "bias_covariance": 9}
        asked = {name: np.zeros((len(samples[::every]), width), np.float32) for name, width in widths.items()}
        bias, flags = np.zeros((len(samples[::every]), 3)), np.zeros((len(samples[::every]), 3), bool)
        here, derived, first = ctypes.addressof(state), ctypes.addressof(self.derived), samples.ctypes.data
        for k, seconds in enumerate(np.asarray(dt, np.float32).tolist()):
            self.step(here, derived, first + k * SAMPLE.itemsize, seconds)
            if k % every == 0:
                row = k // every
                for name, values in asked.items():
                    constants = (
                        [ctypes.byref(self.derived)] if name in ("covariance", "covariance_6d") else []
                    )
                    call = getattr(self.calls, f"error_state_f32_{name}")
                    call(ctypes.byref(state), *constants, _at(values[row]))
                bias[row] = state.tilt[3:6]
                flags[row] = state.resting, state.disturbed, state.closing
        covs = [asked[name].reshape(-1, 3, 3).astype(float) for name in list(widths)[2:]]
        both = [asked[name].astype(float) for name in ("attitude", "heading_free")]
        return Found(*both, covs[0], covs[1], bias, covs[2], *flags.T)

    def into_c(self, numbers):
        """The C state of a state of `ErrorStateAttitude`."""
        state = State()
        state.latency = self.design.latency
        state.per_length = 1.0 / numbers[at.SCALE] if numbers[at.SCALE] else 0.0
        for holder, places in ((state, PLACES), (state.sums, SUMS)):
            for name, place in places.items():
                _put(holder, name, numbers[place:])
        for name, (first, place, count) in VALUES.items():
            getattr(state, name)[first : first + count] = numbers[place : place + count].tolist()
        for name, bound in SATURATED.items():
            most = getattr(self.design, bound) if isinstance(bound, str) else bound
            setattr(state, name, min(getattr(state, name), most))
        for name, (place, n) in COVARIANCES.items():
            getattr(state, name)[:] = numbers[place : place + n * n].reshape(n, n)[np.tril_indices(n)]
        return state

    def into_python(self, state):
        """The state of `ErrorStateAttitude` of a C state; what saturates in C does so here."""
        numbers = np.zeros(at.STATE)
        numbers[at.SCALE] = 1.0 / state.per_length if state.per_length else 0.0
        numbers[at.DELTA] = 2.0 * np.arctan2(state.half[1], state.half[0])
        for holder, places in ((state, PLACES), (state.sums, SUMS)):
            for name, place in places.items():
                value = np.atleast_1d(getattr(holder, name))
                numbers[place : place + len(value)] = value
        for name, (first, place, count) in VALUES.items():
            numbers[place : place + count] = getattr(state, name)[first : first + count]
        for name, (place, n) in COVARIANCES.items():
            square = np.zeros((n, n))
            square[np.tril_indices(n)] = getattr(state, name)[:]
            numbers[place : place + n * n] = (square + np.tril(square, -1).T).ravel()
        return numbers


def build(compiler, folder: Path, *more: str) -> Path:
    """The filter as a shared library in a folder, with more flags of the compiler."""
    library = folder / "error_state.so"
    command = [compiler, *FLAGS, *more, "-shared", "-fPIC", *map(str, SOURCES), "-o", str(library), "-lm"]
    subprocess.run(command, check=True)
    return library


def _at(array):
    return ctypes.c_void_p(array.ctypes.data)


def _put(holder, name, numbers):
    present = getattr(holder, name)
    if isinstance(present, ctypes.Array):
        present[:] = [float(number) for number in numbers[: len(present)]]
    else:
        setattr(holder, name, type(present)(numbers[0]))
