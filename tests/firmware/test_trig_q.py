"""Angles in fixed point against those of double precision, over dense grids of what can be asked."""

import numpy as np
import pytest
from core_library import compiled, pointer

from sequential.attitude import attitude_from_angles
from sequential.attitude.angles import roll_pitch_yaw

LOOPS = """
#include "trig_q.h"
void vectors(const int32_t *y, const int32_t *x, uint32_t *fine, int16_t *angle, uint32_t *length, int32_t n);
void vectors(const int32_t *y, const int32_t *x, uint32_t *fine, int16_t *angle, uint32_t *length, int32_t n)
{
    for (int32_t i = 0; i < n; i++) {
        fine[i] = atan2_q32(y[i], x[i]);
        angle[i] = atan2_q(y[i], x[i]);
        if (polar_q32(y[i], x[i], &length[i]) != fine[i]) {
            fine[i] ^= 0x80000000U;
        }
    }
}
void arc_sines(const int32_t *sine, int16_t *angle, int32_t n);
void arc_sines(const int32_t *sine, int16_t *angle, int32_t n)
{
    for (int32_t i = 0; i < n; i++) {
        angle[i] = asin_q(sine[i]);
    }
}
void waves(const uint32_t *angle, int32_t *sine, int32_t *cosine, int32_t n);
void waves(const uint32_t *angle, int32_t *sine, int32_t *cosine, int32_t n)
{
    for (int32_t i = 0; i < n; i++) {
        sincos_q(angle[i], &sine[i], &cosine[i]);
    }
}
void attitudes(const int32_t *q, int16_t *angles, int32_t n);
void attitudes(const int32_t *q, int16_t *angles, int32_t n)
{
    for (int32_t i = 0; i < n; i++) {
        angles_q(&q[4 * i], &angles[3 * i]);
    }
}
"""
TURN16, TURN32, Q30 = 2.0**16, 2.0**32, 2.0**30
LEAST = np.iinfo(np.int32).min


@pytest.fixture(scope="session")
def core(c_compiler, tmp_path_factory):
    return compiled(c_compiler, tmp_path_factory.mktemp("trig_q"), "trig_q.c", "fixed_q.c", text=LOOPS)


def apart(a, b):
    """Degrees between angles in turns, the short way round."""
    return 360.0 * np.abs((a - b + 0.5) % 1.0 - 0.5)


def vectors(core, y, x):
    y, x = (np.ascontiguousarray(v, dtype=np.int32) for v in (y, x))
    fine, angle, length = np.zeros(len(x), np.uint32), np.zeros(len(x), np.int16), np.zeros(len(x), np.uint32)
    core.vectors(*map(pointer, (y, x, fine, angle, length)), len(x))
    return fine / TURN32, angle / TURN16, length.astype(float)


def attitudes(core, q):
    rounded = np.ascontiguousarray(np.round(q * Q30), dtype=np.int32)
    angles = np.zeros((len(q), 3), np.int16)
    core.attitudes(pointer(rounded), pointer(angles), len(q))
    return angles / TURN16, roll_pitch_yaw(rounded / Q30) / (2 * np.pi)


@pytest.mark.parametrize("radius", [2.0**12, 2.0**16, 2.0**24, 2.0**31 - 1])
def test_atan2_over_a_million_directions(core, radius):
    turns = np.arange(2**20) / 2**20 - 0.5
    y, x = np.round(radius * np.sin(2 * np.pi * turns)), np.round(radius * np.cos(2 * np.pi * turns))
    fine, angle, length = vectors(core, y, x)
    truth = np.arctan2(y, x) / (2 * np.pi)
    assert apart(fine, truth).max() <= 0.0018
    assert apart(angle, truth).max() <= 0.0045
    np.testing.assert_allclose(length, np.hypot(y, x), rtol=4.5e-5, atol=1.0)


def test_every_small_vector(core):
    y, x = (v.ravel() for v in np.meshgrid(np.arange(-300, 301), np.arange(-300, 301)))
    fine, _, _ = vectors(core, y, x)
    some = (y != 0) | (x != 0)
    assert apart(fine, np.arctan2(y, x) / (2 * np.pi))[some].max() <= 0.0018
    assert fine[~some] == 0.0


