"""Every verdict on a recording is triggered by its fault, and by nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from sequential.errors import DataError
from sequential.noise import ImuNoise
from sequential.readers import read_imu
from sequential.sensors import Finding, ImuErrors, ImuRecording, simulate_imu, stationary, tumble
from sequential.sensors.health import failures, inspect

NOISE = ImuNoise(2e-4, 2e-3, 1e-5, 1e-4)
ERRORS = ImuErrors(NOISE, gyro_bias=(0.01, -0.02, 0.005), mag_sigma=0.3, gyro_lsb=1e-3, accel_lsb=5e-3)


@pytest.fixture(scope="module")
def sound():
    rng = np.random.default_rng(5)
    return simulate_imu(tumble(60.0, rng, rest=8.0, sway=0.02), rng, errors=ERRORS).recording


def told(recording, severity=None):
    return [str(f) for f in inspect(recording) if severity is None or f.severity == severity]


def changed(recording, sensor, change):
    values = np.array(getattr(recording, sensor))
    change(values)
    return replace(recording, **{sensor: values})


def assert_told(recording, severity, words):
    assert any(words in text for text in told(recording, severity)), told(recording)


def test_a_sound_recording_is_clean(sound):
    assert told(sound) == []


def test_a_long_still_recording_is_clean():
    rng = np.random.default_rng(6)
    still = simulate_imu(stationary(600.0), rng, errors=ERRORS).recording
    assert told(still, "fail") == told(still, "warn") == []


# --- the clock ---


def test_too_few_samples():
    few = ImuRecording(np.arange(5) * 0.01, gyro=np.random.default_rng(0).normal(size=(5, 3)))
    assert_told(few, "fail", "5 samples, which is too few")


def test_short(sound):
    assert_told(sound.slice(0.0, 4.0), "warn", "lasts 4 s")


def test_pause(sound):
    rows = np.r_[0:2000, 2450:6001]
    assert_told(
        sound.select(rows), "warn", "a pause in the recording, the longest of 4.51 s (t = 19.99-24.50 s)"
    )


def test_lost_samples(sound):
    rng = np.random.default_rng(2)
    kept = np.sort(rng.permutation(6001)[:5950])
    assert_told(sound.select(kept), "note", "samples (0.")
    kept = np.sort(rng.permutation(6001)[:5700])
    assert_told(sound.select(kept), "warn", "were lost in short gaps")


def test_jitter():
    rng = np.random.default_rng(7)
    loose = simulate_imu(tumble(30.0, rng, rest=5.0), rng, errors=ERRORS, jitter=0.003).recording
    assert_told(loose, "warn", "the interval between samples varies by")


def test_rate_change(sound):
    assert_told(
        sound.select(np.r_[0:3000, 3000:6001:2]), "warn", "the rate changes from 100 to 50 Hz (t = 30.0"
    )


# --- readings ---


def test_saturated_axis(sound):
    clipped = changed(sound, "gyro", lambda v: np.clip(v, -1.0, 1.0, out=v))
    assert_told(clipped, "fail", "saturates at 1 in")
    edge = float(np.quantile(sound.gyro[:, 0], 0.997))
    clipped = changed(sound, "gyro", lambda v: np.minimum(v, edge, out=v))
    assert_told(clipped, "warn", f"gyro x saturates at {edge:.5g}")


def test_a_smooth_peak_is_no_saturation():
    """Without noise, a quantised peak is flat for some samples, and yet no end of a range."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        quiet = ImuErrors(gyro_lsb=1e-3, accel_lsb=1e-2)
        assert not [
            text
            for text in told(simulate_imu(tumble(20.0, rng), rng, errors=quiet).recording)
            if "satur" in text
        ]


def test_stuck_axis(sound):
    assert_told(
        changed(sound, "accel", lambda v: v[:, 1].fill(0.3)), "fail", "accelerometer y is stuck: one value"
    )
    part = changed(sound, "gyro", lambda v: v[2000:2400, 2].fill(0.1))
    assert_told(part, "warn", "gyro z is stuck at one value for 4.0 s (t = 20.00-23.99 s)")
    assert told(part, "fail") == []
    assert_told(changed(sound, "gyro", lambda v: v[2000:5000, 2].fill(0.1)), "fail", "gyro z is stuck")


def test_frozen_sensor(sound):
    whole = changed(sound, "gyro", lambda v: v.__setitem__(slice(None), v[0]))
    assert_told(whole, "fail", "gyro gives the same reading from beginning to end")
    part = changed(sound, "accel", lambda v: v.__setitem__(slice(3000, 3500), v[3000]))
    assert_told(part, "warn", "accelerometer gives the same reading for 5.0 s")


def test_coarse_axis(sound):
    rough = changed(sound, "accel", lambda v: np.round(v / 0.6, out=v).__imul__(0.6))
    assert_told(rough, "note", "accelerometer z is coarse: a step is 0.6")


