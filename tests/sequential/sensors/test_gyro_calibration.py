import numpy as np
import pytest
from dwell_worlds import (
    ACCEL_MATRIX,
    ACCEL_OFFSET,
    GYRO_BIAS,
    GYRO_MATRIX,
    attitudes,
    mpu6050,
    recorded,
    xsens,
)

from sequential.errors import DataError, UnderConstrainedError
from sequential.manifold.quaternion import quaternion_exp, quaternion_log, quaternion_multiply
from sequential.sensors import (
    SIX_POSITIONS,
    AffineCalibration,
    GyroBetweenDwells,
    ImuCalibration,
    ImuRecording,
    KnownTurn,
    MultiPosition,
    bias_at_rest,
    find_dwells,
    turn_gains,
    verify,
)
from sequential.sensors.gyro_case import GyroCase
from sequential.sensors.gyro_integral import GyroIntervals, saturated, turned, whole_rotation

TRUE_ACCEL = AffineCalibration(ACCEL_MATRIX, ACCEL_OFFSET)


def spun(axis, degrees):
    """Attitudes before and after turns about an axis of the body, one for each angle."""
    q = [np.array([1.0, 0.0, 0.0, 0.0])]
    for angle in np.radians(degrees):
        q.append(quaternion_multiply(q[-1], quaternion_exp(angle * np.eye(3)[axis])))
    return np.array(q)


def test_derivatives_of_a_turn_meet_differences(rng):
    intervals = GyroIntervals(rng.standard_normal((3, 7, 3)), rng.uniform(0.0, 0.3, (3, 7)), np.zeros(3, int))
    matrix, offset = np.eye(3) + 0.1 * rng.standard_normal((3, 3)), 0.3 * rng.standard_normal(3)
    base = turned(matrix, offset, intervals)

    def seen(x):
        q = turned(x[:9].reshape(3, 3), x[9:], intervals).quaternion
        return quaternion_log(quaternion_multiply(base.quaternion * [1, -1, -1, -1], q))

    x, step = np.r_[matrix.ravel(), offset], 1e-6
    J = np.stack([(seen(x + step * e) - seen(x - step * e)) / (2 * step) for e in np.eye(12)], axis=-1)
    np.testing.assert_allclose(np.concatenate([base.by_matrix, base.by_offset], axis=2), J, atol=1e-8)


def test_a_turn_is_a_product_of_its_steps(rng):
    raw, dt = rng.standard_normal((1, 9, 3)), rng.uniform(0.1, 0.3, (1, 9))
    q = np.array([1.0, 0.0, 0.0, 0.0])
    for k in range(9):
        q = quaternion_multiply(q, quaternion_exp(raw[0, k] * dt[0, k]))
    whole = turned(np.eye(3), np.zeros(3), GyroIntervals(raw, dt, np.zeros(1, int)))
    np.testing.assert_allclose(whole.quaternion[0], q, atol=1e-13)
    for count in (1, 2, 5, 8, 9):
        part = GyroIntervals(raw[:, :count], dt[:, :count], np.zeros(1, int))
        alone = whole_rotation(np.eye(3), np.zeros(3), part)
        np.testing.assert_allclose(alone, turned(np.eye(3), np.zeros(3), part).rotation, atol=1e-13)


def test_residuals_of_the_moves_meet_differences(rng):
    imu, _ = recorded(attitudes(4, rng), rng)
    dwells = find_dwells(imu)
    root = 1e-2 * rng.standard_normal((12, 12))
    accel = AffineCalibration(ACCEL_MATRIX, ACCEL_OFFSET, root @ root.T)
    case = GyroCase.of(imu, dwells, accel, bias_at_rest(dwells), np.arange(len(dwells) - 1), 0.3)
    x = np.concatenate([GYRO_MATRIX.ravel(), GYRO_BIAS, 0.5 * rng.standard_normal(12)])
    _, J = case.residuals(x)
    step = 1e-5
    ends = [(case.residuals(x + step * e)[0], case.residuals(x - step * e)[0]) for e in np.eye(24)]
    differenced = np.stack([(a - b) / (2 * step) for a, b in ends], axis=1)
    np.testing.assert_allclose(J, differenced, atol=2e-7)
    refined = case.refined(x, np.eye(24))
    np.testing.assert_allclose(refined.cov, accel.cov, atol=1e-12)


def test_moves_show_what_positions_hide(rng):
    """Axes up and down alone leave the accelerometer's shears open; the gyro sees more."""
    axes = np.concatenate(
        [SIX_POSITIONS, SIX_POSITIONS[[0, 2, 4, 1, 3, 5]], SIX_POSITIONS[[4, 0, 3, 5, 1, 2]]]
    )
    imu, _ = recorded(axes, rng)
    dwells = find_dwells(imu)
    accel = MultiPosition().calibrate(dwells)
    assert accel.fit.kept[3:6].max() > 0.9
    done = GyroBetweenDwells().calibrate(imu, dwells, accel.calibration, used=accel.used)
    shears = np.array([3, 6, 7])
    before, after = (np.sqrt(np.diag(one.cov))[shears] for one in (accel.calibration, done.accel))
    assert (after < 0.7 * before).all()
    assert (np.abs((done.accel.matrix - ACCEL_MATRIX).ravel()[shears]) < 3 * after).all()


