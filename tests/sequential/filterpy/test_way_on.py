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


@pytest.mark.parametrize("update_first", [False, True])
@pytest.mark.parametrize("column", [True, False], ids=["column", "flat"])
def test_a_pass_is_its_steps(column, update_first, rng):
    """Compiled steps, and between them those that are in doubt: without noise, or with components missing."""
    kf = tracker(column, 2)
    kf.B = np.array([[0.1, 0.0], [0.5, 0.0], [0.0, 0.1], [0.0, 0.5]])
    kf.alpha = 1.01
    apart, whole = sq.from_filterpy(kf), sq.from_filterpy(kf)
    count = 40
    zs, us = list(rng.standard_normal((count, 2))), rng.standard_normal((count, 2))
    zs[3], zs[10], zs[11], zs[20] = None, np.array([np.nan, 0.5]), np.full(2, np.nan), [None, 1.0]
    Rs = [kf.R * (0.0 if k % 7 == 5 else 1.0 + k) for k in range(count)]
    Fs = [kf.F * 0.99**k for k in range(count)]
    expected = []
    for z, u, R, F in zip(zs, us, Rs, Fs, strict=True):
        step = []
        for name in ("update", "predict") if update_first else ("predict", "update"):
            if name == "update":
                apart.update(z, R=R)
            else:
                apart.predict(u=u, F=F)
            step.append((name, apart.x.copy(), apart.P.copy()))
        expected.append({name: (x, P) for name, x, P in step})
    got = whole.batch_filter(zs, Rs=Rs, us=us, Fs=Fs, update_first=update_first)
    for k, beliefs in enumerate(expected):
        assert_equal(
            [*beliefs["update"], *beliefs["predict"]], [table[k] for table in got], f"step {k}", 1e-11
        )
    for name in ("x", "P", "K", "S", "SI", "y", "x_prior", "P_prior", "x_post", "P_post"):
        assert_equal(getattr(apart, name), getattr(whole, name), name, 1e-11)
    # a pass with other inverses takes its steps in NumPy
    other = sq.from_filterpy(kf)
    other.inv = np.linalg.pinv
    Rs = [kf.R + 0.1 * k * np.eye(2) for k in range(count)]
    plain, compiled = (f.batch_filter(zs, Rs=Rs) for f in (other, sq.from_filterpy(kf)))
    assert_equal(plain, compiled, "pinv", 1e-10)
    smoothed = other.rts_smoother(*plain[:2], inv=np.linalg.pinv), other.rts_smoother(*plain[:2])
    assert_equal(*smoothed, "smoothed", 1e-9)


def test_a_pass_is_quicker_than_filterpy(rng):
    """A floor far below what is measured: 15 to 20 times, on one thread."""
    import time

    zs = list(rng.standard_normal((3000, 2, 1)))
    sq.from_filterpy(tracker(True, 2)).batch_filter(zs[:10])
    seconds = []
    for kf in (tracker(True, 2), sq.from_filterpy(tracker(True, 2))):
        began = time.process_time()
        out = kf.batch_filter(zs)
        kf.rts_smoother(out[0], out[1])
        seconds.append(time.process_time() - began)
    assert seconds[0] > 4.0 * seconds[1]
