import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sequential.errors import DataError, NotFiniteError, NotPositiveDefiniteError, ShapeError
from sequential.evaluate import attitude_error, attitude_nees
from sequential.manifold.quaternion import quaternion_exp, quaternion_multiply


def orientations(rng, count):
    raw = rng.normal(size=(count, 4))
    return raw / np.linalg.norm(raw, axis=1)[:, None]


def turned(axis, degrees):
    return quaternion_exp(np.radians(degrees) * np.asarray(axis, dtype=float))


def test_a_turn_about_up_is_heading_and_any_other_is_inclination(rng):
    truth = orientations(rng, 50)
    about_up = attitude_error(quaternion_multiply(turned([0, 0, 1], 5.0), truth), truth)
    np.testing.assert_allclose(about_up.degrees, (5.0, 5.0, 0.0), atol=1e-6)
    tipped = attitude_error(quaternion_multiply(turned([0.6, 0.8, 0], 3.0), truth), truth)
    np.testing.assert_allclose(tipped.degrees, (3.0, 0.0, 3.0), atol=1e-6)


def test_inclination_is_the_angle_between_verticals(rng):
    truth, estimate = orientations(rng, 200), orientations(rng, 200)
    up = [Rotation.from_quat(q, scalar_first=True).inv().apply([0.0, 0.0, 1.0]) for q in (truth, estimate)]
    between = np.arccos(np.clip(np.sum(up[0] * up[1], axis=1), -1.0, 1.0))
    error = attitude_error(estimate, truth)
    np.testing.assert_allclose(error.errors[:, 2], between, atol=1e-7)
    whole = Rotation.from_quat(truth, scalar_first=True).inv() * Rotation.from_quat(
        estimate, scalar_first=True
    )
    np.testing.assert_allclose(error.errors[:, 0], whole.magnitude(), atol=1e-9)


def test_sign_and_length_of_a_quaternion_say_nothing(rng):
    truth, estimate = orientations(rng, 20), orientations(rng, 20)
    plain = attitude_error(estimate, truth).degrees
    np.testing.assert_allclose(attitude_error(-1.7 * estimate, truth).degrees, plain, rtol=1e-12)
    np.testing.assert_allclose(attitude_error(estimate, -truth).degrees, plain, rtol=1e-12)


def test_the_mean_heading_is_taken_off_where_asked(rng):
    truth = orientations(rng, 100)
    wandering = [
        quaternion_multiply(turned([0, 0, 1], 170.0 + 30.0 * np.sin(k)), q) for k, q in enumerate(truth)
    ]
    error = attitude_error(np.array(wandering), truth, heading_offset="mean")
    signed = 30.0 * np.sin(np.arange(100))
    assert error.degrees[1] == pytest.approx(np.std(signed), rel=0.02)
    assert error.degrees[2] == pytest.approx(0.0, abs=1e-6)
    assert abs(np.degrees(error.offset)) == pytest.approx(170.0, abs=2.0)


def test_rows_without_truth_or_unwanted_do_not_count(rng):
    truth = orientations(rng, 10)
    estimate = truth.copy()
    estimate[:3] = orientations(rng, 3)
    estimate[0] = np.nan
    truth[1], truth[2] = np.nan, 0.0
    where = np.arange(10) > 0
    error = attitude_error(estimate, truth, where)
    assert error.total == pytest.approx(0.0, abs=1e-7)
    np.testing.assert_array_equal(error.judged, np.arange(10) > 2)
    assert np.isnan(error.errors[:3]).all()


def test_nees_of_errors_drawn_from_the_covariance_is_chi_squared(rng):
    truth = orientations(rng, 4000)
    root = 0.02 * rng.normal(size=(4000, 3, 3))
    cov = root @ np.swapaxes(root, 1, 2) + 1e-6 * np.eye(3)
    drawn = np.einsum("nij,nj->ni", np.linalg.cholesky(cov), rng.normal(size=(4000, 3)))
    estimate = quaternion_multiply(truth, quaternion_exp(-drawn))
    values = attitude_nees(estimate, cov, truth)
    assert values.mean() == pytest.approx(3.0, abs=0.2)
    assert np.mean(values < 7.815) == pytest.approx(0.95, abs=0.02)
    seen_turned = quaternion_multiply(turned([0, 0, 1], 40.0), estimate)
    np.testing.assert_allclose(
        attitude_nees(seen_turned, cov, truth, heading_offset=np.radians(40.0)), values, rtol=1e-6
    )


def test_mistakes_are_told_in_sentences(rng):
    q = orientations(rng, 5)
    with pytest.raises(ShapeError, match="quaternions"):
        attitude_error(q, q[:4])
    with pytest.raises(ShapeError, match="mask"):
        attitude_error(q, q, np.ones(5))
    with pytest.raises(DataError, match="nothing to judge"):
        attitude_error(q, np.full((5, 4), np.nan))
    with pytest.raises(DataError, match="'none' or 'mean'"):
        attitude_error(q, q, heading_offset="median")
    with pytest.raises(NotFiniteError, match="row 2"):
        attitude_error(np.where(np.arange(5)[:, None] == 2, np.nan, q), q)
    with pytest.raises(ShapeError, match="covariances"):
        attitude_nees(q, np.eye(3), q)
    with pytest.raises(NotPositiveDefiniteError):
        attitude_nees(q, np.tile(-np.eye(3), (5, 1, 1)), q)
