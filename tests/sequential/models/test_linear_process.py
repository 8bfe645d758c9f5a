"""Matrices given step by step: applied once a step, whatever its length, and read from tables by row."""

import numpy as np
import pytest

import sequential as sq
from sequential.errors import DataError, FactorlabError, ModelError, NotPositiveDefiniteError, ShapeError

F = np.array([[1.0, 0.5], [-0.1, 0.9]])
Q = np.array([[0.2, 0.05], [0.05, 0.1]])
B = np.array([[0.0], [2.0]])
H = np.array([[1.0, 0.0]])


def declare(process, **more):
    return sq.StateSpace(
        sq.Vector(2), sq.Gaussian([1.0, -1.0], [2.0, 1.0]), process, {"z": sq.LinearSensor(H, 0.3)},
        start=0.0, **more,
    )  # fmt: skip


def textbook(z, transition, noise, control=None, u=None):
    """The Kalman filter in three lines of NumPy, one step between two readings."""
    x, p = np.array([1.0, -1.0]), np.diag([2.0, 1.0])
    means, covs = [], []
    for k, reading in enumerate(z):
        if k:
            f = transition[k - 1]
            x, p = f @ x, f @ p @ f.T + noise[k - 1]
            if u is not None:
                x = x + control[k - 1] @ u[k - 1]
        s = H @ p @ H.T + 0.3
        gain = p @ H.T / s
        x, p = x + (gain * (reading - H @ x)).ravel(), (np.eye(2) - gain @ H) @ p
        means.append(x)
        covs.append(p)
    return np.array(means), np.array(covs)


@pytest.fixture
def stamps(rng):
    """Irregular on purpose: the matrices hold for a step, not for a time."""
    return np.cumsum(np.concatenate([[0.0], rng.uniform(0.1, 3.0, 39)]))


def test_it_is_the_textbook_filter_however_long_the_steps(rng, stamps):
    z = rng.standard_normal((40, 1))
    run = sq.run(
        sq.KalmanFilter(), declare(sq.LinearProcess(F, Q)), sq.SensorLog({"z": sq.Stream(stamps, z)})
    )
    mean, cov = textbook(z, [F] * 40, [Q] * 40)
    np.testing.assert_allclose(run.mean, mean, atol=1e-12)
    np.testing.assert_allclose(run.cov, cov, atol=1e-12)


def test_an_input_is_multiplied_by_its_matrix(rng, stamps):
    z, u = rng.standard_normal((40, 1)), rng.standard_normal((40, 1))
    log = sq.SensorLog({"z": sq.Stream(stamps, z), "push": sq.Stream(stamps, u)})
    run = sq.run(sq.KalmanFilter(), declare(sq.LinearProcess(F, Q, B), input="push"), log)
    mean, cov = textbook(z, [F] * 40, [Q] * 40, [B] * 40, u)
    np.testing.assert_allclose(run.mean, mean, atol=1e-12)
    np.testing.assert_allclose(run.cov, cov, atol=1e-12)


@pytest.mark.parametrize("which", ["F", "Q", "B", "FQB"])
def test_tables_are_read_row_by_row(rng, stamps, which):
    z, u = rng.standard_normal((40, 1)), rng.standard_normal((40, 1))
    tables = {"F": F + 0.1 * rng.standard_normal((7, 2, 2)), "B": B + rng.standard_normal((7, 2, 1))}
    tables["Q"] = np.array([k * Q for k in range(1, 8)])
    rows = rng.integers(0, 7, 40)
    given = {name: tables[name] if name in which else one for name, one in (("F", F), ("Q", Q), ("B", B))}
    log = sq.SensorLog({"z": sq.Stream(stamps, z), "row": sq.tabulated_input(stamps, u, rows)})
    run = sq.run(sq.KalmanFilter(), declare(sq.LinearProcess(**given), input="row"), log)
    each = {name: value[rows] if value.ndim == 3 else [value] * 40 for name, value in given.items()}
    mean, cov = textbook(z, each["F"], each["Q"], each["B"], u)
    np.testing.assert_allclose(run.mean, mean, atol=1e-12)
    np.testing.assert_allclose(run.cov, cov, atol=1e-12)


def test_a_table_without_rows_is_walked_in_order(rng, stamps):
    z, table = rng.standard_normal((40, 1)), F + 0.1 * rng.standard_normal((40, 2, 2))
    log = sq.SensorLog({"z": sq.Stream(stamps, z), "row": sq.tabulated_input(stamps)})
    run = sq.run(sq.KalmanFilter(), declare(sq.LinearProcess(table, Q), input="row"), log)
    np.testing.assert_allclose(run.mean, textbook(z, table, [Q] * 40)[0], atol=1e-12)


@pytest.mark.parametrize(
    "estimator", [sq.UnscentedKalmanFilter(), sq.RauchTungStriebel(), sq.IteratedSmoother()]
)
def test_other_estimators_take_tables_too(rng, stamps, estimator):
    log = sq.SensorLog(
        {"z": sq.Stream(stamps, rng.standard_normal((40, 1))), "row": sq.tabulated_input(stamps)}
    )
    model = declare(sq.LinearProcess(F + 0.1 * rng.standard_normal((40, 2, 2)), Q), input="row")
    run, kalman = sq.run(estimator, model, log), sq.run(sq.KalmanFilter(), model, log)
    np.testing.assert_allclose(run.mean[-1], kalman.mean[-1], atol=1e-9)
    np.testing.assert_allclose(run.cov[-1], kalman.cov[-1], atol=1e-9)


@pytest.mark.parametrize("row", [3.0, -1.0, 0.5])
def test_a_row_that_is_not_there_is_named(row):
    model = declare(sq.LinearProcess(np.stack([F] * 3), Q), input="row")
    t = np.arange(4.0)
    log = sq.SensorLog({"z": sq.Stream(t, t), "row": sq.tabulated_input(t, rows=[0, 1, row, 2])})
    with pytest.raises(DataError, match=rf"log\['row'\] asks for row {row:g} at sample 2.*rows 0 to 2"):
        sq.run(sq.KalmanFilter(), model, log)


MISFITS = {
    "F": (lambda: sq.LinearProcess(np.zeros((2, 3)), Q), ShapeError, r"F of a LinearProcess is square"),
    "Q": (lambda: sq.LinearProcess(F, -Q), NotPositiveDefiniteError, "Q of a LinearProcess is not positive"),
    "one Q of many": (
        lambda: sq.LinearProcess(F, np.stack([Q, -Q])), NotPositiveDefiniteError, r"Q\[1\] of a Linear",
    ),
    "B": (lambda: sq.LinearProcess(F, Q, np.zeros((3, 1))), ShapeError, r"B .* has shape \(2, m\)"),
    "lengths": (
        lambda: sq.LinearProcess(np.stack([F] * 3), np.stack([Q] * 4)), ShapeError, r"got \[3, 4\] rows",
    ),
    "infinite": (lambda: sq.LinearProcess(F * np.inf, Q), FactorlabError, "F .* holds NaN or infinity"),
    "manifold": (
        lambda: sq.LinearProcess(F, Q).functions(sq.SE2()), ModelError, r"LinearProcess needs Vector\(2\)",
    ),
}  # fmt: skip


@pytest.mark.parametrize("misfit", MISFITS)
def test_a_misfit_is_a_sentence(misfit):
    make, error, message = MISFITS[misfit]
    with pytest.raises(error, match=message):
        make()


def test_a_product_of_vectors_is_flat_enough():
    assert sq.LinearProcess(F, Q).functions(sq.Product(a=sq.Vector(1), b=sq.Vector(1))).inputs == 0
