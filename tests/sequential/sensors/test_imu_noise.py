"""From a still recording to the noise of a filter, and to Kalibr's file."""

import numpy as np
import pytest
from noise_worlds import still_sensor

from sequential.errors import DataError, MissingStreamError
from sequential.noise import ImuNoise
from sequential.readers import read_kalibr_imu, write_kalibr_imu
from sequential.sensors import (
    ImuErrors,
    ImuRecording,
    allan_deviation,
    imu_noise,
    simulate_imu,
    stationary,
)

RATE = 100.0
SENSORS = {"accel": {"N": 3e-3, "K": 2e-3}, "gyro": {"N": 1e-4}}


def still(rng, count=12_000, *, t=None, sensors=("accel", "gyro")):
    arrays = {
        name: np.stack([still_sensor(rng, count, RATE, **SENSORS[name]) for _ in range(3)], axis=1)
        for name in sensors
    }
    if "accel" in arrays:
        arrays["accel"] += [0.0, 0.0, 9.81]
    return ImuRecording(t=np.arange(count) / RATE if t is None else t, name="desk", **arrays)


def test_densities_are_those_of_the_sensor(rng):
    report = imu_noise(still(rng))
    assert report.noise.gyro_density == pytest.approx(1e-4, rel=0.02)
    assert report.noise.accel_density == pytest.approx(3e-3, rel=0.02)
    assert report.noise.accel_bias_walk == pytest.approx(2e-3, rel=0.3)
    assert report.bounds == ("gyro_bias_walk",)
    assert report.noise.gyro_bias_walk < 1e-4
    assert report.rate == pytest.approx(RATE)
    assert not report.notes
    assert report.fits["gyro"][2].unit == "rad/s"
    assert report.deviations["accel"].deviation.shape == (len(report.deviations["accel"].tau), 3)


def test_what_is_simulated_is_read_back(rng):
    given = ImuNoise(gyro_density=2e-3, accel_density=1e-2, gyro_bias_walk=2e-3, accel_bias_walk=1e-2)
    recording, _ = simulate_imu(stationary(200.0), rng, errors=ImuErrors(noise=given))
    report = imu_noise(recording)
    assert not report.bounds
    for name, tolerance in (
        ("gyro_density", 0.03), ("accel_density", 0.03), ("gyro_bias_walk", 0.25), ("accel_bias_walk", 0.25)
    ):  # fmt: skip
        assert getattr(report.noise, name) == pytest.approx(getattr(given, name), rel=tolerance)


def test_one_sensor_alone_gives_its_fits(rng):
    report = imu_noise(still(rng, 500, sensors=("gyro",)))
    assert report.noise is None
    assert list(report.fits) == ["gyro"]


def test_the_longest_stretch_is_used(rng):
    t = np.arange(6000) / RATE
    t[1000:] += 2.0
    report = imu_noise(still(rng, 6000, t=t))
    assert report.duration == pytest.approx(49.99)
    assert "pauses 1 times; the longest stretch without a pause, 49.99 s of 61.99 s" in report.notes[0]


def test_where_it_moves_the_longest_still_part_is_used(rng):
    whole = still(rng)
    turned = np.array(whole.gyro)
    turned[3000:3200] += np.sin(np.linspace(0.0, np.pi, 200))[:, None]
    report = imu_noise(ImuRecording(t=whole.t, accel=whole.accel, gyro=turned, name="desk"))
    assert "not still throughout: 32 to 120 s of 120 s was used" in report.notes[0]
    assert report.noise.gyro_density == pytest.approx(1e-4, rel=0.02)


@pytest.mark.parametrize("rate", [10.0, 100.0, 1000.0])
def test_a_noisy_recording_is_still(rate, rng):
    count = round(300 * rate)
    gyro = np.stack(
        [still_sensor(rng, count, rate, N=1e-3, B=1e-2, K=1e-2, Q=1e-5, R=1e-4) for _ in range(3)], 1
    )
    assert not imu_noise(ImuRecording(t=np.arange(count) / rate, gyro=gyro)).notes


@pytest.mark.parametrize("sigma", [0.15, 0.2, 0.25, 0.3])
def test_a_coarse_recording_is_still(sigma, rng):
    gyro = 0.001 * np.round(sigma * rng.standard_normal((20_000, 3)))
    assert not imu_noise(ImuRecording(t=np.arange(20_000) / RATE, gyro=gyro)).notes


