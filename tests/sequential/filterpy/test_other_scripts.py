"""Extended, mixing and fixed-lag scripts."""

import math

import numpy as np
import pytest
from filterpy_scripts import angle, assert_equal, common, kalman, run_both, tracker

import sequential as sq

# --- extended ---


def slant(x):
    return math.hypot(x[0], x[2])


def slant_jacobian(x):
    return np.array([[x[0] / slant(x), 0.0, x[2] / slant(x)]])


def radar():
    kf = kalman.ExtendedKalmanFilter(dim_x=3, dim_z=1)
    kf.x = np.array([-100.0, 100.0, 4500.0])
    kf.F = np.eye(3) + 0.05 * np.array([[0, 1, 0], [0, 0, 0], [0, 0, 0]])
    kf.R = np.diag([25.0])
    kf.Q[0:2, 0:2] = common.Q_discrete_white_noise(2, dt=0.05, var=0.1)
    kf.Q[2, 2] = 0.1
    kf.P *= 50
    return kf


def test_a_radar(rng):
    zs = [np.array([math.hypot(5.0 * k, 4000.0) + rng.standard_normal()]) for k in range(60)]

    def script(kf):
        for z in zs:
            kf.update(z, slant_jacobian, slant)
            yield kf.log_likelihood, kf.likelihood, kf.mahalanobis
            kf.update(z.item(), slant_jacobian, slant, R=30.0, args=(), hx_args=())
            kf.predict()
            yield

    run_both(radar, script)


def test_a_bearing_with_a_residual_and_arguments(rng):
    zs = 3.1 + 0.05 * np.arange(30) + 0.05 * rng.standard_normal(30)

    def make():
        kf = kalman.ExtendedKalmanFilter(dim_x=2, dim_z=1)
        kf.x, kf.P, kf.R = np.array([3.0, 0.0]), np.eye(2) * 0.1, 0.01 * np.eye(1)
        kf.F, kf.Q, kf.B = np.array([[1.0, 1.0], [0, 1.0]]), 1e-4 * np.eye(2), np.array([[0.0], [1.0]])
        return kf

    def script(kf):
        for k, z in enumerate(zs):
            kf.predict(u=np.array([0.001 * k]))
            kf.update(
                np.array([angle(z)]),
                lambda _, gain: np.array([[gain, 0.0]]),
                lambda x, offset: np.array([angle(x[0] + offset)]),
                args=1.0,
                hx_args=0.01,
                residual=lambda a, b: np.array([angle((a - b).item())]),
            )
            yield

    theirs, _ = run_both(make, script)
    assert abs(theirs.x[0] - zs[-1]) < 0.5


def test_predict_update_of_a_linear_sensor(rng):
    def make():
        kf = kalman.ExtendedKalmanFilter(dim_x=2, dim_z=1)
        kf.x, kf.F = np.array([1.0, 0.1]), np.array([[1.0, 1.0], [0, 1.0]])
        return kf

    def script(kf):
        for z in (1.0, 1.3, 2.0):
            kf.predict_update(np.array([z]), lambda _: np.array([[1.0, 0.0]]), lambda x: x[:1])
            yield

    # FilterPy keeps the state before the step as the prior
    run_both(make, script, except_for=("x_prior", "P_prior"))


def test_a_class_derived_from_filterpy_s():
    class Robot(kalman.ExtendedKalmanFilter):
        def __init__(self, wheelbase):
            super().__init__(2, 1)
            self.wheelbase = wheelbase

        def predict_x(self, u=0):
            self.x = self.x + self.wheelbase * np.array([math.cos(self.x[1]), u])

    def make():
        kf = Robot(0.5)
        kf.x = np.array([0.0, 0.3])
        return kf

    def script(kf):
        for k in range(5):
            kf.predict(u=0.1 * k)
            kf.update(np.array([0.5 * k]), lambda _: np.array([[1.0, 0.0]]), lambda x: x[:1])
            yield

    _, ours = run_both(make, script)
    assert type(ours).__name__ == "Robot"
    assert ours.wheelbase == 0.5


# --- mixing ---


def bank():
    """A quiet and a lively filter of the same states."""
    filters = [tracker(True, 2), tracker(True, 2)]
    filters[1].Q = filters[1].Q * 200.0
    return kalman.IMMEstimator(filters, [0.6, 0.4], np.array([[0.97, 0.03], [0.05, 0.95]]))


def test_mixing(rng):
    turns = np.cumsum(np.cumsum(rng.standard_normal((60, 2)) * (np.arange(60) > 30)[:, None], axis=0), axis=0)

    def script(imm):
        for z in turns:
            imm.predict()
            yield imm.x_prior, imm.P_prior
            imm.update(z[:, None])
            yield [kf.x for kf in imm.filters], [kf.P for kf in imm.filters]

    theirs, ours = run_both(bank, script)
    assert theirs.mu[1] > 0.5
    assert np.isfinite(ours.log_likelihood)


def test_mixing_survives_a_reading_that_no_filter_expects():
    theirs, ours = bank(), sq.from_filterpy(bank())
    for kf in (theirs, ours):
        kf.predict()
        kf.update(np.array([[1e6], [0.0]]))
    assert ours.mu.sum() == pytest.approx(1.0)
    # the lively filter finds it less unlikely, by thousands of orders of magnitude
    assert ours.mu[1] > 0.999
    assert theirs.mu[1] < 0.9


