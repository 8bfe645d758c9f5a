import numpy as np
import pytest

from sequential.errors import DataError, NotFiniteError, ShapeError, UnderConstrainedError
from sequential.sensors import RangeSensor
from sequential.sensors.range_fit import curve, curve_jacobian, fit_curve, inverse_curve

TRUTH = np.array([28.0, 0.5, 0.1])  # V cm, cm, V: a Sharp GP2Y0A21, about
D = np.array([7.0, 8, 10, 12, 15, 18, 20, 25, 30, 35, 40, 50, 60, 70, 80])


def table(rng, sigma=0.02, d=D):
    return d, curve(TRUTH, d) + sigma * rng.standard_normal(len(d))


def test_exact_readings_give_the_exact_curve():
    fit = RangeSensor().fit(D, curve(TRUTH, D))
    np.testing.assert_allclose(fit.parameters, TRUTH, rtol=1e-7)
    np.testing.assert_allclose(fit.distance(fit.reading(D)), D)
    assert (fit.a, fit.b, fit.c) == tuple(fit.parameters)
    assert fit.span == (7.0, 80.0)


@pytest.mark.parametrize(
    "truth", [(28.0, 0.5, 0.1), (3e5, 40.0, -80.0), (-2.0, 0.3, 5.0), (0.28, 0.005, 0.1)]
)
def test_the_start_is_found_in_any_unit(truth, rng):
    d = np.linspace(0.1, 0.8, 25) if truth[0] == 0.28 else D
    v = curve(np.array(truth), d)
    noisy = v + 1e-4 * np.ptp(v) * rng.standard_normal(len(d))
    fit = RangeSensor().fit(d, noisy)
    np.testing.assert_allclose(fit.reading(d), v, atol=5e-4 * np.ptp(v))


def test_jacobian_meets_central_differences():
    given = curve_jacobian(TRUTH, D)
    for k in range(3):
        step = np.zeros(3)
        step[k] = 1e-6
        difference = (curve(TRUTH + step, D) - curve(TRUTH - step, D)) / 2e-6
        np.testing.assert_allclose(given[:, k], difference, rtol=1e-7)


def test_gauss_newton_meets_scipy(rng):
    from scipy.optimize import curve_fit

    d, v = table(rng)
    ours, inverse = fit_curve(d, v, np.ones(len(d)))
    theirs, cov = curve_fit(lambda x, a, b, c: a / (x + b) + c, d, v, p0=TRUTH, xtol=1e-14, ftol=1e-14)
    scatter = np.sum((v - curve(ours, d)) ** 2) / (len(d) - 3)
    np.testing.assert_allclose(ours, theirs, rtol=1e-5)
    np.testing.assert_allclose(inverse * scatter, cov, rtol=1e-3)


def test_covariance_is_that_of_many_tables(rng):
    scores, kept = [], []
    for _ in range(300):
        fit = RangeSensor(sigma=0.02).fit(*table(rng))
        error = fit.parameters - TRUTH
        scores.append(error @ np.linalg.solve(fit.cov, error))
        kept.append(fit.used.all())
    assert 2.2 < np.mean(scores) < 3.3  # three constants; never narrower than the scatter
    assert np.mean(kept) > 0.97


def test_sigma_of_a_distance_is_that_of_many_readings(rng):
    """Fit and reading drawn anew: the distance scatters as it says, at 10 and at 60."""
    errors, sigmas = [], []
    for _ in range(500):
        fit = RangeSensor(sigma=0.02, outliers=False).fit(*table(rng))
        v = curve(TRUTH, np.array([10.0, 60.0])) + 0.02 * rng.standard_normal(2)
        errors.append(fit.distance(v) - [10.0, 60.0])
        sigmas.append(fit.distance_sigma(v))
    ratio = np.std(errors, axis=0) / np.sqrt(np.mean(np.square(sigmas), axis=0))
    np.testing.assert_allclose(ratio, 1.0, atol=0.12)


