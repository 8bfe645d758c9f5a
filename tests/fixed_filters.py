"""What the tests of fixed-point filters share: recordings in their units, loops, angles between."""

import ctypes

import numpy as np
from core_library import compiled, pointer, samples_q

from factorlab.datasets.recordings import open_recording
from sequential.sensors import ImuRecording

LOOP = """
#include "MODULE_q.h"
#include "MODULE_q_100hz.h"
void run(const struct imu_q *samples, const uint8_t *periods, int32_t count, uint16_t hz, const float *given,
         struct MODULE_q_state *states, int32_t *attitudes);
void run(const struct imu_q *samples, const uint8_t *periods, int32_t count, uint16_t hz, const float *given,
         struct MODULE_q_state *states, int32_t *attitudes)
{
    struct MODULE_q_settings settings;
    struct MODULE_q_derived derived;
    struct MODULE_q_state state;
    MODULE_q_defaults(&settings);
    for (unsigned i = 0; given && i < sizeof settings / sizeof(float); i++) {
        if (given[i] >= 0.0f) {
            ((float *)&settings)[i] = given[i];
        }
    }
    MODULE_q_derive(&settings, hz, &derived);
    MODULE_q_start(&state, &derived, samples);
    for (int32_t k = 0; k < count; k++) {
        MODULE_q_step(&state, &derived, &samples[k], periods[k]);
        states[k] = state;
        MODULE_q_attitude(&state, &attitudes[4 * k]);
    }
}
void steps(struct MODULE_q_state *states, const struct imu_q *samples, const uint8_t *periods, int32_t count);
void steps(struct MODULE_q_state *states, const struct imu_q *samples, const uint8_t *periods, int32_t count)
{
    for (int32_t k = 0; k < count; k++) {
        MODULE_q_step(&states[k], &MODULE_q_100hz, &samples[k], periods[k]);
    }
}
void soak(const struct imu_q *samples, int32_t count, int32_t rounds, struct MODULE_q_state *last,
          double *range);
void soak(const struct imu_q *samples, int32_t count, int32_t rounds, struct MODULE_q_state *last,
          double *range)
{
    struct MODULE_q_state state;
    MODULE_q_start(&state, &MODULE_q_100hz, samples);
    for (int32_t round = 0; round < rounds; round++) {
        for (int32_t k = 0; k < count; k++) {
            int32_t q[4];
            double squared = 0.0;
            MODULE_q_step(&state, &MODULE_q_100hz, &samples[k], 1);
            MODULE_q_attitude(&state, q);
            for (int i = 0; i < 4; i++) {
                squared += (double)q[i] * q[i] / 1152921504606846976.0;
            }
            range[0] = squared < range[0] ? squared : range[0];
            range[1] = squared > range[1] ? squared : range[1];
        }
        last[round] = state;
    }
}
void at_100_hz(struct MODULE_q_derived *derived, struct MODULE_q_derived *ours);
void at_100_hz(struct MODULE_q_derived *derived, struct MODULE_q_derived *ours)
{
    struct MODULE_q_settings settings;
    MODULE_q_defaults(&settings);
    MODULE_q_derive(&settings, 100, derived);
    *ours = MODULE_q_100hz;
}
"""


class FixedFilter:
    """A module of the core, compiled for this machine."""

    def __init__(self, compiler, folder, module, state, settings, sources=()):
        names = (f"{module}_q.c", *sources, "trig_q.c", "fixed_q.c")
        self.core = compiled(compiler, folder, *names, text=LOOP.replace("MODULE", module))
        self.state, self.settings = np.dtype(state, align=True), settings

    def run(self, samples, periods=None, rate=100, **settings):
        """States (N,) and attitudes (N, 4) over samples; `periods` are 0, 1, 1, … unless given."""
        count = len(samples)
        if periods is None:
            periods = np.minimum(np.arange(count), 1)
        given = np.array([settings.pop(name, -1.0) for name in self.settings], dtype=np.float32)
        assert not settings, "unknown settings"
        states, attitudes = np.zeros(count, self.state), np.zeros((count, 4), np.int32)
        periods = np.ascontiguousarray(periods, np.uint8)
        self.core.run(pointer(samples), pointer(periods), count, int(rate), pointer(given), pointer(states),
                      pointer(attitudes))  # fmt: skip
        return states, attitudes / 2.0**30

    def steps(self, states, samples, periods):
        """One step of each state by its own sample."""
        states = states.copy()
        periods = np.ascontiguousarray(periods, np.uint8)
        self.core.steps(pointer(states), pointer(samples), pointer(periods), len(states))
        return states

    def soak(self, samples, rounds):
        """States (rounds,) after each time through the samples; least and largest length of the attitude."""
        last, squared = np.zeros(rounds, self.state), np.ones(2)
        self.core.soak(pointer(samples), len(samples), rounds, pointer(last), pointer(squared))
        return last, np.sqrt(squared)

    def constants(self, size):
        """Bytes of the derived constants of the defaults at 100 Hz, as derived and as the header has them."""
        both = [(ctypes.c_uint8 * size)() for _ in range(2)]
        self.core.at_100_hz(*both)
        return [bytes(one) for one in both]


def resampled(name, rate=100.0, *, field=True, part=None):
    """A recording in the units of `struct imu_q`, and the same rounded numbers in SI."""
    recording = open_recording(name).recording
    if part is not None:
        recording = recording.slice(*part)
    seconds = recording.seconds
    at = np.arange(int(seconds[-1] * rate)) / rate

    def columns(values):
        known = np.isfinite(values[:, 0])
        return np.column_stack([np.interp(at, seconds[known], axis) for axis in values[known].T])

    mag = columns(recording.mag) if field and recording.mag is not None else None
    samples = samples_q(columns(recording.gyro), columns(recording.accel), mag)
    return samples, in_si(samples, rate)


def in_si(samples, rate=100.0):
    """Samples of `struct imu_q` as a recording; a field of zeros is none."""
    mag = samples["mag"] / 256.0
    mag[(samples["mag"] == 0).all(axis=1)] = np.nan
    stamps = np.round(np.arange(len(samples)) * (1e9 / rate)).astype(np.int64)
    given = None if np.isnan(mag).all() else mag
    return ImuRecording(stamps, samples["accel"] / 256.0, samples["gyro"] / 2.0**24, given)


def degrees_between(q, p):
    """Angle (N,) of the rotation from attitudes (N, 4) to others of unit length."""
    q = q / np.linalg.norm(q, axis=1)[:, None]
    q = q * np.where((q * p).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    return np.degrees(4 * np.arcsin(np.minimum(np.linalg.norm(q - p, axis=1) / 2, 1.0)))
