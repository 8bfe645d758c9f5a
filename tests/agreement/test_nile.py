"""The Nile at Aswan, 1871-1970, as a local level: published numbers, statsmodels, and every form here.

Durbin and Koopman 2012, Time Series Analysis by State Space Methods, 2.2: variances 15099 and 1469.1.
"""

import numpy as np
import pytest

import sequential as sq

OBSERVATION, LEVEL = 15099.0, 1469.1
PRIOR = 1e7

FILTERS = [
    *(sq.KalmanFilter(keep=True, form=form) for form in ("joseph", "ud", "sqrt", "information")),
    sq.ExtendedKalmanFilter(keep=True),
    sq.UnscentedKalmanFilter(keep=True),
]
every_filter = pytest.mark.parametrize("estimator", FILTERS, ids=lambda e: e.name)


@pytest.fixture(scope="module")
def flow():
    """(100,) annual flow, 1e8 m³."""
    from statsmodels.datasets import nile

    return nile.load_pandas().data["volume"].to_numpy(dtype=np.float64)


def local_level(flow, estimator, **changed):
    model = sq.StateSpace(
        manifold=sq.Vector(1),
        prior=sq.Gaussian([changed.get("start", 0.0)], [[PRIOR]]),
        process=changed.get("process", sq.LinearProcess([[1.0]], [[LEVEL]])),
        sensors={"flow": sq.LinearSensor([[1.0]], OBSERVATION)},
    )
    years = np.arange(len(flow), dtype=np.float64)
    return sq.run(estimator, model, sq.SensorLog({"flow": sq.Stream(years, flow)}))


def peer(flow, burn=0):
    """statsmodels' smoother of the same model."""
    from statsmodels.tsa.statespace.kalman_smoother import KalmanSmoother

    smoother = KalmanSmoother(k_endog=1, k_states=1, k_posdef=1, loglikelihood_burn=burn, tolerance=0)
    smoother["design"], smoother["transition"], smoother["selection"] = [[1.0]], [[1.0]], [[1.0]]
    smoother["obs_cov"], smoother["state_cov"] = [[OBSERVATION]], [[LEVEL]]
    smoother.bind(np.asarray(flow)[:, None].copy())
    smoother.initialize_known(np.zeros(1), np.array([[PRIOR]]))
    return smoother.smooth()


@every_filter
def test_filtered_numbers(flow, estimator):
    run = local_level(flow, estimator)
    near = {"rtol": 1e-7, "atol": 0.0}
    np.testing.assert_allclose(run.mean[:3, 0], [1118.3114615, 1140.1084392, 1072.3160185], **near)
    np.testing.assert_allclose(run.cov[:3, 0, 0], [15076.23639, 7894.55753, 5779.49738], **near)
    np.testing.assert_allclose([run.mean[-1, 0], run.cov[-1, 0, 0]], [798.3702926, 4032.15794], **near)
    np.testing.assert_allclose(run.predicted.cov[-1, 0, 0], 5501.25794, **near)
    assert run.log_likelihood == pytest.approx(-641.5855785, rel=1e-7)
    seen = run.innovations["flow"]
    terms = -0.5 * (np.log(2 * np.pi * seen.cov[:, 0, 0]) + seen.nis())
    assert terms.sum() == pytest.approx(run.log_likelihood, rel=1e-12)
    assert terms[1:].sum() == pytest.approx(-632.5442122, rel=1e-7)


@every_filter
def test_smoothed_numbers(flow, estimator):
    run = local_level(flow, sq.RauchTungStriebel(estimator))
    near = {"rtol": 1e-7, "atol": 0.0}
    np.testing.assert_allclose(run.mean[:3, 0], [1111.2202576, 1110.5292570, 1105.0248603], **near)
    np.testing.assert_allclose(run.cov[:3, 0, 0], [4030.53277, 3242.05700, 2818.47314], **near)
    np.testing.assert_allclose(run.cov[49, 0, 0], 2326.75687, **near)


@pytest.mark.parametrize(
    "process", [sq.LinearProcess([[1.0]], [[LEVEL]]), sq.RandomWalk(LEVEL)], ids=["steps", "seconds"]
)
def test_statsmodels_has_the_same(flow, process):
    theirs = peer(flow)
    run = local_level(flow, sq.KalmanFilter(keep=True), process=process)
    np.testing.assert_allclose(run.mean[:, 0], theirs.filtered_state[0], rtol=1e-11)
    np.testing.assert_allclose(run.cov[:, 0, 0], theirs.filtered_state_cov[0, 0], rtol=1e-11)
    np.testing.assert_allclose(
        run.predicted.mean[:, 0], theirs.predicted_state[0, :-1], rtol=1e-11, atol=1e-9
    )
    assert run.log_likelihood == pytest.approx(theirs.llf, rel=1e-12)
    seen = run.innovations["flow"]
    np.testing.assert_allclose(seen.residual[:, 0], theirs.forecasts_error[0], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(seen.cov[:, 0, 0], theirs.forecasts_error_cov[0, 0], rtol=1e-11)
    smoothed = local_level(flow, sq.RauchTungStriebel(), process=process)
    np.testing.assert_allclose(smoothed.mean[:, 0], theirs.smoothed_state[0], rtol=1e-10)
    np.testing.assert_allclose(smoothed.cov[:, 0, 0], theirs.smoothed_state_cov[0, 0], rtol=1e-9)


@pytest.mark.parametrize("burn", [0, 1, 10])
def test_the_likelihood_after_a_burn_in(flow, burn):
    seen = local_level(flow, sq.KalmanFilter()).innovations["flow"]
    terms = -0.5 * (np.log(2 * np.pi * seen.cov[:, 0, 0]) + seen.nis())
    assert terms[burn:].sum() == pytest.approx(peer(flow, burn).llf, rel=1e-12)


def test_a_wide_prior_tends_to_the_diffuse_likelihood(flow):
    """Exact diffuse: -632.5456251, the limit of the terms after the first."""
    seen = local_level(flow, sq.KalmanFilter()).innovations["flow"]
    terms = -0.5 * (np.log(2 * np.pi * seen.cov[:, 0, 0]) + seen.nis())
    assert terms[1:].sum() == pytest.approx(-632.5456251, abs=2e-3)


def test_years_that_are_missing(flow):
    """The forty years that Durbin and Koopman leave out (2.7)."""
    gappy = flow.copy()
    gappy[20:40] = np.nan
    gappy[60:80] = np.nan
    theirs = peer(gappy)
    years = np.arange(100.0)
    for estimator, mean, cov in (
        (sq.KalmanFilter(), theirs.filtered_state, theirs.filtered_state_cov),
        (sq.RauchTungStriebel(), theirs.smoothed_state, theirs.smoothed_state_cov),
    ):
        model = sq.StateSpace(
            sq.Vector(1), sq.Gaussian([0.0], [[PRIOR]]), sq.RandomWalk(LEVEL),
            {"flow": sq.LinearSensor([[1.0]], OBSERVATION)},
        )  # fmt: skip
        run = sq.run(estimator, model, sq.SensorLog({"flow": sq.Stream(years, gappy)}), at=years)
        np.testing.assert_allclose(run.mean[:, 0], mean[0], rtol=1e-10)
        np.testing.assert_allclose(run.cov[:, 0, 0], cov[0, 0], rtol=1e-9)
        if estimator == sq.KalmanFilter():
            assert run.log_likelihood == pytest.approx(theirs.llf, rel=1e-12)
