"""Sigma-point scripts: FilterPy's numbers, its hooks for angles, and the Kalman filter on linear problems."""

import math

import numpy as np
import pytest
from filterpy_scripts import angle, assert_equal, common, kalman, run_both, tracker

import sequential as sq

STATION = np.array([3.0, -4.0])
POINTS = {
    "merwe": lambda n: kalman.MerweScaledSigmaPoints(n, alpha=0.3, beta=2.0, kappa=0.5),
    "merwe, narrow": lambda n: kalman.MerweScaledSigmaPoints(n, alpha=1e-3, beta=2.0, kappa=0.0),
    "julier": lambda n: kalman.JulierSigmaPoints(n, kappa=3.0 - n),
    "simplex": kalman.SimplexSigmaPoints,
}
every_set = pytest.mark.parametrize("points", POINTS.values(), ids=POINTS.keys())


def coast(x, dt):
    return np.array([x[0] + dt * x[1], x[1], x[2] + dt * x[3], x[3]])


def range_bearing(x):
    dx, dy = x[0] - STATION[0], x[2] - STATION[1]
    return np.array([math.hypot(dx, dy), math.atan2(dy, dx)])


def bearing_residual(a, b):
    return np.array([a[0] - b[0], angle(a[1] - b[1])])


def bearing_mean(sigmas, weights):
    sines, cosines = weights @ np.sin(sigmas[:, 1]), weights @ np.cos(sigmas[:, 1])
    return np.array([weights @ sigmas[:, 0], math.atan2(sines, cosines)])


def unscented(points, fx=coast, hx=range_bearing, m=2, **hooks):
    kf = kalman.UnscentedKalmanFilter(4, m, 0.5, hx, fx, points(4), **hooks)
    kf.x = np.array([10.0, 1.0, 5.0, -0.5])
    kf.P = np.diag([2.0, 0.5, 2.0, 0.5])
    kf.Q = np.kron(np.eye(2), common.Q_discrete_white_noise(2, 0.5, 0.05)) + 1e-4 * np.eye(4)
    kf.R = np.diag([0.1, 0.01])[:m, :m]
    return kf


def drive(rng, count=30):
    """Readings of range and bearing along a path that the filters above can follow."""
    x = np.array([10.0, 1.0, 5.0, -0.5])
    for _ in range(count):
        x = coast(x, 0.5)
        yield range_bearing(x) + [0.3, 0.1] * rng.standard_normal(2)


@every_set
@pytest.mark.parametrize("hooked", [False, True])
def test_unscented(points, hooked, rng):
    zs = list(drive(rng))
    hooks = {"residual_z": bearing_residual, "z_mean_fn": bearing_mean} if hooked else {}
    if hooked and points is POINTS["merwe, narrow"]:
        hooks = {"residual_z": bearing_residual, "z_mean_fn": lambda sigmas, weights: weights @ sigmas}

    def script(kf):
        for k, z in enumerate(zs):
            kf.predict(dt=0.5 + 0.1 * (k % 2))
            yield
            kf.update(z, R=kf.R * (1 + 0.1 * k))
            yield kf.log_likelihood, kf.likelihood, kf.mahalanobis

    # weights of a million leave ten digits, and FilterPy's mean is the plain one
    tolerance = 2e-7 if points is POINTS["merwe, narrow"] else 1e-9
    run_both(lambda: unscented(points, **hooks), script, tolerance=tolerance)


@every_set
def test_unscented_batch_and_smoother(points, rng):
    zs = list(drive(rng))

    def script(kf):
        saver = common.Saver(kf)
        means, covs = kf.batch_filter(zs, saver=saver)
        yield means, covs
        yield saver.x, saver.P, saver.K, saver.S, saver.sigmas_h
        yield kf.rts_smoother(means, covs)
        yield kf.rts_smoother(means, covs, dts=0.4)

    tolerance = 1e-6 if points is POINTS["merwe, narrow"] else 1e-9
    run_both(lambda: unscented(points), script, tolerance=tolerance)