def test_a_mode_out_of_reach_stays_itself():
    imm = bank()
    imm.mu, imm.M = np.array([1.0, 0.0]), np.eye(2)
    ours = sq.from_filterpy(imm)
    alone = sq.from_filterpy(tracker(True, 2))
    for z in (1.0, 2.0, 3.0):
        for kf in (ours, alone):
            kf.predict()
            kf.update(np.array([[z], [z]]))
    assert_equal([alone.x, alone.P], [ours.x, ours.P], "one mode", 1e-12)
    np.testing.assert_array_equal(ours.mu, [1.0, 0.0])


def test_headings_mix_over_the_cut():
    """FilterPy's mixture of 179° and -179° points the other way (#76)."""

    def heading(x):
        points = kalman.MerweScaledSigmaPoints(1, 1.0, 2.0, 1.0)
        wrap = lambda a, b: np.array([angle(a[0] - b[0])])  # noqa: E731
        kf = kalman.UnscentedKalmanFilter(
            1, 1, 1.0, lambda x: x, lambda x, _: x, points, residual_x=wrap, residual_z=wrap
        )
        kf.x, kf.P = np.array([math.radians(x)]), 0.01 * np.eye(1)
        return kf

    make = lambda: kalman.IMMEstimator([heading(179), heading(-179)], [0.5, 0.5], 0.5 * np.ones((2, 2)))  # noqa: E731
    theirs, ours = make(), sq.from_filterpy(make())
    ours.predict()
    assert abs(angle(ours.x[0] - math.pi)) < 1e-9
    assert ours.P[0, 0] == pytest.approx(1.01 + math.radians(1) ** 2, rel=1e-6)
    theirs.predict()
    assert abs(theirs.x[0]) < 1e-9


# --- saving ---


def information():
    kf = kalman.InformationFilter(4, 2)
    kf.F = np.eye(4)
    return kf


FX, HX = (lambda x, _: tracker(False, 2).F @ x), (lambda x: x[::2])
EVERY_KIND = {
    "kalman": lambda: tracker(True, 2),
    "square root": lambda: kalman.SquareRootKalmanFilter(4, 2),
    "information": information,
    "unscented": lambda: kalman.UnscentedKalmanFilter(4, 2, 1.0, HX, FX, kalman.JulierSigmaPoints(4)),
    "mixing": bank,
}


@pytest.mark.parametrize("make", EVERY_KIND.values(), ids=EVERY_KIND.keys())
def test_saver_stacks_every_attribute(make, rng):
    kf = sq.from_filterpy(make())
    saver = common.Saver(kf, save_current=True)
    for z in rng.standard_normal((5, 2)):
        kf.predict()
        kf.update(z[:, None] if kf.x.ndim == 2 else z)
        saver.save()
    for name in ("x", "P", "x_prior", "x_post"):
        stacked = np.array(saver[name])
        assert stacked.shape[0] == 6
        np.testing.assert_array_equal(stacked[-1], getattr(kf, name))
    later = common.Saver(kf)
    for z in rng.standard_normal((3, 2)):
        kf.predict()
        kf.update(z[:, None] if kf.x.ndim == 2 else z)
        later.save()
    later.to_array()
    assert len(later.x) == 3


# --- fixed lag ---


def lagging(column=True, lag=6):
    base = tracker(column, 2)
    kf = kalman.FixedLagSmoother(dim_x=4, dim_z=2, N=lag)
    for name in ("x", "P", "F", "H", "Q", "R"):
        setattr(kf, name, getattr(base, name))
    return kf


@pytest.mark.parametrize("column", [True, False], ids=["column", "flat"])
def test_a_fixed_lag_is_rts_over_what_was_read(column, rng):
    zs = np.cumsum(rng.standard_normal((25, 2)), axis=0)
    lag = 6
    ours, linear = sq.from_filterpy(lagging(column, lag)), sq.from_filterpy(tracker(column, 2))
    means, covs, *_ = linear.batch_filter(zs)
    for k, z in enumerate(zs):
        ours.smooth(z)
        assert_equal([means[k], covs[k]], [ours.x, ours.P], "filtered", 1e-11)
        seen = linear.rts_smoother(means[: k + 1], covs[: k + 1])[0]
        first = max(0, k - lag + 1)
        assert_equal(seen[first:], np.array(ours.xSmooth[first:]), "smoothed", 1e-10)
    whole = sq.from_filterpy(lagging(column, lag))
    smoothed, filtered = whole.smooth_batch(zs, lag)
    assert_equal([np.array(ours.xSmooth), means], [smoothed, filtered], "batch", 1e-11)
    np.testing.assert_array_equal(np.ravel(whole.x), np.linspace(1.0, 2.0, 4))


def test_a_fixed_lag_filters_as_filterpy_does(rng):
    zs = np.cumsum(rng.standard_normal((20, 2)), axis=0)

    def script(kf):
        for z in zs:
            kf.smooth(z[:, None], u=None)
            yield

    run_both(lagging, script, except_for=("x_s", "K"))


def test_a_fixed_lag_errs_less_than_filterpy_s(rng):
    """FilterPy's corrections take the filtered covariance where the algorithm asks for the predicted one."""
    errors = np.zeros(2)
    for _ in range(10):
        velocity = np.cumsum(0.3 * rng.standard_normal((60, 2)), axis=0)
        truth = np.cumsum(0.5 * velocity, axis=0)
        zs = truth + 0.55 * rng.standard_normal(truth.shape)
        for i, kf in enumerate((lagging(), sq.from_filterpy(lagging()))):
            kf.x, kf.P = np.zeros((4, 1)), 10 * np.eye(4)
            for z in zs:
                kf.smooth(z[:, None])
            positions = np.array(kf.xSmooth)[10:50, ::2, 0]
            errors[i] += np.mean((positions - truth[10:50]) ** 2)
    assert errors[1] < errors[0]
