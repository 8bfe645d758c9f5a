"""What FilterPy's users complain of most: covariances that turn indefinite, and noise of zero."""

from fractions import Fraction

import numpy as np
import pytest
from filterpy_scripts import assert_equal, kalman, tracker

import sequential as sq

FINE = [1e-5, 1e-6, 1e-7, 1e-8, 1e-9]


def exact_update(H, R):
    """Covariance after an update of the identity, in rational arithmetic on the same floats."""
    H = [[Fraction(float(v)) for v in row] for row in H]
    n, P = 3, [[Fraction(int(i == j)) for j in range(3)] for i in range(3)]
    for i, h in enumerate(H):
        Ph = [sum(P[r][c] * h[c] for c in range(n)) for r in range(n)]
        s = sum(h[r] * Ph[r] for r in range(n)) + Fraction(float(R[i][i]))
        P = [[P[r][c] - Ph[r] * Ph[c] / s for c in range(n)] for r in range(n)]
    return np.array([[float(v) for v in row] for row in P])


def bierman_case(kind, d):
    """P = I, H = [[1, 1, 1], [1, 1, 1 + d]], R = d² I (Bierman; Grewal and Andrews, example 6.2)."""
    H, R = np.array([[1.0, 1.0, 1.0], [1.0, 1.0, 1.0 + d]]), d**2 * np.eye(2)
    if kind == "KalmanFilter":
        kf = kalman.KalmanFilter(3, 2)
        kf.H, kf.R = H, R
    elif kind == "SquareRootKalmanFilter":
        kf = kalman.SquareRootKalmanFilter(3, 2)
        kf.H, kf.R = H, R
    elif kind == "CubatureKalmanFilter":
        kf = kalman.CubatureKalmanFilter(3, 2, 1.0, lambda x: H @ x, lambda x, _: x)
        kf.R, kf.Q = R, np.zeros((3, 3))
    else:
        points = kalman.MerweScaledSigmaPoints(3, 0.5, 2.0, 0.0)
        kf = kalman.UnscentedKalmanFilter(3, 2, 1.0, lambda x: H @ x, lambda x, _: x, points)
        kf.R, kf.Q = R, np.zeros((3, 3))
    return sq.from_filterpy(kf), exact_update(H, R)


@pytest.mark.parametrize("d", FINE)
@pytest.mark.parametrize("kind", ["KalmanFilter", "SquareRootKalmanFilter"])
def test_nearly_redundant_readings(kind, d):
    ours, exact = bierman_case(kind, d)
    ours.update(np.array([1.0, 1.0]))
    # a square root through QR is good to about the root of what UD is
    assert np.abs(ours.P - exact).max() < (1e-8 if kind == "KalmanFilter" else 2e-7)
    assert np.isfinite(ours.x).all()
    assert np.isfinite(ours.log_likelihood)


@pytest.mark.parametrize("d", [*FINE, 1e-12])
@pytest.mark.parametrize("kind", ["CubatureKalmanFilter", "UnscentedKalmanFilter"])
def test_nearly_redundant_readings_through_sigma_points(kind, d):
    """Sums over points are good to 1e-16 of S, so what R tells below that is lost, but nothing breaks."""
    ours, exact = bierman_case(kind, d)
    ours.update(np.array([1.0, 1.0]))
    assert np.isfinite(ours.x).all()
    assert np.linalg.eigvalsh(ours.P).min() > -1e-15
    if d > 1e-6:
        assert np.abs(ours.P - exact).max() < 1e-4


def unscented_of(kf, points):
    """The same linear problem through sigma points."""
    F, H = kf.F, kf.H
    other = kalman.UnscentedKalmanFilter(
        kf.dim_x, kf.dim_z, 1.0, lambda x: H @ x, lambda x, _: F @ x, points(kf.dim_x)
    )
    other.x, other.P, other.Q, other.R = kf.x.ravel(), kf.P, kf.Q, kf.R
    return other


def square_root_of(kf):
    other = kalman.SquareRootKalmanFilter(kf.dim_x, kf.dim_z)
    other.x, other.F, other.H = kf.x, kf.F, kf.H
    other = sq.from_filterpy(other)
    other.P, other.Q, other.R = kf.P, kf.Q, kf.R
    return other


SAME = {
    "kalman": lambda kf: kf,
    "square root": square_root_of,
    "merwe": lambda kf: unscented_of(kf, lambda n: kalman.MerweScaledSigmaPoints(n, 0.1, 2.0, 0.0)),
    "julier": lambda kf: unscented_of(kf, lambda n: kalman.JulierSigmaPoints(n, 1.0)),
    "simplex": lambda kf: unscented_of(kf, kalman.SimplexSigmaPoints),
}
every_filter = pytest.mark.parametrize("same", SAME.values(), ids=SAME.keys())