def test_further_arguments_and_transforms(rng):
    zs = list(drive(rng, 10))

    def pushed(x, dt, push=0.0):
        return coast(x, dt) + push

    def moved(x, offset=0.0):
        return range_bearing(x) + offset

    def script(kf):
        for z in zs:
            kf.predict(push=0.01)
            kf.update(z, offset=0.02)
            yield
            kf.predict(fx=coast, UT=kalman.unscented_transform)
            kf.update(z[:1], R=0.2 * np.eye(1), hx=lambda x: range_bearing(x)[:1])
            yield kf.cross_variance(kf.x, np.ravel(kf.y), kf.sigmas_f, kf.sigmas_h)

    run_both(lambda: unscented(POINTS["julier"], pushed, moved), script)


def linear_pair(points, rng, axes=2):
    """The same linear problem for a Kalman filter and an unscented or a cubature one, both taken over."""
    base = tracker(False, axes)
    F, H = base.F, base.H
    if points is None:
        kf = kalman.CubatureKalmanFilter(4, 2, 1.0, lambda x: H @ x, lambda x, _: F @ x)
    else:
        kf = kalman.UnscentedKalmanFilter(4, 2, 1.0, lambda x: H @ x, lambda x, _: F @ x, points(4))
    kf.x, kf.P, kf.Q, kf.R = base.x, base.P, base.Q, base.R
    return sq.from_filterpy(base), sq.from_filterpy(kf), np.cumsum(rng.standard_normal((30, 2)), axis=0)


@pytest.mark.parametrize("points", [*POINTS.values(), None], ids=[*POINTS.keys(), "cubature"])
def test_a_linear_problem_gives_the_kalman_filter(points, rng):
    linear, other, zs = linear_pair(points, rng)
    tolerance = 1e-8 if points is POINTS["merwe, narrow"] else 1e-11
    for k, z in enumerate(zs):
        if k % 4 == 3:
            z[k % 2] = np.nan
        for kf in (linear, other):
            kf.predict()
            kf.update(z)
            if k % 5 == 0:
                kf.update(z + 0.1)  # two readings in one step
        both = [[np.ravel(kf.x), kf.P, kf.K, kf.S, np.ravel(kf.y)] for kf in (linear, other)]
        assert_equal(*both, "linear", tolerance)
        assert other.log_likelihood == pytest.approx(linear.log_likelihood, rel=1e-8)
        assert other.mahalanobis == pytest.approx(linear.mahalanobis, rel=1e-7)


@every_set
def test_the_unscented_smoother_is_the_smoother(points, rng):
    linear, other, zs = linear_pair(points, rng)
    ahead = linear.batch_filter(zs)
    states, covs, *_ = linear.rts_smoother(*ahead[:2])
    got = other.rts_smoother(*other.batch_filter(zs))
    assert_equal(
        [states, covs], list(got[:2]), "smoothed", 1e-6 if points is POINTS["merwe, narrow"] else 1e-10
    )


@every_set
def test_the_smoother_honours_each_noise(points, rng):
    linear, other, zs = linear_pair(points, rng)
    ahead = linear.batch_filter(zs)
    Qs = [linear.Q * (1 + k) for k in range(len(zs))]
    states, covs, *_ = linear.rts_smoother(*ahead[:2], Qs=Qs)
    got = other.rts_smoother(*ahead[:2], Qs=[*Qs[1:], Qs[0]])  # entry k leads from k
    assert_equal(
        [states, covs], list(got[:2]), "smoothed", 1e-6 if points is POINTS["merwe, narrow"] else 1e-10
    )


def test_cubature_without_process_noise(rng):
    """Where no noise comes between, points drawn anew have the moments of those that the process moved."""
    zs = rng.normal([10.0, 5.0], 1.0, (20, 2))

    def make():
        kf = kalman.CubatureKalmanFilter(4, 2, 0.5, lambda x, o: x[::2] + o, turning)
        kf.x, kf.P = np.array([10.0, 1.0, 5.0, -0.5]), np.diag([2.0, 0.5, 2.0, 0.5])
        kf.Q, kf.R = np.zeros((4, 4)), np.diag([0.1, 0.01])
        return kf

    def turning(x, dt, rate):
        turned = rate * dt * np.array([0.0, x[3], 0.0, -x[1]]) * math.cos(x[0])
        return coast(x, dt) + turned

    def script(kf):
        for z in zs:
            kf.predict(fx_args=0.3)
            yield
            kf.update(z[:, None], hx_args=(0.02,))
            yield kf.log_likelihood, kf.likelihood, kf.mahalanobis

    run_both(make, script, except_for=("sigmas_h", "y", "mahalanobis"))