def test_averaging_leaves_the_uncertainty_of_the_constants(rng):
    fit = RangeSensor(sigma=0.02).fit(*table(rng))
    one, many, endless = (fit.sigma_at(60.0, samples=n) for n in (1, 16, 10**9))
    assert one > many > endless > 0
    a, _, c = fit.parameters
    v = fit.reading(60.0)
    slope = np.array([1 / (v - c), -1.0, a / (v - c) ** 2])
    np.testing.assert_allclose(endless, np.sqrt(slope @ fit.cov @ slope), rtol=1e-6)


def test_useful_range_ends_where_sigma_crosses_the_limit(rng):
    fit = RangeSensor(sigma=0.02).fit(*table(rng))
    low, high = fit.useful_range(0.5)
    assert low == 7.0
    np.testing.assert_allclose(fit.sigma_at(high), 0.5, rtol=0.01)
    assert fit.useful_range(1e-6) is None
    wide = fit.useful_range(relative=0.5)
    assert wide == fit.span
    assert fit.useful_range(0.5, samples=25)[1] > high


def test_no_distance_belongs_to_a_reading_beyond_the_asymptote():
    assert np.isnan(inverse_curve(TRUTH, np.array([0.1, 0.05]))).all()
    fit = RangeSensor().fit(D, curve(TRUTH, D))
    assert np.isnan(fit.distance_sigma(0.05))


def test_the_folded_branch_is_left_out_and_said(rng):
    near = np.array([1.0, 2, 3, 4, 5, 6])
    v_near = 3.6 - 0.5 * (6.5 - near)  # falls again towards the sensor
    d, v = table(rng)
    fit = RangeSensor().fit(np.r_[near, d], np.r_[v_near, v])
    assert fit.folded_below == 7.0
    assert not fit.used[:6].any()
    assert fit.used[6:].all()
    np.testing.assert_allclose(fit.parameters, RangeSensor().fit(d, v).parameters)
    assert "falls again" in fit.findings[0].what
    assert fit.useful_range()[0] == 7.0


@pytest.mark.parametrize("seed", range(20))
def test_noise_is_no_fold(seed):
    rng = np.random.default_rng(seed)
    assert RangeSensor().fit(*table(rng, sigma=0.03)).folded_below is None


def test_a_wrong_row_is_named_and_left_out(rng):
    d, v = table(rng, sigma=0.01)
    v[6] += 0.4
    fit = RangeSensor().fit(d, v)
    assert np.flatnonzero(~fit.used).tolist() == [6]
    assert any("row 7 (distance 20" in f.what for f in fit.findings)
    np.testing.assert_allclose(fit.reading(D), curve(TRUTH, D), atol=0.04)


def test_a_model_that_does_not_hold_is_said(rng):
    d = np.linspace(7, 80, 30)
    v = curve(TRUTH, d) + 0.2 * np.sin(d / 8)
    fit = RangeSensor(sigma=0.005, outliers=False).fit(d, v)
    assert any("model does not hold" in f.what or "does not hold" in f.do for f in fit.findings)
    assert fit.cov[0, 0] > RangeSensor(sigma=0.005).fit(d, curve(TRUTH, d)).cov[0, 0]


@pytest.mark.parametrize(
    ("d", "v", "error", "sentence"),
    [
        ([1, 2, 3], [3, 2, 1], DataError, "5 different distances"),
        ([5.0] * 9, np.arange(9.0), DataError, "got 1"),
        (D, np.full(15, 2.0), DataError, "all 15 readings are 2"),
        (D, D[:4], ShapeError, r"\(15,\) and \(4,\)"),
        (D, np.r_[np.nan, D[1:]], NotFiniteError, "reading in row 1"),
        (-D, D, DataError, "row 15 is -80"),
        (D, ["high"] * 15, DataError, "must be numbers"),
        (D, 5.0 - 0.01 * D, UnderConstrainedError, "do not bend|hardly bend"),
    ],
)
def test_bad_tables_are_told(d, v, error, sentence):
    with pytest.raises(error, match=sentence):
        RangeSensor().fit(d, v)


def test_a_mean_is_of_one_reading_at_least():
    with pytest.raises(DataError, match="samples is 0"):
        RangeSensor().fit(D, curve(TRUTH, D)).distance_sigma(1.0, samples=0)
