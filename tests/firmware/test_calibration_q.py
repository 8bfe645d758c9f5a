"""Calibration in fixed point: exact integers, the double calibration, and the header of constants."""

import ctypes
import hashlib
import re
import subprocess

import numpy as np
import pytest
from core_library import CORE, AffineQ, Axes, Axes16, ImuQ, ImuRaw, compiled

from factorlab.firmware.build import constants_header
from sequential.errors import DataError
from sequential.sensors import (
    AffineCalibration,
    ImuCalibration,
    c_header,
    calibration_hash,
    nominal_calibration,
    other_ranges,
)

EDGES = (-(2**31), -(2**31) + 1, -1, 0, 1, 2**31 - 1)
EDGES16 = (-(2**15), -(2**15) + 1, -1, 0, 1, 2**15 - 1)


@pytest.fixture(scope="session")
def core(c_compiler, tmp_path_factory):
    return compiled(c_compiler, tmp_path_factory.mktemp("calibration_q"), "calibration_q.c")


def affine(matrix, shift):
    return AffineQ((Axes * 3)(*(Axes(*map(int, row)) for row in matrix)), Axes(*map(int, shift)))


def exact(matrix, shift, raw):
    """What the header promises, in integers without an end: Q24 and Q8."""
    q24 = []
    for row, by in zip(matrix, shift, strict=True):
        total = sum(int(m) * int(r) for m, r in zip(row, raw, strict=True))
        q24.append(min(max((total + 128) // 256 - int(by), -(2**31)), 2**31 - 1))
    return q24, [min((q + 2**15) // 2**16, 2**15 - 1) for q in q24]


def test_equals_integers_of_any_length(core, rng):
    for k in range(3000):
        if k % 2:
            matrix, shift, raw = rng.choice(EDGES, (3, 3)), rng.choice(EDGES, 3), rng.choice(EDGES16, 3)
        else:
            matrix, shift = rng.integers(-(2**25), 2**25, (3, 3)), rng.integers(-(2**27), 2**27, 3)
            raw = rng.integers(-(2**15), 2**15, 3)
        fine, coarse = Axes(), Axes16()
        core.calibrate_q24(ctypes.byref(affine(matrix, shift)), Axes16(*map(int, raw)), fine)
        core.calibrate_q8(ctypes.byref(affine(matrix, shift)), Axes16(*map(int, raw)), coarse)
        assert (list(fine), list(coarse)) == exact(matrix, shift, raw)


def written(rng, kind, gain):
    """A calibration in counts as a real one: misalignment of a few percent, offset of some hundred counts."""
    matrix = gain * (np.eye(3) + 0.03 * rng.standard_normal((3, 3)))
    unit = {"accel": "m/s^2", "gyro": "rad/s", "mag": "uT"}[kind]
    return AffineCalibration(matrix, 200 * rng.standard_normal(3), None, kind, "counts", unit)


def constants(header, name):
    """Of struct affine_q, as the text says them."""
    body = re.search(rf"affine_q {name} = \{{(.*?)\}};", header, re.DOTALL)[1]
    numbers = [int(number) for number in re.findall(r"-?\d+(?=L)", body)]
    return np.reshape(numbers[:9], (3, 3)), numbers[9:]


@pytest.mark.parametrize(("kind", "gain", "unit"), [("gyro", 1.06e-3, 2**-24), ("accel", 2.4e-3, 2**-8)])
def test_equals_the_double_calibration_to_its_rounding(core, rng, kind, gain, unit):
    one = written(rng, kind, gain)
    both = affine(*constants(c_header([one]), f"{kind}_calibration_q"))
    output, function = (Axes, core.calibrate_q24) if kind == "gyro" else (Axes16, core.calibrate_q8)
    worst = 0.0
    for raw in rng.integers(-12000, 12000, (2000, 3)):
        found = output()
        function(ctypes.byref(both), Axes16(*map(int, raw)), found)
        worst = max(worst, np.abs(np.array(found) * unit - one.apply(raw)).max())
    assert worst <= 0.5 * unit + 3 * 2.0**15 * 2.0**-33 + 2.0**-25
    assert worst > 0.45 * unit


def test_a_reading_of_zeros_stays_none(core, rng):
    header = c_header([written(rng, kind, 1e-3) for kind in ("gyro", "accel", "mag")])
    gyro, accel, mag = (affine(*constants(header, f"{k}_calibration_q")) for k in ("gyro", "accel", "mag"))
    raw, sample = ImuRaw(Axes16(0, 0, 0), Axes16(0, 0, 0), Axes16(0, 0, 0)), ImuQ()
    core.calibrate_q(*(ctypes.byref(one) for one in (gyro, accel, mag, raw, sample)))
    assert not any(sample.accel) and not any(sample.mag)  # noqa: PT018 - both or neither
    assert all(sample.gyro), "a gyro that reads zeros turns at minus its bias"
    raw.accel[2], raw.mag[0] = 4096, 1
    core.calibrate_q(*(ctypes.byref(one) for one in (gyro, accel, mag, raw, sample)))
    assert any(sample.accel)
    assert any(sample.mag)
    core.calibrate_q(
        *(ctypes.byref(one) for one in (gyro, accel)), None, ctypes.byref(raw), ctypes.byref(sample)
    )
    assert not any(sample.mag)


def test_the_default_header_is_what_c_header_writes(firmware_dir):
    path = firmware_dir / "app" / "calibration_default.h"
    text = path.read_text(encoding="utf-8")
    source = re.search(r"Source: (.*)", text)[1]
    assert text == c_header(None, source=source, guard="FACTORLAB_CALIBRATION_DEFAULT_H"), "write it anew"
    assert "FACTORLAB_CALIBRATION_HASH 0x00000000UL" in text


def test_the_header_goes_with_the_core_on_every_compiler(
    c_compiler, arm_toolchain, avr_toolchain, rng, tmp_path
):
    imu = ImuCalibration(written(rng, "accel", 2e-3), written(rng, "gyro", 1e-3), written(rng, "mag", 0.1))
    (tmp_path / "calibration.h").write_text(c_header(imu), encoding="utf-8")
    (tmp_path / "t.c").write_text(
        '#include "calibration.h"\n#include "calibration_q.h"\n#include "calibration.h"\n'
        "int32_t t(void);\nint32_t t(void) { return gyro_calibration_q.shift[0] + (int32_t)(\n"
        "gyro_calibration_f32.offset[0] + accel_calibration_f32.offset[0] +\n"
        "mag_calibration_f32.offset[0]) +\n"
        "(int32_t)FACTORLAB_CALIBRATION_HASH + accel_calibration_q.shift[1] + mag_calibration_q.shift[2]; }\n"
    )
    for compiler in (
        [c_compiler],
        [arm_toolchain, "-mcpu=cortex-m4", "-mthumb"],
        [avr_toolchain, "-mmcu=atmega328p"],
    ):
        subprocess.run(
            [*compiler, "-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", f"-I{CORE}", "-c", "t.c"],
            cwd=tmp_path,
            check=True,
        )  # fmt: skip


def test_hash_is_that_of_the_file(rng, tmp_path):
    imu = ImuCalibration(written(rng, "accel", 2e-3))
    digest = hashlib.sha256(imu.save(tmp_path / "calibration.json").read_bytes()).hexdigest()
    assert f"{calibration_hash(imu):08x}" == digest[:8]
    assert f"HASH 0x{digest[:8]}UL" in c_header(imu)


def test_readings_in_si_become_counts_of_the_driver(rng):
    """A calibration of recordings in m/s² is written for the counts that the driver will read."""
    gain, nominal = np.eye(3) + 0.02 * rng.standard_normal((3, 3)), nominal_calibration().accel.matrix[0, 0]
    one = AffineCalibration(gain, np.array([0.3, -0.2, 0.1]), None, "accel")
    header = c_header([one])
    matrix, shift = constants(header, "accel_calibration_q")
    np.testing.assert_allclose(matrix * 2.0**-32, gain * nominal, atol=2.0**-33)
    np.testing.assert_allclose(np.array(shift) * 2.0**-24, gain @ one.offset, atol=2.0**-25)
    assert "not calibrated" in header, "the gyro has the gain of its data sheet"
    assert constants(header, "gyro_calibration_q")[0][0, 0] == round(np.radians(2000) / 2**15 * 2**32)


def test_counts_of_another_range_are_noticed(tmp_path):
    """Recorded at ±2 g and ±250 °/s: right by itself, wrong for a driver at ±8 g and ±2000 °/s."""
    nominal = nominal_calibration()
    imu = ImuCalibration(nominal.accel.with_counts(0.25), nominal.gyro.with_counts(0.125))
    assert other_ranges(imu) == pytest.approx({"accel": 0.25, "gyro": 0.125})
    assert "another range: one is 0.125 of the firmware's driver" in c_header(imu)
    with pytest.raises(DataError, match=r"one is 0\.25 of the firmware's"):
        constants_header(imu, tmp_path)
    assert not other_ranges(nominal)
    assert "another range" not in c_header(nominal)


def test_what_does_not_fit_is_said_in_the_header():
    header = c_header([AffineCalibration(np.eye(3), np.zeros(3), None, "mag", "counts", "counts")])
    assert "no mag_calibration_q: 1 is not within +-0.5 (Q32)" in header
    assert "affine_f32 mag_calibration_f32" in header