@every_filter
@pytest.mark.parametrize("noise", ["none", "of rank one"])
def test_readings_without_noise(same, noise, rng):
    """R = 0 (#214): each reading is met exactly, also twice, also without process noise in between."""
    kf = tracker(False, 2)
    kf.R = np.zeros((2, 2))
    if noise == "none":
        kf.Q = np.zeros((4, 4))
    ours = sq.from_filterpy(same(kf))
    for k in range(12):
        z = np.array([1.0 + 0.5 * k, 2.0 - 0.2 * k])
        if noise != "none":
            z = z + 0.1 * rng.standard_normal(2)
        ours.predict()
        for _ in range(2):
            ours.update(z)
            np.testing.assert_allclose(kf.H @ ours.x, z, atol=1e-9)
            np.testing.assert_allclose(kf.H @ ours.P @ kf.H.T, 0.0, atol=1e-12)
        assert np.linalg.eigvalsh(ours.P).min() > -1e-14
        assert np.isfinite([ours.log_likelihood, ours.mahalanobis]).all()
    if noise == "none":
        np.testing.assert_allclose(ours.x, [z[0], 1.0, z[1], -0.4], atol=1e-7)
        np.testing.assert_allclose(ours.P, 0.0, atol=1e-12)


@every_filter
def test_a_state_that_is_known(same, rng):
    """Rows of zeros in P and Q: what is known stays known, and the rest is filtered as if alone."""
    kf = tracker(False, 2)
    kf.P[2:, :], kf.P[:, 2:], kf.Q[2:, :], kf.Q[:, 2:] = 0.0, 0.0, 0.0, 0.0
    alone = tracker(False, 1)
    alone.x, alone.P, alone.Q, alone.R = kf.x[:2], kf.P[:2, :2], kf.Q[:2, :2], kf.R[:1, :1]
    ours, alone = sq.from_filterpy(same(kf)), sq.from_filterpy(alone)
    known = kf.x[2:].copy()
    for _ in range(20):
        z = rng.standard_normal(2)
        known = kf.F[2:, 2:] @ known
        for filter_, reading in ((ours, z), (alone, z[:1])):
            filter_.predict()
            filter_.update(reading)
        assert_equal([alone.x, alone.P], [ours.x[:2], ours.P[:2, :2]], "the rest", 1e-10)
        assert_equal([known, np.zeros((2, 4))], [ours.x[2:], ours.P[2:]], "what is known", 1e-12)


@every_filter
def test_a_nearly_perfect_sensor_for_long(same):
    """P0 = diag(1e8, 1e4), R = 1e-10, almost no process noise: no variance is lost to rounding."""
    kf = kalman.KalmanFilter(2, 1)
    kf.F, kf.H = np.array([[1.0, 0.01], [0, 1.0]]), np.array([[1.0, 0.0]])
    kf.x, kf.P, kf.R = np.zeros(2), np.diag([1e8, 1e4]), np.array([[1e-10]])
    kf.Q = 1e-12 * np.array([[1e-6 / 3, 1e-4 / 2], [1e-4 / 2, 1e-2]])
    ours = sq.from_filterpy(same(kf))
    for k in range(400):
        ours.predict()
        ours.update(np.array([0.01 * k]))
        assert np.linalg.eigvalsh(ours.P).min() > -1e-22
        assert (np.diag(ours.P) > 0).all()
    assert ours.x[1] == pytest.approx(1.0, abs=1e-3)


def test_a_curved_problem_that_breaks_filterpy(rng):
    """A negative weight and a strongly curved sensor make P - K S Kᵀ indefinite (#62, #218, #296)."""

    def make():
        points = kalman.MerweScaledSigmaPoints(3, 1.0, 0.0, -2.5)
        kf = kalman.UnscentedKalmanFilter(
            3, 2, 1.0, curved, lambda x, _: x + 0.3 * np.sin(2.0 * x[::-1]), points
        )
        kf.x, kf.P, kf.Q, kf.R = np.ones(3), 4.0 * np.eye(3), 1e-4 * np.eye(3), 1e-6 * np.eye(2)
        return kf

    def curved(x):
        return np.array([x[0] ** 2 + x[1], x[1] * x[2] + x[0] ** 3])

    theirs, ours = make(), sq.from_filterpy(make())
    broken = False
    for _ in range(30):
        z = curved(np.ones(3)) + 1e-3 * rng.standard_normal(2)
        ours.predict()
        ours.update(z)
        assert np.linalg.eigvalsh(ours.P).min() >= -1e-12 * np.abs(ours.P).max()
        assert np.isfinite(ours.x).all()
        if not broken:
            try:
                theirs.predict()
                theirs.update(z)
            except np.linalg.LinAlgError:
                broken = True
    assert broken


@every_filter
def test_components_that_are_missing(same, rng):
    """NaN in a component is the update by the others alone; all NaN is none."""
    kf = tracker(False, 2)
    kf.R = np.array([[0.3, 0.1], [0.1, 0.5]])
    ours, other = sq.from_filterpy(same(kf)), sq.from_filterpy(tracker(False, 2))
    for k in range(12):
        z = rng.standard_normal(2)
        ours.predict()
        other.predict()
        if k % 4 == 3:
            ours.update(np.full(2, np.nan))
            assert ours.log_likelihood == 0.0
            other.update(None)
        else:
            rows = [0, 1] if k % 4 == 2 else [k % 4]
            ours.update(np.where(np.isin([0, 1], rows), z, np.nan))
            other.update(z[rows], R=kf.R[np.ix_(rows, rows)], H=kf.H[rows])
            assert ours.mahalanobis == pytest.approx(other.mahalanobis, rel=1e-9)
        assert ours.log_likelihood == pytest.approx(other.log_likelihood, rel=1e-9)
        assert_equal([other.x, other.P], [ours.x, ours.P], "missing", 1e-10)


