"""The core's own trigonometry in single precision is right to the bounds that its headers state."""

import ctypes
import subprocess

import numpy as np
import pytest
from c_structs import CORE, WARNINGS

from sequential.attitude import attitude_from_angles, roll_pitch_yaw
from sequential.manifold.quaternion import quaternion_normalize

DRIVER = """
#include "angles_f32.h"
#include "trig_f32.h"
void many_atan2(const float *y, const float *x, float *out, int n)
{ for (int i = 0; i < n; i++) { out[i] = atan2_f32(y[i], x[i]); } }
void many_sin_cos(const float *a, float *s, float *c, int n)
{ for (int i = 0; i < n; i++) { sin_cos_f32(a[i], s + i, c + i); } }
void many_wrapped(const float *a, float *out, int n)
{ for (int i = 0; i < n; i++) { out[i] = wrapped_f32(a[i]); } }
void many_decay(const float *a, float *out, int n)
{ for (int i = 0; i < n; i++) { out[i] = decay_f32(a[i]); } }
void many_angles(const float *q, float *out, int n)
{ for (int i = 0; i < n; i++) { angles_f32(q + 4 * i, out + 3 * i); } }
void many_attitudes(const float *a, float *out, int n)
{ for (int i = 0; i < n; i++) { attitude_from_angles_f32(a + 3 * i, out + 4 * i); } }
"""


@pytest.fixture(scope="module", name="lib")
def driver_over_arrays(c_compiler, tmp_path_factory):
    folder = tmp_path_factory.mktemp("trig")
    (folder / "driver.c").write_text(DRIVER)
    sources = [CORE / "trig_f32.c", CORE / "angles_f32.c"]
    subprocess.run(
        [c_compiler, "-std=c99", "-O2", *WARNINGS[:1], "-ffp-contract=off", f"-I{CORE}", "-fPIC", "-shared",
         folder / "driver.c", *sources, "-o", folder / "lib.so", "-lm"],
        check=True,
    )  # fmt: skip
    return ctypes.CDLL(str(folder / "lib.so"))


def call(lib, name, *arrays, outputs, count=None):
    """A function of the driver over arrays of single precision."""
    given = [np.ascontiguousarray(one, np.float32) for one in arrays]
    results = [np.empty(shape, np.float32) for shape in outputs]
    pointers = [one.ctypes.data_as(ctypes.c_void_p) for one in [*given, *results]]
    getattr(lib, name)(*pointers, len(given[0]) if count is None else count)
    return [one.astype(np.float64) for one in results]


def on_circle(angle):
    return np.abs((angle + np.pi) % (2 * np.pi) - np.pi)


def test_arctangent_is_right_in_every_direction(lib):
    t = np.linspace(-np.pi, np.pi, 2_000_001)
    y, x = np.float32(7.3 * np.sin(t)), np.float32(7.3 * np.cos(t))
    (found,) = call(lib, "many_atan2", y, x, outputs=[len(t)])
    assert on_circle(found - np.arctan2(y.astype(float), x.astype(float))).max() < 3e-7


def test_arctangent_of_all_ratios_of_a_binade(lib):
    x = np.arange(0x3F800000, 0x40000000, 3, dtype=np.uint32).view(np.float32)
    (found,) = call(lib, "many_atan2", np.ones_like(x), x, outputs=[len(x)])
    assert np.abs(found - np.arctan2(1.0, x.astype(float))).max() < 1.5e-7


def test_sine_and_cosine(lib):
    angle = np.float32(np.linspace(-1000.0, 1000.0, 2_000_003))
    sine, cosine = call(lib, "many_sin_cos", angle, outputs=[len(angle)] * 2)
    assert np.abs(sine - np.sin(angle.astype(float))).max() < 1e-7
    assert np.abs(cosine - np.cos(angle.astype(float))).max() < 1e-7


def test_a_wrapped_angle_is_the_same_angle_in_its_range(lib):
    angle = np.float32(np.linspace(-1000.0, 1000.0, 1_000_003))
    (found,) = call(lib, "many_wrapped", angle, outputs=[len(angle)])
    assert on_circle(found - angle.astype(float)).max() < 3e-7
    assert np.abs(found).max() <= np.float32(np.pi) + 3e-7


def test_decay(lib):
    x = np.float32(np.concatenate([np.linspace(0, 1, 100_001), np.geomspace(1e-9, 1e9, 100_001)]))
    (found,) = call(lib, "many_decay", x, outputs=[len(x)])
    assert np.abs(found + np.expm1(-x.astype(float))).max() < 2e-7
    small = x < 0.5
    exact = -np.expm1(-x[small].astype(float))
    np.testing.assert_allclose(found[small], exact, rtol=2e-7)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e30, -1e30])
def test_what_is_no_angle_gives_no_nonsense(lib, value):
    sine, cosine = call(lib, "many_sin_cos", [value], outputs=[1, 1])
    (wrapped,) = call(lib, "many_wrapped", [value], outputs=[1])
    if np.isfinite(value):
        assert (sine[0], cosine[0], wrapped[0]) == (0.0, 1.0, 0.0)
    else:
        assert np.isnan([sine[0], cosine[0], wrapped[0]]).all()
    assert call(lib, "many_atan2", [0.0], [0.0], outputs=[1])[0][0] == 0.0
    assert np.isnan(call(lib, "many_atan2", [np.nan], [1.0], outputs=[1])[0][0])


def test_angles_of_quaternions(lib, rng):
    q = quaternion_normalize(rng.normal(size=(200_000, 4))).astype(np.float32)
    (found,) = call(lib, "many_angles", q, outputs=[(len(q), 3)])
    expected = roll_pitch_yaw(quaternion_normalize(q.astype(float)))
    level = np.abs(expected[:, 1]) < np.radians(80)
    assert on_circle(found - expected)[level].max() < 2e-6
    assert np.abs(found - expected)[:, 1].max() < 5e-7


def test_pitch_keeps_its_digits_at_the_pole(lib):
    pitch = np.radians(90) - np.geomspace(1e-5, 1e-2, 1000)
    angles = np.column_stack([np.full(1000, 0.3), pitch, np.full(1000, -0.5)])
    q = attitude_from_angles(angles)
    (found,) = call(lib, "many_angles", q, outputs=[(1000, 3)])
    assert np.abs(found[:, 1] - pitch).max() < 5e-7


def test_angles_there_and_back(lib, rng):
    angles = rng.uniform([-3.1, -1.5, -3.1], [3.1, 1.5, 3.1], (100_000, 3)).astype(np.float32)
    (q,) = call(lib, "many_attitudes", angles, outputs=[(len(angles), 4)])
    assert np.abs(q - attitude_from_angles(angles.astype(float))).max() < 3e-7
    assert np.abs(np.linalg.norm(q, axis=1) - 1).max() < 3e-7
