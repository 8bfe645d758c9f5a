import numpy as np
import pytest
from dwell_worlds import attitudes, mpu6050, recorded, xsens

from sequential.errors import DataError, MissingStreamError
from sequential.noise import ImuNoise
from sequential.readers import read_broad
from sequential.sensors import (
    ImuRecording,
    StillDetector,
    find_dwells,
    join_recordings,
    simulate_imu,
    stationary,
)
from sequential.sensors.still import window_variance

GRAVITY = np.array([0.0, 0.0, 9.8])


def test_window_variance_is_the_variance_of_the_window(rng):
    values, count = rng.standard_normal((60, 3)) + 100.0, 11
    found = window_variance(values, count)
    for k in (5, 20, 54):
        assert found[k] == pytest.approx(values[k - 5 : k + 6].var(axis=0).sum(), rel=1e-9)
    assert found[0] == found[5]
    assert found[-1] == found[54]


@pytest.mark.parametrize("initial", [None, 2.0])
def test_dwells_are_found_where_they_are(rng, initial):
    imu, truth = recorded(attitudes(8, rng), rng, dwell=3.0, travel=1.0)
    found = StillDetector(initial=initial).find(imu)
    assert len(found) == 8
    for k, rows in enumerate(found):
        assert truth.rest[rows[3:-3]].all()  # a turn begins gently
        assert len(rows) > 200
        assert (rows[0] + 3) // 400 == k


def test_short_dwells_are_enough(rng):
    imu, _ = recorded(attitudes(12, rng), rng, dwell=1.2, travel=0.7)
    assert len(StillDetector().find(imu)) == 12
    assert not StillDetector(shortest=2.0).find(imu)


def test_a_scale_of_the_readings_changes_nothing(rng):
    imu, _ = recorded(attitudes(5, rng), rng)
    raw = ImuRecording(imu.t, imu.accel * 1000.0, accel_unit="counts")
    for a, b in zip(StillDetector().find(imu), StillDetector().find(raw), strict=True):
        np.testing.assert_array_equal(a, b)


def test_a_vibrating_support_is_as_still_as_it_gets(rng):
    imu, _ = recorded(attitudes(8, rng), rng, dwell=3.0, travel=1.0)
    hum = 0.3 * np.sin(2 * np.pi * 23.0 * imu.seconds)[:, None] * [1.0, 0.5, 0.2]
    found = StillDetector().find(ImuRecording(imu.t, imu.accel + hum, imu.gyro))
    assert len(found) == 8


def test_a_turn_at_constant_rate_is_no_rest(rng):
    rate = np.repeat([0.0, 0.5, 0.0], 300)[:, None] * [0.0, 0.0, 1.0]
    gyro = rate + 0.01 + 1e-3 * rng.standard_normal((900, 3))
    accel = GRAVITY + 1e-2 * rng.standard_normal((900, 3))  # turns about the vertical: nothing to see
    for given in (None, accel):
        found = StillDetector().find(ImuRecording(np.arange(900) * 0.01, given, gyro))
        assert [one[0] // 300 for one in found] == [0, 2]
        assert all(((one < 303) | (one > 596)).all() for one in found)


def test_a_knock_does_not_end_a_dwell(rng):
    noise = ImuNoise(1e-4, 2e-3, 0.0, 0.0)
    imu, _ = recorded(attitudes(4, rng), rng, dwell=6.0, travel=1.0, noise=noise)
    accel = imu.accel.copy()
    accel[300:305] += 8.0
    found = StillDetector().find(ImuRecording(imu.t, accel, imu.gyro))
    assert len(found) == 4
    assert not {300, 302, 304} & set(found[0].tolist())
    assert found[0][0] < 50
    assert found[0][-1] > 500


def test_covariance_of_a_mean_counts_correlation(rng):
    """Sensor noise that is filtered: means scatter more than independent samples would."""
    means, claimed = [], []
    for _ in range(40):
        white = rng.standard_normal((400, 3))
        for k in range(1, 400):
            white[k] += 0.8 * white[k - 1]
        rest = ImuRecording(np.arange(400) * 0.01, white + GRAVITY)
        dwells = find_dwells(rest)
        means.append(dwells.accel[0] - GRAVITY)
        claimed.append(np.trace(dwells.accel_cov[0]) / 3)
    assert 0.5 < np.mean(claimed) / np.mean(np.square(means)) < 1.6


def test_recordings_of_one_position_each_are_joined(rng):
    parts = [simulate_imu(stationary(2.0, q), rng, field=None).recording for q in attitudes(3, rng)]
    whole, dwells = join_recordings(parts)
    assert len(whole) == sum(len(one) for one in parts)
    assert dwells.part.tolist() == [0, 1, 2]
    for k, one in enumerate(parts):
        np.testing.assert_allclose(dwells.accel[k], one.accel.mean(axis=0))
        np.testing.assert_array_equal(whole.accel[dwells.start[k]], one.accel[0])


def test_bad_input_is_named(rng):
    imu, _ = recorded(attitudes(3, rng), rng)
    with pytest.raises(DataError, match="record for longer"):
        StillDetector().find(imu.slice(0.0, 0.2))
    with pytest.raises(DataError, match="less than two windows"):
        StillDetector(initial=0.6).find(imu)
    with pytest.raises(DataError, match="more than zero"):
        StillDetector(window=0.0)
    with pytest.raises(MissingStreamError, match="neither"):
        StillDetector().find(ImuRecording(imu.t, mag=imu.accel))
    with pytest.raises(DataError, match="nowhere still"):
        find_dwells(imu, StillDetector(shortest=30.0))
    with pytest.raises(DataError, match="differ in sensors"):
        join_recordings([imu, ImuRecording(imu.t, imu.accel)])


@pytest.mark.data
@pytest.mark.parametrize("trial", ["05", "07", "16", "24", "27", "34"])
def test_rest_is_found_where_motion_is_more_common(data_dir, trial):
    (path,) = (data_dir / "imu" / "broad").glob(f"{trial}_*.npz")
    recording, truth = read_broad(path)
    still = np.zeros(len(recording), dtype=bool)
    for rows in StillDetector().find(recording):
        still[rows] = True
    assert truth.movement[still].mean() < 0.05
    assert still[~truth.movement].mean() > 0.9


@pytest.mark.data
def test_real_dwells(data_dir):
    assert len(StillDetector().find(mpu6050(data_dir, "example_data_calibration"))) == 10
    assert len(StillDetector(initial=30.0).find(mpu6050(data_dir, "example_data_calibration"))) == 10
    assert len(StillDetector().find(mpu6050(data_dir, "imu_90_x_rot"))) == 2
    assert len(StillDetector().find(mpu6050(data_dir, "imu_static_test"))) == 1
    assert len(StillDetector().find(xsens(data_dir))) == 38