def test_truth_is_found_between_dwells(rng):
    imu, _ = recorded(attitudes(25, rng), rng)
    dwells = find_dwells(imu)
    accel = MultiPosition().calibrate(dwells)
    done = GyroBetweenDwells().calibrate(imu, dwells, accel.calibration, used=accel.used)
    np.testing.assert_allclose(done.calibration.matrix, GYRO_MATRIX, atol=1e-3)
    np.testing.assert_allclose(done.calibration.offset, GYRO_BIAS, atol=1e-4)
    assert np.degrees(done.leave_one_out_rms) < 0.08
    assert np.degrees(np.sqrt(np.mean(done.before**2))) > 0.5
    assert done.rest.g_sensitivity is None


def test_parameter_covariance_is_honest(rng):
    truth = np.r_[GYRO_MATRIX.ravel(), GYRO_BIAS]
    inside = []
    for _ in range(8):
        imu, _ = recorded(attitudes(16, rng), rng, dwell=1.6, travel=1.0)
        done = GyroBetweenDwells().calibrate(imu, find_dwells(imu), TRUE_ACCEL)
        error = np.r_[done.calibration.matrix.ravel(), done.calibration.offset] - truth
        inside.append(np.abs(error) < 2 * np.sqrt(np.diag(done.calibration.cov)))
    assert 0.85 < np.mean(inside) <= 1.0


def test_counts_of_unknown_scale(rng):
    imu, _ = recorded(attitudes(15, rng), rng)
    raw = ImuRecording(imu.t, imu.accel, imu.gyro / 2e-4 + 32768.0, gyro_unit="counts")
    dwells = find_dwells(raw)
    done = GyroBetweenDwells().calibrate(raw, dwells, TRUE_ACCEL)
    np.testing.assert_allclose(done.calibration.matrix, GYRO_MATRIX * 2e-4, atol=4e-7)
    assert done.calibration.apply(raw.gyro[:50]).mean() == pytest.approx(0.0, abs=1e-3)


def test_a_gyro_that_feels_gravity_is_told(rng):
    imu, truth = recorded(attitudes(20, rng), rng)
    felt = np.array([[0.0, 2e-4, -1e-4], [3e-4, 0.0, 1e-4], [-2e-4, 1e-4, 2e-4]])
    moody = ImuRecording(imu.t, imu.accel, imu.gyro + truth.specific_force @ felt.T)
    dwells = find_dwells(moody)
    done = GyroBetweenDwells().calibrate(moody, dwells, TRUE_ACCEL)
    np.testing.assert_allclose(done.rest.g_sensitivity, felt, atol=3e-5)
    np.testing.assert_allclose(done.calibration.matrix, GYRO_MATRIX, atol=1.5e-3)
    bundle = ImuCalibration(TRUE_ACCEL, done.calibration, None, done.rest.g_sensitivity)
    rates = ImuCalibration.from_json(bundle.to_json()).apply(moody).gyro
    np.testing.assert_allclose(rates[truth.rest].mean(axis=0), 0.0, atol=1e-4)


def test_bias_at_rest_is_honest_about_wander(rng):
    score = []
    for _ in range(30):
        imu, _ = recorded(attitudes(10, rng), rng, dwell=1.5, travel=0.5)
        dwells = find_dwells(imu)
        wander = 3e-4 * rng.standard_normal((len(dwells), 3))
        gyro = imu.gyro.copy()
        for k in range(len(dwells)):
            gyro[dwells.start[k] - 20 : dwells.stop[k] + 20] += wander[k]
        rest = bias_at_rest(find_dwells(ImuRecording(imu.t, imu.accel, gyro)))
        score.append((rest.bias - GYRO_BIAS) / np.sqrt(np.diag(rest.cov)))
    assert 0.75 < np.sqrt(np.mean(np.square(score))) < 1.35


@pytest.mark.parametrize("bad", [[4], [4, 9], [2, 9, 14]])
def test_moves_that_no_constants_explain_are_left_out(rng, bad):
    imu, _ = recorded(attitudes(20, rng), rng)
    dwells = find_dwells(imu)
    gyro = imu.gyro.copy()
    for k in bad:
        rows = slice(dwells.stop[k], dwells.start[k + 1])
        gyro[rows] = GYRO_BIAS + 1.2 * (gyro[rows] - GYRO_BIAS)
    done = GyroBetweenDwells().calibrate(ImuRecording(imu.t, imu.accel, gyro), dwells, TRUE_ACCEL)
    assert np.flatnonzero(~done.used).tolist() == bad
    assert sum("no constants explain" in str(one) for one in done.findings) == len(bad)
    np.testing.assert_allclose(done.calibration.matrix, GYRO_MATRIX, atol=2e-3)