def test_axes_diagonals_and_ends_of_the_range(core):
    big = 2**31 - 1
    y = [0, 0, 1, -1, 0, 0, big, LEAST, LEAST, big, LEAST, 7, -7, 0]
    x = [1, -1, 0, 0, big, LEAST, 0, 0, LEAST, LEAST, big, 7, -7, 0]
    turns = [0, 0.5, 0.25, 0.75, 0, 0.5, 0.25, 0.75, 0.625, 0.375, 0.875, 0.125, 0.625, 0]
    fine, angle, length = vectors(core, y, x)
    assert apart(fine, np.array(turns)).max() < 0.001
    assert apart(angle, np.array(turns)).max() == 0.0
    np.testing.assert_allclose(
        length, np.hypot(np.array(y, float), np.array(x, float)), rtol=4.5e-5, atol=0.5
    )


def test_laws_of_the_angle(core, rng):
    """Turned by a quarter, mirrored, scaled: what holds of angles holds of these, to the last bit."""
    y, x = rng.integers(-(2**24), 2**24, (2, 100_000))
    fine = vectors(core, y, x)[0]
    np.testing.assert_array_equal(vectors(core, x, -y)[0], (fine + 0.25) % 1.0)
    np.testing.assert_array_equal(vectors(core, -y, x)[0], -fine % 1.0)
    np.testing.assert_array_equal(vectors(core, 64 * y, 64 * x)[0], fine)


def test_arc_sine_over_its_range_and_beyond(core):
    ends = 2**30 - np.arange(100_000)
    sine = np.concatenate(
        [np.linspace(-(2.0**30), 2.0**30, 2**20).astype(int), ends, -ends, [2**31 - 1, LEAST]]
    )
    angle = np.zeros(len(sine), np.int16)
    core.arc_sines(pointer(np.ascontiguousarray(sine, np.int32)), pointer(angle), len(sine))
    truth = np.arcsin(np.clip(sine / Q30, -1, 1)) / (2 * np.pi)
    assert apart(angle / TURN16, truth).max() <= 0.006


def test_sine_and_cosine_over_the_turn(core):
    angle = np.concatenate([np.arange(2**20, dtype=np.uint32) << 12, np.arange(2**16, dtype=np.uint32)])
    sine, cosine = np.zeros(len(angle), np.int32), np.zeros(len(angle), np.int32)
    core.waves(pointer(angle), pointer(sine), pointer(cosine), len(angle))
    turns = 2 * np.pi * (angle / TURN32)
    np.testing.assert_allclose(sine / Q30, np.sin(turns), rtol=9e-6, atol=2.0**-29)
    np.testing.assert_allclose(cosine / Q30, np.cos(turns), rtol=9e-6, atol=2.0**-29)


def test_roll_pitch_yaw_of_random_attitudes(core, rng):
    q = rng.standard_normal((1_000_000, 4))
    found, truth = attitudes(core, q / np.linalg.norm(q, axis=1)[:, None])
    error = apart(found, truth)
    level = np.cos(2 * np.pi * truth[:, 1]) > 1e-3
    assert error[level].max() <= 0.005
    assert error[:, 1].max() <= 0.005, "the pitch is right at 90° too"


def test_roll_pitch_yaw_over_a_grid_with_its_edges(core):
    roll, pitch, yaw = np.meshgrid(
        np.radians(np.arange(-180.0, 180.0, 7.5)),
        np.radians([*np.arange(-90.0, 90.1, 2.5), -89.99, 89.99]),
        np.radians(np.arange(-180.0, 180.0, 7.5)),
    )
    q = attitude_from_angles(np.stack([roll.ravel(), pitch.ravel(), yaw.ravel()], axis=1))
    found, truth = attitudes(core, q)
    level = np.abs(np.degrees(2 * np.pi * truth[:, 1])) < 89.9
    assert apart(found[level], truth[level]).max() <= 0.005
    assert apart(found[:, 1], truth[:, 1]).max() <= 0.005


def test_no_quaternion_is_too_much(core, rng):
    """Garbage of 32 bits stays in range and overflows nowhere (the library traps overflow)."""
    extremes = rng.choice([LEAST, LEAST + 1, -1, 0, 1, 2**31 - 1], (5000, 4))
    q = np.ascontiguousarray(np.vstack([extremes, rng.integers(LEAST, 2**31, (5000, 4))]), np.int32)
    angles = np.zeros((len(q), 3), np.int16)
    core.attitudes(pointer(q), pointer(angles), len(q))
    assert np.abs(angles[:, 1].astype(int)).max() <= 2**14