def test_components_that_are_missing_in_the_other_families(rng):
    kf, H = tracker(False, 2), tracker(False, 2).H
    information = kalman.InformationFilter(4, 2)
    information.x, information.F, information.H, information.Q = kf.x, kf.F, kf.H, kf.Q
    information.P_inv, information.R_inv = np.linalg.inv(kf.P), np.linalg.inv(kf.R)
    extended = kalman.ExtendedKalmanFilter(4, 2)
    extended.x, extended.P, extended.F, extended.Q, extended.R = kf.x, kf.P, kf.F, kf.Q, kf.R
    linear, information, extended = (sq.from_filterpy(f) for f in (kf, information, extended))
    for k in range(12):
        z = np.where(np.arange(2) == k % 3, np.nan, rng.standard_normal(2))
        z = None if k == 5 else z
        for filter_ in (linear, information, extended):
            filter_.predict()
        linear.update(z)
        information.update(z)
        extended.update(z, lambda _: H, lambda x: H @ x)
        for filter_ in (information, extended):
            assert_equal([linear.x, linear.P, linear.y], [filter_.x, filter_.P, filter_.y], "missing", 1e-10)
            assert filter_.log_likelihood == pytest.approx(linear.log_likelihood, abs=1e-9)


def test_an_information_filter_that_begins_by_knowing_nothing(rng):
    """P_inv = 0: after enough readings it is least squares."""
    kf = kalman.InformationFilter(2, 1)
    kf.F, kf.H = np.array([[1.0, 1.0], [0, 1.0]]), np.array([[1.0, 0.0]])
    kf.P_inv, kf.Q, kf.R_inv = np.zeros((2, 2)), np.zeros((2, 2)), 4.0
    ours = sq.from_filterpy(kf)
    zs = 2.0 + 0.7 * np.arange(8) + 0.5 * rng.standard_normal(8)
    assert np.isinf(np.diag(ours.P)).all()
    for k, z in enumerate(zs):
        if k:
            ours.predict()
        ours.update(z)
        rows = np.column_stack([np.ones(k + 1), np.arange(-k, 1)])
        assert ours.P_inv == pytest.approx(4.0 * rows.T @ rows, rel=1e-9)
        if k:
            expected, *_ = np.linalg.lstsq(rows, zs[: k + 1], rcond=None)
            np.testing.assert_allclose(ours.x.ravel(), expected, rtol=1e-7, atol=1e-7)
    assert np.isfinite(ours.log_likelihood)


@every_filter
def test_a_smoother_of_noise_of_low_rank(same, rng):
    """RTS with a singular predicted covariance: states without process noise, one of them known."""
    kf = tracker(False, 2)
    kf.Q = np.zeros((4, 4))
    kf.P[3], kf.P[:, 3] = 0.0, 0.0
    ours = sq.from_filterpy(same(kf))
    if not hasattr(ours, "rts_smoother"):
        return
    zs = rng.standard_normal((15, 2))
    means, covs, *_ = ours.batch_filter(zs)
    states, spread, *_ = ours.rts_smoother(means, covs)
    for k in range(15):
        # without process noise the smoothed state is the last one, carried back
        back = np.linalg.matrix_power(np.linalg.inv(kf.F), 14 - k)
        assert_equal([back @ means[-1], back @ covs[-1] @ back.T], [states[k], spread[k]], "smoothed", 1e-8)


def test_what_is_not_a_covariance_is_refused():
    ours = sq.from_filterpy(tracker(False, 2))
    with pytest.raises(sq.FactorlabError, match="P is not positive semi-definite: smallest eigenvalue -2"):
        ours.P = [3.0, -2.0, 1.0, 1.0]
    with pytest.raises(sq.FactorlabError, match="Q is not positive semi-definite: smallest eigenvalue -1"):
        ours.Q = [[1.0, 2, 0, 0], [2.0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    with pytest.raises(sq.FactorlabError, match="R is not symmetric"):
        ours.R = [[1.0, 0.5], [0.2, 1.0]]
    ours = sq.from_filterpy(tracker(False, 2))
    ours.P[0, 0] = np.nan
    with pytest.raises(sq.FactorlabError, match="P holds NaN"):
        ours.update([1.0, 1.0])


def test_a_singular_transition_of_information_is_refused():
    kf = kalman.InformationFilter(2, 1)
    kf.F, kf.H = np.eye(2), np.array([[1.0, 0.0]])
    ours = sq.from_filterpy(kf)
    ours.F = np.zeros((2, 2))
    ours.predict()  # through the covariance, which is Q afterwards
    assert pytest.approx(np.eye(2)) == ours.P
    ours.P_inv = np.zeros((2, 2))
    with pytest.raises(sq.FactorlabError, match="information cannot be carried over"):
        ours.predict()
