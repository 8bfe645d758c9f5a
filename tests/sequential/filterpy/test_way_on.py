"""A linear filter that was taken over declares itself to every other estimator."""

import numpy as np
import pytest
from filterpy_scripts import assert_equal, kalman, tracker

import sequential as sq


def driven(kind):
    base = tracker(True, 2)
    kf = getattr(kalman, kind)(4, 2)
    kf.x, kf.F, kf.H = base.x, base.F, base.H
    kf.B = np.array([[0.1, 0.0], [0.5, 0.0], [0.0, 0.1], [0.0, 0.5]])
    kf = sq.from_filterpy(kf)
    kf.Q = base.Q
    if kind == "InformationFilter":
        kf.P_inv, kf.R_inv = np.linalg.inv(base.P), np.linalg.inv(base.R)
    else:
        kf.P, kf.R = base.P, base.R
    return kf


@pytest.mark.parametrize("kind", ["KalmanFilter", "SquareRootKalmanFilter", "InformationFilter"])
def test_the_model_and_the_log_run_as_the_script_does(kind, rng):
    kf = driven(kind)
    zs = [*np.cumsum(rng.standard_normal((20, 2)), axis=0)]
    zs[4], zs[9] = None, np.array([np.nan, 1.0])
    us = rng.standard_normal((20, 2))
    model, log = kf.model(0.5), kf.log(zs, 0.5, us)
    at = 0.5 * np.arange(1, 21)
    run = sq.run(sq.KalmanFilter(), model, log, at=at)
    rows, total = run.index(at), 0.0
    for k, z in enumerate(zs):
        kf.predict(us[k])
        kf.update(z)
        total += kf.log_likelihood
        assert_equal([kf.x.ravel(), kf.P], [run.mean[rows[k]], run.cov[rows[k]]], "run", 1e-9)
    assert run.log_likelihood == pytest.approx(total, rel=1e-9)


def test_the_smoother_of_the_script_is_ours(rng):
    kf = sq.from_filterpy(tracker(False, 2))
    zs = np.cumsum(rng.standard_normal((30, 2)), axis=0)
    model, log = kf.model(), kf.log(zs)
    states, covs, *_ = kf.rts_smoother(*kf.batch_filter(zs)[:2])
    run = sq.run(sq.RauchTungStriebel(), model, log)
    rows = run.index(np.arange(1.0, 31.0))
    assert_equal([states, covs], [run.mean[rows], run.cov[rows]], "smoothed", 1e-9)


def test_what_a_declaration_has_no_place_for_is_refused():
    kf = sq.from_filterpy(tracker())
    kf.alpha = 1.01
    with pytest.raises(sq.FactorlabError, match="no fading memory"):
        kf.model()
    kf = sq.from_filterpy(tracker())
    kf.M = 0.1 * np.ones((2, 1))
    with pytest.raises(sq.FactorlabError, match="M correlates"):
        kf.model()
