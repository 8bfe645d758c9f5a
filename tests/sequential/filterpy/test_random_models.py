"""Random models, ill-conditioned and of low rank, with components missing: no exception, no NaN."""

import numpy as np
import pytest
from filterpy_scripts import kalman

import sequential as sq


def covariance(n, rng, decades, rank):
    """(n, n) of a condition number up to ten to the `decades`, or singular."""
    turn, _ = np.linalg.qr(rng.standard_normal((n, n)))
    values = 10.0 ** rng.uniform(-decades, 0.0, n)
    values[rng.permutation(n)[rank:]] = 0.0
    cov = 10.0 ** rng.uniform(-4.0, 4.0) * (turn * values) @ turn.T
    return 0.5 * (cov + cov.T)


class Model:
    """F, H, P, Q, R, x of one random model, and readings that know nothing of it."""

    def __init__(self, rng):
        n, m = rng.integers(1, 7), rng.integers(1, 5)
        self.n, self.m = int(n), int(m)
        self.F, self.H = rng.standard_normal((n, n)), rng.standard_normal((m, n))
        self.F /= max(1.0, np.abs(np.linalg.eigvals(self.F)).max())
        if rng.random() < 0.3:  # nearly redundant
            self.H[rng.integers(m)] = self.H[rng.integers(m)] * (1.0 + 1e-9 * rng.standard_normal())
        self.P = covariance(n, rng, rng.choice([0, 6, 12]), rng.choice([n, max(1, n - 1)]))
        self.Q = covariance(n, rng, rng.choice([0, 6, 12]), rng.choice([n, n // 2, 0]))
        self.R = covariance(m, rng, rng.choice([0, 6, 12]), rng.choice([m, m, m // 2, 0]))
        self.x = rng.standard_normal(n)
        self.z = np.where(rng.random((12, m)) < 0.1, np.nan, rng.standard_normal((12, m)))

    def linear(self, kind):
        kf = getattr(kalman, kind)(self.n, self.m)
        kf.F, kf.H = self.F, self.H
        return self.started(kf)

    def unscented(self, points):
        hx, fx = (lambda x: self.H @ x), (lambda x, _: self.F @ x)
        return self.started(kalman.UnscentedKalmanFilter(self.n, self.m, 1.0, hx, fx, points(self.n)))

    def cubature(self):
        hx, fx = (lambda x: self.H @ x), (lambda x, _: self.F @ x)
        return self.started(kalman.CubatureKalmanFilter(self.n, self.m, 1.0, hx, fx))

    def started(self, kf):
        ours = sq.from_filterpy(kf)
        ours.x, ours.P, ours.Q, ours.R = self.x, self.P, self.Q, self.R
        return ours


EVERY_FILTER = {
    "kalman": lambda model: model.linear("KalmanFilter"),
    "square root": lambda model: model.linear("SquareRootKalmanFilter"),
    "merwe": lambda model: model.unscented(lambda n: kalman.MerweScaledSigmaPoints(n, 0.5, 2.0, 0.0)),
    "julier": lambda model: model.unscented(lambda n: kalman.JulierSigmaPoints(n, 1.0)),
    "simplex": lambda model: model.unscented(kalman.SimplexSigmaPoints),
    "cubature": lambda model: model.cubature(),
}


@pytest.mark.slow
@pytest.mark.parametrize("make", EVERY_FILTER.values(), ids=EVERY_FILTER.keys())
def test_no_model_breaks_a_filter(make, seeds):
    for seed in range(3 * len(seeds)):
        model = Model(np.random.default_rng([41, seed]))
        kf = make(model)
        means, covs = [], []
        largest = np.full(model.n, 1e-300)
        for z in model.z:
            kf.predict()
            kf.update(z)
            assert np.isfinite(kf.x).all()
            assert np.isfinite([kf.log_likelihood, kf.mahalanobis]).all()
            # where R = 0 and Q = 0 have left nothing unknown, P is the rounding of what was unknown before
            largest = np.maximum(largest, np.sqrt(np.diag(kf.P_prior)))
            assert np.linalg.eigvalsh(kf.P / np.outer(largest, largest)).min() > -1e-11
            assert (np.diag(kf.P) >= 0.0).all()
            means.append(np.ravel(kf.x))
            covs.append(kf.P)
        if hasattr(kf, "rts_smoother"):
            states, spreads, *_ = kf.rts_smoother(np.array(means), np.array(covs))
            assert np.isfinite(states).all()
            assert np.isfinite(spreads).all()
