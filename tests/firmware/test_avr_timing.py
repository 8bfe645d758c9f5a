"""What an image promises: when frames leave, how long after their sample, and that none is lost."""

import numpy as np
import pytest

from factorlab.datasets.recordings import open_recording
from factorlab.firmware.avr import emulate_avr
from factorlab.firmware.emulation import mpu6050_counts
from sequential.sensors import AffineCalibration, ImuCalibration, c_header

MANY, FEW = 10_000, 2000
JITTER_S = 2e-6  # the issue: 8 us, 2 aimed at
LATENCY_S = {"q": 500e-6, "a": 1e-3}  # the issue's


@pytest.fixture(scope="module")
def moving(data_dir):
    """A recording of fast turns, from its start at rest on."""
    return mpu6050_counts(open_recording("broad:07").recording)


@pytest.fixture(scope="module")
def full_header(tmp_path_factory):
    """Constants without a zero: the longest calibration there is."""
    skewed = np.eye(3) + 0.01 * np.array([[0.3, 0.5, -0.4], [-0.2, 0.1, 0.6], [0.7, -0.3, -0.5]])
    offset = np.array([0.02, -0.03, 0.01])
    gyro = AffineCalibration(skewed, offset, None, "gyro", "rad/s", "rad/s")
    accel = AffineCalibration(skewed.T, 10.0 * offset)
    path = tmp_path_factory.mktemp("calibration") / "full.h"
    path.write_text(c_header(ImuCalibration(accel, gyro)), encoding="utf-8")
    return path


@pytest.mark.parametrize("mode", ["q", "a"])
def test_frames_are_punctual(avr_image, avr_simulator, moving, mode):
    emulation = emulate_avr(avr_image(FILTER="mahony_q"), moving[:FEW], mode=mode, simulator=avr_simulator)
    assert emulation.lost == emulation.corrupt == 0
    assert np.abs(emulation.jitter).max() <= JITTER_S
    assert emulation.latency.max() <= LATENCY_S[mode]


@pytest.mark.parametrize("mode", ["q", "a"])
def test_frames_are_punctual_with_a_full_calibration(avr_image, avr_simulator, moving, full_header, mode):
    image = avr_image(FILTER="mahony_q", CALIBRATION=str(full_header))
    emulation = emulate_avr(image, moving[:FEW], mode=mode, simulator=avr_simulator)
    assert emulation.boot.calibration_hash != 0
    assert emulation.lost == emulation.corrupt == 0
    assert np.abs(emulation.jitter).max() <= JITTER_S
    assert emulation.latency.max() <= LATENCY_S[mode]


@pytest.mark.slow
def test_none_of_ten_thousand_frames_is_lost(avr_image, avr_simulator, moving, pytestconfig):
    emulation = emulate_avr(avr_image(FILTER="mahony_q"), moving[:MANY], simulator=avr_simulator)
    assert len(emulation.frames) == MANY
    assert emulation.lost == emulation.corrupt == 0
    assert not emulation.missing.any()
    assert np.abs(emulation.jitter).max() <= JITTER_S
    assert emulation.latency.max() <= LATENCY_S["q"]