def test_repeated_samples(sound):
    held = sound.select(np.arange(0, 6001, 2))
    doubled = ImuRecording(
        np.arange(2 * len(held)) * 10_000_000,
        np.repeat(held.accel, 2, axis=0),
        np.repeat(held.gyro, 2, axis=0),
        np.repeat(held.mag, 2, axis=0),
    )
    assert_told(doubled, "warn", "of the samples repeat the one before: the sensor itself gives 50 Hz")


# --- units and signs ---


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (1 / 9.80665, "it is in g; read it with units accel=g"),
        (1000 / 9.80665, "thousandths of g"),
        (16384 / 9.80665, "these are counts"),
        (0.1 / 9.80665, "gravity was taken away"),
        (2.0, "state its unit"),
    ],
)
def test_accelerometer_in_another_unit(sound, factor, words):
    assert_told(replace(sound, accel=sound.accel * factor), "fail", words)


def test_accelerometer_out_of_calibration(sound):
    assert_told(replace(sound, accel=sound.accel * 0.85), "warn", "calibrate it")


def test_gyro_in_degrees(sound):
    assert_told(replace(sound, gyro=np.rad2deg(sound.gyro)), "fail", "it is in deg/s")
    alone = replace(sound, gyro=np.rad2deg(sound.gyro), accel=None)
    assert_told(alone, "fail", "which no gyro measures")


def test_resting_gyro_in_degrees():
    rng = np.random.default_rng(8)
    still = simulate_imu(stationary(60.0), rng, errors=ERRORS).recording
    assert_told(replace(still, gyro=np.rad2deg(still.gyro)), "fail", "rad/s while the accelerometer rests")


def test_gyro_taken_for_degrees(sound):
    assert_told(
        replace(sound, gyro=np.deg2rad(sound.gyro)), "fail", "its unit was taken as deg/s and is rad/s"
    )


def test_gyro_of_the_wrong_sign_or_range(sound):
    assert_told(replace(sound, gyro=-sound.gyro), "fail", "turns gravity the wrong way")
    assert_told(replace(sound, gyro=sound.gyro / 4.0), "warn", "times as far as the gyro does")


def test_counts_are_not_judged_by_gravity(sound):
    counted = replace(
        sound, accel=sound.accel * 1671, gyro=sound.gyro * 7506, accel_unit="counts", gyro_unit="counts"
    )
    assert told(counted) == []


# --- rest ---


def test_all_moving(sound):
    assert_told(sound.slice(12.0, 60.0), "warn", "moves all the time")


# --- magnetometer ---


def test_no_magnetometer(sound):
    assert_told(replace(sound, mag=None), "note", "there is no magnetometer")
    assert told(replace(sound, mag=None), "fail") == []


def test_constant_magnetometer(sound):
    constant = replace(sound, mag=np.tile([10.0, 20.0, -40.0], (len(sound), 1)))
    assert_told(constant, "fail", "the magnetometer gives one reading")
    resting = constant.slice(0.0, 8.0)
    assert told(resting, "fail") == []
    assert_told(resting, "warn", "nothing turned")


def test_magnetometer_that_never_reads(sound):
    assert_told(changed(sound, "mag", lambda v: v[3:].fill(np.nan)), "fail", "3 readings in 6001 samples")


def test_field_that_is_not_the_earths(sound):
    assert_told(replace(sound, mag=sound.mag * 100.0), "warn", "where the Earth has 25 to 65")
    bent = replace(sound, mag=sound.mag + np.array([30.0, 0.0, 0.0]))
    assert_told(bent, "note", "varies by")


def test_saturated_magnetometer(sound):
    clipped = changed(sound, "mag", lambda v: np.clip(v, -30.0, 30.0, out=v))
    assert_told(clipped, "fail", "magnetometer")


# --- what the reader says, order, and the end of a command ---


def test_findings_of_the_reader_come_along_and_the_worst_first(sound):
    said = (Finding("note", "units were guessed"),)
    found = inspect(replace(sound, findings=said, accel=sound.accel / 9.81))
    assert [f.severity for f in found] == sorted(
        (f.severity for f in found), key=["fail", "warn", "note"].index
    )
    assert said[0] in found


def test_failures_become_one_error(sound):
    assert failures(inspect(sound)) is None
    error = failures(inspect(replace(sound, accel=sound.accel / 9.80665)), "phone.csv")
    assert isinstance(error, DataError)
    assert str(error).startswith("phone.csv cannot be used: the accelerometer shows 1.0")


def test_real_recordings_do_not_fail(data_dir):
    for path in sorted((data_dir / "imu").glob("*/*.[cn][sp][vz]")):
        recording = read_imu(path, rate=102.4 if path.parent.name == "imucal" else None)
        assert told(recording, "fail") == [], path


def test_the_saturated_gyro_of_a_real_recording(data_dir):
    imu = read_imu(data_dir / "imu" / "mpu6050" / "example_data_calibration.csv")
    said = told(imu, "warn")
    assert len(said) == 2
    assert all("saturates at -4.3657" in text for text in said)
