"""Readings whose noise is correlated with the step that led to them, against the joint Gaussian of it all."""

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter as Peer

import sequential as sq
from sequential.errors import ModelError, NotPositiveDefiniteError, ShapeError

F = np.array([[1.0, 0.1], [0.0, 0.9]])
Q = np.array([[0.2, 0.05], [0.05, 0.1]])
H = np.array([[1.0, 0.0], [0.5, 1.0]])
R = np.array([[0.5, 0.1], [0.1, 0.4]])
C = np.array([[0.12, -0.05], [0.06, 0.1]])
MEAN, COV = np.array([1.0, -1.0]), np.array([[1.0, 0.2], [0.2, 2.0]])
STEPS = 12

FORMS = {
    "kf": sq.KalmanFilter(),
    "ud": sq.KalmanFilter(form="ud"),
    "sqrt": sq.KalmanFilter(form="sqrt"),
    "ekf": sq.ExtendedKalmanFilter(),
    "ukf": sq.UnscentedKalmanFilter(),
    "ckf": sq.CubatureKalmanFilter(),
}


def plain(**settings):
    sensor = sq.LinearSensor(H, R, **settings)
    return sq.StateSpace(sq.Vector(2), sq.Gaussian(MEAN, COV), sq.LinearProcess(F, Q), {"z": sensor}, start=0)


def joint(z):
    """Means and covariances of all states given the first k readings, from one big Gaussian."""
    sources = 2 + 4 * STEPS  # prior, then w and v of every step
    noise = np.zeros((sources, sources))
    noise[:2, :2] = COV
    state, mean = np.zeros((2, sources)), MEAN
    state[:, :2] = np.eye(2)
    states, seen, expected = [], [], []
    for k in range(STEPS):
        w, v = slice(2 + 4 * k, 4 + 4 * k), slice(4 + 4 * k, 6 + 4 * k)
        noise[w, w], noise[v, v], noise[w, v], noise[v, w] = Q, R, C, C.T
        state, mean = F @ state, F @ mean
        state[:, w] += np.eye(2)
        row = H @ state
        row[:, v] += np.eye(2)
        states.append((state.copy(), mean))
        seen.append(row)
        expected.append(H @ mean)
    rows, forecast = np.concatenate(seen), np.concatenate(expected)

    def given(k, count):
        A, m = states[k]
        S = rows[: 2 * count] @ noise @ rows[: 2 * count].T
        cross = A @ noise @ rows[: 2 * count].T
        gain = np.linalg.solve(S, cross.T).T
        return m + gain @ (z[:count].ravel() - forecast[: 2 * count]), A @ noise @ A.T - gain @ cross.T

    return given


@pytest.fixture
def case(rng):
    z = rng.normal(size=(STEPS, 2))
    return z, sq.SensorLog({"z": sq.Stream(np.arange(1.0, STEPS + 1), z)})


@pytest.mark.parametrize("form", FORMS)
def test_every_form_gives_the_conditional_gaussian(form, case):
    z, log = case
    run = sq.run(FORMS[form], sq.correlated_noise(plain(), {"z": C}), log)
    given = joint(z)
    for k in range(STEPS):
        mean, cov = given(k, k + 1)
        np.testing.assert_allclose(run.part("state")[k + 1], mean, atol=1e-10)
        np.testing.assert_allclose(run.cov[k + 1, :2, :2], cov, atol=1e-10)


@pytest.mark.parametrize("form", FORMS)
def test_smoothers_stay_exact(form, case):
    z, log = case
    keeping = type(FORMS[form])(
        keep=True, **({"form": FORMS[form].form} if hasattr(FORMS[form], "form") else {})
    )
    run = sq.run(sq.RauchTungStriebel(keeping), sq.correlated_noise(plain(), {"z": C}), log)
    given = joint(z)
    for k in range(STEPS):
        mean, cov = given(k, STEPS)
        np.testing.assert_allclose(run.part("state")[k + 1], mean, atol=1e-9)
        np.testing.assert_allclose(run.cov[k + 1, :2, :2], cov, atol=1e-9)


def test_filterpy_agrees_about_the_filter(case):
    z, log = case
    peer = Peer(dim_x=2, dim_z=2)
    peer.x, peer.P, peer.F, peer.Q, peer.H, peer.R, peer.M = MEAN[:, None], COV.copy(), F, Q, H, R, C
    run = sq.run(sq.KalmanFilter(), sq.correlated_noise(plain(), {"z": C}), log)
    for k in range(STEPS):
        peer.predict()
        peer.update_correlated(z[k][:, None])
        np.testing.assert_allclose(run.part("state")[k + 1], peer.x[:, 0], atol=1e-10)


def test_what_was_not_declared_shows(rng):
    """A filter that takes correlated noises for independent ones is not consistent; the declared one is."""
    count, joint_cov = 4000, np.block([[Q, C], [C.T, R]])
    noise = rng.multivariate_normal(np.zeros(4), joint_cov, size=count)
    x, states, z = rng.multivariate_normal(MEAN, COV), [], []
    for w in noise:
        x = F @ x + w[:2]
        states.append(x)
        z.append(H @ x + w[2:])
    log = sq.SensorLog({"z": sq.Stream(np.arange(1.0, count + 1), z)})
    found = {}
    for name, model in (("declared", sq.correlated_noise(plain(), {"z": C})), ("ignored", plain())):
        run = sq.run(sq.KalmanFilter(), model, log)
        error = np.array(states) - run.mean[1:, :2]
        found[name] = np.einsum("ki,kij,kj->k", error, np.linalg.inv(run.cov[1:, :2, :2]), error).mean() / 2
    assert found["declared"] == pytest.approx(1.0, abs=0.06)
    assert abs(found["ignored"] - 1.0) > 0.15


def test_no_correlation_is_the_model_itself():
    model = plain()
    assert sq.correlated_noise(model, {"z": np.zeros((2, 2))}) is model


def test_impossible_correlations_are_refused():
    with pytest.raises(NotPositiveDefiniteError, match="explains more of the readings' noise than there is"):
        sq.correlated_noise(plain(), {"z": 10 * C})
    with pytest.raises(ShapeError, match=r"cross_cov\['z'\] has shape \(2, 1\)"):
        sq.correlated_noise(plain(), {"z": [0.1, 0.1]})
    with pytest.raises(ModelError, match="no sensor 'gps'; the model has z"):
        sq.correlated_noise(plain(), {"gps": C})
    drifting = sq.StateSpace(
        sq.Vector(2), sq.Gaussian(MEAN, COV), sq.ConstantVelocity(1.0), {"z": sq.LinearSensor(H, R)}
    )
    with pytest.raises(ModelError, match="constant F and Q; this is ConstantVelocity"):
        sq.correlated_noise(drifting, {"z": C})