def moving(rng):
    t = np.arange(3000) / RATE
    return ImuRecording(t=t, gyro=np.sin(np.outer(t, [2.0, 3.0, 4.0])) * np.sin(t)[:, None] ** 8, name="hand")


def test_a_few_lost_samples_are_said_and_do_no_harm(rng):
    whole = still(rng)
    kept = np.delete(np.arange(12_000), rng.choice(11_000, 60, replace=False) + 500)
    report = imu_noise(whole.select(kept))
    assert "are missing; the others were taken as evenly spaced" in report.notes[0]
    assert report.noise.gyro_density == pytest.approx(1e-4, rel=0.02)


def test_jitter_of_the_stamps_does_no_harm(rng):
    t = np.arange(12_000) / RATE + rng.uniform(-0.002, 0.002, 12_000)
    report = imu_noise(still(rng, t=t))
    assert report.noise.accel_density == pytest.approx(3e-3, rel=0.02)


def change_of_rate(rng):
    return still(rng, 2000, t=np.cumsum(np.where(np.arange(2000) < 1200, 0.01, 0.02)))


def pauses(rng):
    return still(rng, 300, t=np.arange(300) * 0.01 + 0.5 * (np.arange(300) // 50))


def stuck(rng):
    whole = still(rng, 500)
    gyro = np.array(whole.gyro)
    gyro[:, 1] = 0.125
    return ImuRecording(t=whole.t, accel=whole.accel, gyro=gyro, name="desk")


def magnetometer(rng):
    return ImuRecording(t=np.arange(100) / RATE, mag=rng.standard_normal((100, 3)))


def raw(rng):
    return ImuRecording(t=np.arange(100) / RATE, gyro=rng.standard_normal((100, 3)), gyro_unit="counts")


@pytest.mark.parametrize(
    ("make", "error", "says"),
    [
        (change_of_rate, DataError, "changes from 100 to 50 Hz; give a part of one rate"),
        (pauses, DataError, "pauses 5 times, and no stretch between has 64 samples"),
        (lambda rng: still(rng, 40), DataError, "has 40 samples; reading its noise needs 64"),
        (stuck, DataError, "gyro y of recording 'desk': all 500 samples are 0.125: the axis is stuck"),
        (magnetometer, MissingStreamError, "neither gyro nor accelerometer"),
        (moving, DataError, "recording 'hand' moves: its longest still part lasts 1 s; lay the sensor down"),
        (raw, DataError, "in counts, rad/s is needed here"),
    ],
)
def test_bad_recordings_are_answered_by_a_sentence(make, error, says, rng):
    with pytest.raises(error, match=says):
        imu_noise(make(rng))


def test_kalibr_s_file_gives_the_same_noise_back(rng, tmp_path):
    report = imu_noise(still(rng, 1000))
    path = tmp_path / "imu.yaml"
    write_kalibr_imu(path, report.noise, report.rate, topic="/imu", comment="still for 10 s\non the desk")
    assert path.read_text().startswith("# still for 10 s\n# on the desk\naccelerometer_noise_density: ")
    back = read_kalibr_imu(path)
    assert back.topic == "/imu"
    assert back.rate == pytest.approx(report.rate, rel=1e-12)
    for name in ("gyro_density", "accel_density", "gyro_bias_walk", "accel_bias_walk"):
        assert getattr(back.noise, name) == pytest.approx(getattr(report.noise, name), rel=1e-9)


# a still MPU-6050, deg/s/√Hz, as a line of slope -1/2 through the deviations of 0.05 to 5 s gives them
MPU_6050 = np.array([0.00751, 0.01123, 0.00934])


def test_a_real_recording(data_dir):
    rows = np.loadtxt(data_dir / "imu/mpu6050/example_data_tinit_calc.csv", delimiter=",", skiprows=5)
    recording = ImuRecording(
        t=np.arange(len(rows)) / RATE,
        accel=rows[:, :3] / 16384 * 9.80665,
        gyro=np.radians(rows[:, 3:] / 131),
        name="mpu6050",
    )
    report = imu_noise(recording)
    found = np.degrees([fit.N.value for fit in report.fits["gyro"]])
    assert found == pytest.approx(MPU_6050, rel=0.02)
    deviation = allan_deviation(recording.gyro, RATE, taus=[1.0])
    assert np.degrees(deviation.deviation[0]) == pytest.approx(MPU_6050, rel=0.015)
    # seven minutes show white noise only
    assert not any(fit.B.visible for fit in report.fits["gyro"])
    assert report.bounds
    assert all("not visible in 7.49 min" in " ".join(fit.notes) for fit in report.fits["gyro"])
