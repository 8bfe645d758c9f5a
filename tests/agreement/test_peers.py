"""statsmodels and pykalman as oracles: filter, smoother and likelihood, with components missing."""

import numpy as np
import pytest

import sequential as sq

SIZES = [(1, 1), (2, 1), (3, 2), (4, 3), (6, 2)]
every_size = pytest.mark.parametrize(("n", "m"), SIZES, ids=str)
FORMS = ["joseph", "ud", "sqrt", "information"]


class Problem:
    """A random stable system with readings at every second, in the letters of the textbooks."""

    def __init__(self, n, m, rng, count=80):
        self.n, self.m = n, m
        transition = rng.standard_normal((n, n))
        self.F = 0.95 * transition / np.abs(np.linalg.eigvals(transition)).max()
        self.Q, self.R, self.P = covariance(n, rng), covariance(m, rng), covariance(n, rng)
        self.H, self.x = rng.standard_normal((m, n)), rng.standard_normal(n)
        state = self.x + np.linalg.cholesky(self.P) @ rng.standard_normal(n)
        self.z = np.empty((count, m))
        for k in range(count):
            self.z[k] = self.H @ state + np.linalg.cholesky(self.R) @ rng.standard_normal(m)
            state = self.F @ state + np.linalg.cholesky(self.Q) @ rng.standard_normal(n)

    def run(self, estimator):
        model = sq.StateSpace(
            sq.Vector(self.n), sq.Gaussian(self.x, self.P), sq.LinearProcess(self.F, self.Q),
            {"z": sq.LinearSensor(self.H, self.R)}, start=0.0,
        )  # fmt: skip
        t = np.arange(float(len(self.z)))
        return sq.run(estimator, model, sq.SensorLog({"z": sq.Stream(t, self.z)}), at=t)

    def statsmodels(self):
        from statsmodels.tsa.statespace.kalman_smoother import KalmanSmoother

        # without a tolerance it does not stop at a steady state
        kf = KalmanSmoother(k_endog=self.m, k_states=self.n, k_posdef=self.n, tolerance=0)
        kf["design"], kf["obs_cov"] = self.H, self.R
        kf["transition"], kf["state_cov"], kf["selection"] = self.F, self.Q, np.eye(self.n)
        kf.bind(self.z.copy())
        kf.initialize_known(self.x, self.P)
        return kf.smooth()

    def pykalman(self):
        from pykalman import KalmanFilter

        return KalmanFilter(
            transition_matrices=self.F, observation_matrices=self.H, transition_covariance=self.Q,
            observation_covariance=self.R, initial_state_mean=self.x, initial_state_covariance=self.P,
        )  # fmt: skip


def covariance(n, rng):
    root = rng.standard_normal((n, n + 1))
    return root @ root.T + 0.1 * np.eye(n)


def assert_close(got, expected, tolerance=1e-10):
    expected = np.asarray(expected)
    np.testing.assert_allclose(got, expected, rtol=0, atol=tolerance * max(1.0, np.abs(expected).max()))


@every_size
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("missing", ["nothing", "rows", "components"])
def test_statsmodels(n, m, form, missing, rng):
    problem = Problem(n, m, rng)
    if missing == "rows":
        problem.z[rng.random(len(problem.z)) < 0.3] = np.nan
    elif missing == "components":
        problem.z[rng.random(problem.z.shape) < 0.4] = np.nan
    theirs = problem.statsmodels()
    run = problem.run(sq.KalmanFilter(keep=True, form=form))
    assert_close(run.mean, theirs.filtered_state.T)
    assert_close(run.cov, np.moveaxis(theirs.filtered_state_cov, 2, 0))
    assert_close(run.predicted.mean, theirs.predicted_state.T[:-1])
    assert_close(run.predicted.cov, np.moveaxis(theirs.predicted_state_cov, 2, 0)[:-1])
    assert run.log_likelihood == pytest.approx(theirs.llf, rel=1e-10)
    smoothed = problem.run(sq.RauchTungStriebel(sq.KalmanFilter(form=form)))
    assert_close(smoothed.mean, theirs.smoothed_state.T)
    assert_close(smoothed.cov, np.moveaxis(theirs.smoothed_state_cov, 2, 0))


@every_size
def test_statsmodels_beside_sigma_points_and_batch(n, m, rng):
    problem = Problem(n, m, rng)
    problem.z[rng.random(problem.z.shape) < 0.2] = np.nan
    theirs = problem.statsmodels()
    for smoother in (sq.RauchTungStriebel(sq.UnscentedKalmanFilter()), sq.IteratedSmoother()):
        run = problem.run(smoother)
        assert_close(run.mean, theirs.smoothed_state.T)
        assert_close(run.cov, np.moveaxis(theirs.smoothed_state_cov, 2, 0))


@every_size
def test_pykalman(n, m, rng):
    problem = Problem(n, m, rng, count=40)
    theirs = problem.pykalman()
    means, covs = theirs.filter(problem.z)
    run = problem.run(sq.KalmanFilter())
    assert_close(run.mean, means)
    assert_close(run.cov, covs)
    assert run.log_likelihood == pytest.approx(float(theirs.loglikelihood(problem.z)), rel=1e-10)
    means, covs = theirs.smooth(problem.z)
    smoothed = problem.run(sq.RauchTungStriebel())
    assert_close(smoothed.mean, means)
    assert_close(smoothed.cov, covs)


def test_pykalman_without_some_rows(rng):
    problem = Problem(4, 2, rng, count=40)
    gone = rng.random(40) < 0.3
    masked = np.ma.masked_array(problem.z, mask=np.repeat(gone[:, None], 2, axis=1))
    means, covs = problem.pykalman().smooth(masked)
    problem.z[gone] = np.nan
    run = problem.run(sq.RauchTungStriebel())
    assert_close(run.mean, means)
    assert_close(run.cov, covs)
