from dataclasses import replace

import numpy as np
import pytest
from dwell_worlds import ACCEL_MATRIX, ACCEL_OFFSET, GRAVITY, attitudes, mpu6050, recorded, xsens

from sequential.errors import DataError, UnderConstrainedError
from sequential.sensors import SIX_POSITIONS, Dwells, MultiPosition, find_dwells


def drawn(directions, rng, *, sigma=1e-3, scatter=0.0, unit="m/s^2"):
    """Dwells whose means are drawn, without a recording around them."""
    force = GRAVITY * directions * (1 + scatter / GRAVITY * rng.standard_normal((len(directions), 1)))
    means = force @ np.linalg.inv(ACCEL_MATRIX).T + ACCEL_OFFSET
    means = means + sigma * rng.standard_normal(means.shape)
    k = np.arange(len(means))
    covs = np.tile(sigma**2 * np.eye(3), (len(means), 1, 1))
    return Dwells(300 * k, 300 * k + 200, np.full(len(k), 200), np.c_[3.0 * k, 3.0 * k + 2], means, covs,
                  accel_unit=unit)  # fmt: skip


def sphere(count, rng):
    d = rng.standard_normal((count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def test_truth_is_found_from_a_recording(rng):
    imu, _ = recorded(attitudes(24, rng), rng)
    dwells = find_dwells(imu)
    assert len(dwells) == 24
    done = MultiPosition().calibrate(dwells)
    np.testing.assert_allclose(done.calibration.matrix, ACCEL_MATRIX, atol=1e-3)
    np.testing.assert_allclose(done.calibration.offset, ACCEL_OFFSET, atol=5e-3)
    assert done.used.all()
    assert done.leave_one_out_rms < 5e-3
    assert np.sqrt(np.mean(done.before**2)) > 0.2


def test_parameter_covariance_is_honest(rng):
    """Normalised errors of the nine parameters are χ² with nine degrees; intervals cover."""
    truth = np.r_[np.diag(ACCEL_MATRIX), 0, 0, 0, ACCEL_OFFSET]
    truth[3:6] = ACCEL_MATRIX[1, 0] / truth[0], ACCEL_MATRIX[2, 0] / truth[0], ACCEL_MATRIX[2, 1] / truth[1]
    nees, inside = [], []
    for _ in range(100):
        dwells = drawn(sphere(25, rng), rng, sigma=2e-3, scatter=4e-3)
        fit = MultiPosition()._fit(dwells, np.ones(25, bool))
        error = fit.parameters - truth
        nees.append(error @ np.linalg.solve(fit.cov, error))
        inside.append(np.abs(error) < 2 * np.sqrt(np.diag(fit.cov)))
    assert 7.0 < np.mean(nees) < 13.0  # 9, more with 16 degrees to learn the scatter from
    assert 0.88 < np.mean(inside) < 0.99


def test_left_out_dwells_are_predicted_within_their_sigmas(rng):
    score = []
    for _ in range(10):
        done = MultiPosition().calibrate(drawn(sphere(20, rng), rng, sigma=2e-3, scatter=3e-3))
        score.append(done.left_out / done.sigmas)
    assert 0.8 < np.sqrt(np.mean(np.square(score))) < 1.3


@pytest.mark.parametrize("scale", [1e-4, 250.0])
def test_units_of_the_readings_do_not_matter(rng, scale):
    dwells = drawn(sphere(20, rng), rng, unit="counts")
    other = replace(dwells, accel=dwells.accel * scale, accel_cov=dwells.accel_cov * scale**2)
    a, b = (MultiPosition().calibrate(one) for one in (dwells, other))
    np.testing.assert_allclose(
        b.calibration.matrix, a.calibration.matrix / scale, rtol=1e-6, atol=1e-9 / scale
    )
    np.testing.assert_allclose(b.calibration.offset, a.calibration.offset * scale, rtol=1e-5)
    np.testing.assert_allclose(b.left_out, a.left_out, atol=1e-6)


def test_gravity_scales_the_answer(rng):
    dwells = drawn(sphere(20, rng), rng, unit="counts")
    a, b = (MultiPosition(gravity=g).calibrate(dwells) for g in (GRAVITY, 2 * GRAVITY))
    np.testing.assert_allclose(b.calibration.matrix, 2 * a.calibration.matrix, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(b.calibration.offset, a.calibration.offset, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("bad", [1, 3])
def test_bad_dwells_are_named_and_left_out(rng, bad):
    dwells = drawn(sphere(30, rng), rng)
    accel = dwells.accel.copy()
    accel[5 : 5 + bad] *= 1.05
    done = MultiPosition().calibrate(replace(dwells, accel=accel))
    assert np.flatnonzero(~done.used).tolist() == list(range(5, 5 + bad))
    assert sum("disagrees" in str(one) for one in done.findings) == bad
    np.testing.assert_allclose(done.calibration.matrix, ACCEL_MATRIX, atol=3e-3)


def test_six_positions_give_gain_and_offset(rng):
    imu, _ = recorded(SIX_POSITIONS, rng)
    done = MultiPosition(shears=False, six=True).calibrate(find_dwells(imu))
    assert not done.checked.any()
    assert np.isnan(done.leave_one_out_rms)
    assert "nothing checks dwells 1, 2, 3, 4, 5, 6" in str(done.findings[0])
    assert done.calibration.matrix == pytest.approx(np.diag(np.diag(done.calibration.matrix)), abs=1e-9)
    np.testing.assert_allclose(np.diag(done.calibration.matrix), np.diag(ACCEL_MATRIX), atol=2e-3)
    np.testing.assert_allclose(done.calibration.offset, ACCEL_OFFSET, atol=2e-2)


@pytest.mark.parametrize(("missing", "said"), [(0, "x axis up"), (3, "y axis down"), (5, "z axis down")])
def test_a_missing_position_is_named(rng, missing, said):
    imu, _ = recorded(np.delete(SIX_POSITIONS, missing, axis=0), rng)
    with pytest.raises(UnderConstrainedError, match=said):
        MultiPosition(shears=False, six=True).calibrate(find_dwells(imu))


def test_coplanar_positions_are_refused_with_advice(rng):
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    flat = np.c_[np.cos(angle), np.sin(angle), 0 * angle]
    with pytest.raises(UnderConstrainedError, match=r"leave gain z.*with z pointing up and down"):
        MultiPosition().calibrate(drawn(flat, rng))
    tilted = flat @ np.linalg.qr(rng.standard_normal((3, 3)))[0]
    with pytest.raises(UnderConstrainedError, match="in one plane"):
        MultiPosition().calibrate(drawn(tilted, rng))


def test_shears_that_no_position_shows_are_said(rng):
    axes = np.vstack([np.eye(3), -np.eye(3)])
    done = MultiPosition().calibrate(drawn(np.vstack([axes, axes]), rng))
    assert any("cannot be seen" in str(one) for one in done.findings)
    np.testing.assert_allclose(done.fit.parameters[3:6], 0.0, atol=1e-2)


def test_too_few_dwells(rng):
    with pytest.raises(UnderConstrainedError, match="5 dwells"):
        MultiPosition().calibrate(drawn(sphere(5, rng), rng))
    in_g = drawn(sphere(12, rng), rng)
    with pytest.raises(DataError, match="the unit is another one"):
        MultiPosition().calibrate(replace(in_g, accel=in_g.accel / GRAVITY))
    with pytest.raises(DataError, match="no accelerometer"):
        MultiPosition().calibrate(replace(drawn(sphere(9, rng), rng), accel=None))


@pytest.mark.data
def test_mpu6050_and_xsens(data_dir):
    done = MultiPosition().calibrate(find_dwells(mpu6050(data_dir, "example_data_calibration")))
    assert len(done.used) == 10
    assert (done.used & done.checked).all()
    assert done.leave_one_out_rms == pytest.approx(0.0064, abs=0.001)
    assert "misalignment yx" in str(done.findings[0])
    done = MultiPosition().calibrate(find_dwells(xsens(data_dir)))
    assert len(done.used) == 38
    assert done.used.all()
    assert done.leave_one_out_rms == pytest.approx(0.00142, abs=0.0002)