# --- angles ---


def test_a_bearing_across_the_cut_needs_no_mean_function(rng):
    """Without `z_mean_fn` FilterPy averages 179° and -179° to 0°; the mean about a point does not."""

    def make(points, **hooks):
        kf = kalman.UnscentedKalmanFilter(
            2, 1, 1.0, lambda x: np.array([math.atan2(x[1], x[0])]), lambda x, _: x, points(2),
            residual_z=lambda a, b: np.array([angle(a[0] - b[0])]), **hooks,
        )  # fmt: skip
        kf.x, kf.P, kf.R, kf.Q = np.array([-10.0, 0.0]), np.eye(2), np.eye(1) * 0.01, np.zeros((2, 2))
        return kf

    spreads = []
    for points in POINTS.values():
        ours = sq.from_filterpy(make(points))
        theirs = make(points)
        for kf in (ours, theirs):
            kf.predict()
            kf.update(np.array([-math.pi + 0.05]))
        # the reading lies 0.05 rad beyond the cut: y = 10 sin(-0.05), of which the gain takes about a half
        assert abs(angle(ours.y[0] - 0.05)) < 1e-2
        assert ours.x[1] == pytest.approx(-0.25, abs=0.02)
        assert ours.S[0, 0] == pytest.approx(0.02, rel=0.05)
        spreads.append(theirs.S[0, 0])
    assert max(spreads) > 1.0


def test_headings_as_states(rng):
    """A compass that drifts over the cut, forward and smoothed, hooks in every place (#53, #197)."""

    def difference(a, b):
        return np.array([angle(a[0] - b[0]), a[1] - b[1]])

    def add(x, dx):
        return np.array([angle(x[0] + dx[0]), x[1] + dx[1]])

    def make():
        points = kalman.MerweScaledSigmaPoints(2, 0.5, 2.0, 1.0, subtract=difference)
        kf = kalman.UnscentedKalmanFilter(
            2, 1, 1.0, lambda x: x[:1], lambda x, dt: add(x, [dt * x[1], 0.0]), points,
            residual_x=difference, residual_z=lambda a, b: np.array([angle(a[0] - b[0])]), state_add=add,
        )  # fmt: skip
        kf.x, kf.P = np.array([3.0, 0.1]), np.diag([0.05, 0.01])
        kf.Q, kf.R = np.diag([1e-4, 1e-4]), np.eye(1) * 0.04
        return kf

    # the same without a cut is linear, and the Kalman filter has the answer
    linear = kalman.KalmanFilter(2, 1)
    linear.x, linear.P = np.array([3.0, 0.1]), np.diag([0.05, 0.01])
    linear.F, linear.H = np.array([[1.0, 1.0], [0, 1]]), np.array([[1.0, 0]])
    linear.Q, linear.R = np.diag([1e-4, 1e-4]), np.eye(1) * 0.04
    linear = sq.from_filterpy(linear)
    zs = 3.0 + 0.1 * np.arange(1, 60) + 0.2 * rng.standard_normal(59)
    ours = sq.from_filterpy(make())
    means, covs = ours.batch_filter([np.array([angle(z)]) for z in zs])
    expected = linear.batch_filter(zs)
    for mean, cov, x, P in zip(means, covs, *expected[:2], strict=True):
        np.testing.assert_allclose([angle(mean[0] - x[0]), mean[1]], [0.0, x[1]], atol=1e-10)
        np.testing.assert_allclose(cov, P, atol=1e-10)
    smoothed = ours.rts_smoother(means, covs)
    answer = linear.rts_smoother(*expected[:2])
    np.testing.assert_allclose(
        [angle(a - b) for a, b in zip(smoothed[0][:, 0], answer[0][:, 0], strict=True)], 0, atol=1e-10
    )
    np.testing.assert_allclose(smoothed[0][:, 1], answer[0][:, 1], atol=1e-10)
    np.testing.assert_allclose(smoothed[1], answer[1], atol=1e-10)
    assert np.abs(smoothed[0][:, 0]).max() <= math.pi
