"""Square-root and information scripts: FilterPy's numbers, and those of the Kalman filter."""

import itertools

import numpy as np
import pytest
from filterpy_scripts import assert_equal, kalman, run_both, tracker

import sequential as sq

shapes = pytest.mark.parametrize("column", [True, False], ids=["column", "flat"])


def readings(count, m, rng):
    return np.cumsum(rng.standard_normal((count, m)), axis=0)


@pytest.mark.parametrize("kind", ["SquareRootKalmanFilter", "InformationFilter"])
@shapes
def test_other_forms(kind, column, rng):
    zs = readings(40, 2, rng)

    def make():
        base = tracker(column, 2)
        kf = getattr(kalman, kind)(dim_x=4, dim_z=2)
        kf.x, kf.F, kf.H = base.x, base.F, base.H
        kf.B = np.array([[0.1], [0.5], [0.1], [0.5]]) if column else 0.0
        kf.Q = base.Q + 0.01 * np.eye(4)
        if kind == "InformationFilter":
            kf.P_inv, kf.R_inv = np.linalg.inv(base.P), np.linalg.inv(base.R)
            kf.compute_log_likelihood = False  # it fails where dim_x is not dim_z
        else:
            kf.P, kf.R = base.P, base.R
        return kf

    def script(kf):
        for k, z in enumerate(zs):
            kf.predict(u=np.array([[0.3 * k]]) if column else 0)
            kf.update(z[:, None] if column else z)
            yield kf.P
            kf.update(z[:, None] if column else z, 1.3)
            yield

    # signs of a root are free, FilterPy's P_post is the prior, its likelihood of information no density
    except_for = {"P_post", "P1_2", "M", "S1_2", "SI1_2", "likelihood", "log_likelihood"}
    _, ours = run_both(make, script, except_for=except_for)
    if kind == "SquareRootKalmanFilter":
        for root, whole in ((ours.P1_2, ours.P), (ours.S1_2, ours.S), (ours.Q1_2, ours.Q)):
            np.testing.assert_allclose(root @ root.T, whole, atol=1e-12)
        np.testing.assert_allclose(ours.P_post, ours.P)
    for step in itertools.islice(script(ours), 1, None, 2):
        assert step is None


@shapes
def test_the_forms_agree_with_the_kalman_filter(column, rng):
    base = tracker(column, 2)
    linear = sq.from_filterpy(base)
    root = kalman.SquareRootKalmanFilter(4, 2)
    information = kalman.InformationFilter(4, 2)
    for kf in (root, information):
        kf.x, kf.F, kf.H = base.x, base.F, base.H
    root.P, root.R = base.P, base.R
    information.P_inv, information.R_inv = np.linalg.inv(base.P), np.linalg.inv(base.R)
    root, information = sq.from_filterpy(root), sq.from_filterpy(information)
    root.Q = information.Q = base.Q  # of rank two: FilterPy's square root refuses it
    for k, z in enumerate(readings(30, 2, rng)):
        if k % 4 == 0:
            z[k % 2] = np.nan
        for kf in (linear, root, information):
            kf.predict()
            kf.update(z)
        for kf in (root, information):
            assert_equal([linear.x, linear.P], [kf.x, kf.P], type(kf).__name__, 1e-9)
            assert kf.log_likelihood == pytest.approx(linear.log_likelihood, rel=1e-9)
            assert kf.mahalanobis == pytest.approx(linear.mahalanobis, rel=1e-8)