def test_missing_samples_are_said(rng):
    imu, _ = recorded(attitudes(12, rng), rng)
    dwells = find_dwells(imu)
    middle = (dwells.stop[4] + dwells.start[5]) // 2
    pausing = imu.select(np.abs(np.arange(len(imu)) - middle) > 10)
    done = GyroBetweenDwells().calibrate(pausing, find_dwells(pausing), TRUE_ACCEL)
    assert np.flatnonzero(~done.whole).tolist() == [4]
    assert any("samples are missing" in str(one) for one in done.findings)
    np.testing.assert_allclose(done.calibration.matrix, GYRO_MATRIX, atol=3e-3)


@pytest.mark.parametrize("unit", ["rad/s", "counts"])
def test_gains_from_known_turns(rng, unit):
    degrees = {0: (90.0, -90.0), 1: (180.0, -90.0), 2: (360.0, -180.0)}
    gains, bias, rate = np.array([1.02, 0.97, 1.01]), np.array([0.02, -0.01, 0.03]), 100.0
    turns, rows = [], [np.zeros((200, 3))]
    for axis, angles in degrees.items():
        for angle in angles:
            turns.append(KnownTurn(axis, np.radians(angle)))
            speed = np.radians(angle) / 2.0 * np.eye(3)[axis]
            rows += [np.tile(speed, (200, 1)), np.zeros((200, 3))]
    true = np.concatenate(rows)
    scale = 1.0 if unit == "rad/s" else 1e-3
    gyro = (true / gains + bias + 1e-4 * rng.standard_normal(true.shape)) / scale
    recording = ImuRecording(np.arange(len(gyro)) / rate, gyro=gyro, gyro_unit=unit)
    dwells = find_dwells(recording)
    done = turn_gains(recording, dwells, turns)
    np.testing.assert_allclose(np.diag(done.calibration.matrix) / scale, gains, atol=3e-3)
    np.testing.assert_allclose(np.degrees(done.after), np.degrees([t.angle for t in turns]), atol=0.2)
    with pytest.raises(UnderConstrainedError, match="6 moves between still parts, 5 turns"):
        turn_gains(recording, dwells, turns[:5])
    with pytest.raises(DataError, match="the other way"):
        turn_gains(recording, dwells, [KnownTurn(t.axis, -t.angle) for t in turns])


def test_turns_are_parsed():
    assert KnownTurn.parse("y=-90") == KnownTurn(1, -np.pi / 2)
    for wrong in ("q=90", "x", "x=0", "x=nan", "x=many"):
        with pytest.raises(DataError, match="no turn"):
            KnownTurn.parse(wrong)


def test_a_range_that_is_reached_is_seen():
    gyro = np.zeros((50, 3))
    gyro[20:24, 1] = 4.36
    gyro[30, 0] = 3.0
    assert np.flatnonzero(saturated(gyro)).tolist() == [20, 21, 22, 23]


def test_bad_input_is_named(rng):
    imu, _ = recorded(attitudes(4, rng), rng)
    with pytest.raises(UnderConstrainedError, match="3 moves"):
        GyroBetweenDwells().calibrate(imu, find_dwells(imu), TRUE_ACCEL)
    many, _ = recorded(attitudes(12, rng), rng)
    dwells = find_dwells(many)
    for turned_round in (many.gyro[:, [1, 0, 2]], many.gyro * [1, -1, 1], np.degrees(many.gyro)):
        wrong = ImuRecording(many.t, many.accel, turned_round)
        with pytest.raises(DataError, match="disagree about the moves"):
            GyroBetweenDwells().calibrate(wrong, dwells, TRUE_ACCEL)
    level = np.concatenate([spun(0, [40.0] * 8)])
    imu, _ = recorded(level, rng)
    with pytest.raises(UnderConstrainedError, match=r"hardly turn about y|about y and z"):
        GyroBetweenDwells().calibrate(imu, find_dwells(imu), TRUE_ACCEL)


@pytest.mark.data
def test_mpu6050_turn(data_dir):
    imu = mpu6050(data_dir, "example_data_calibration")
    dwells = find_dwells(imu)
    accel = MultiPosition().calibrate(dwells)
    gyro = GyroBetweenDwells().calibrate(imu, dwells, accel.calibration, used=accel.used)
    assert (~gyro.whole).sum() == 3
    assert gyro.accel.cov[3, 3] < 0.05 * accel.calibration.cov[3, 3]
    trial = verify(ImuCalibration(accel.calibration, gyro.calibration), mpu6050(data_dir, "imu_90_x_rot"))
    (move,) = trial.moves
    assert np.degrees(move.off) < 0.5
    assert abs(np.degrees(move.by_gyro - move.by_gravity)) < 0.5
    assert trial.rms < 0.03


@pytest.mark.data
def test_xsens(data_dir):
    imu = xsens(data_dir).slice(0.0, 260.0)
    dwells = find_dwells(imu)
    accel = MultiPosition().calibrate(dwells)
    done = GyroBetweenDwells().calibrate(imu, dwells, accel.calibration, used=accel.used)
    assert np.degrees(done.leave_one_out_rms) == pytest.approx(0.13, abs=0.04)
    assert done.rest.probability < 1e-20
