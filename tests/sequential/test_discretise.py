"""Discretisation: closed forms against van Loan's exponential, and figures published elsewhere."""

import numpy as np
import pytest

import sequential as sq
from sequential import discretise
from sequential.errors import ModelError

LENGTHS = (1e-4, 0.1, 1.0, 7.0)


def integrators(order):
    a = np.eye(order, k=1)
    g = np.eye(order)[:, -1:]
    return a, g


@pytest.mark.parametrize("dt", LENGTHS)
@pytest.mark.parametrize(
    ("order", "closed"), [(2, discretise.white_noise_acceleration), (3, discretise.white_noise_jerk)]
)
def test_white_noise_through_integrators(order, closed, dt):
    f, q = sq.van_loan(*integrators(order), 0.5, dt)
    expected_f, expected_q = closed(dt, 0.5)
    np.testing.assert_allclose(f, expected_f, rtol=1e-14, atol=0)
    np.testing.assert_allclose(q, expected_q, rtol=1e-12)
    wide_f, wide_q = closed(dt, 0.5, axes=3)
    np.testing.assert_array_equal(wide_f[1::3, 1::3], expected_f)
    np.testing.assert_array_equal(wide_q[2::3, 2::3], expected_q)
    assert not wide_q[0::3, 1::3].any()


def test_the_figures_of_the_books():
    """dt = 0.1, q = 0.5: to the last digit; and an oscillator whose figures filterpy prints."""
    _, q = sq.van_loan(*integrators(2), 0.5, 0.1)
    np.testing.assert_allclose(q, 0.5 * np.array([[1e-3 / 3, 5e-3], [5e-3, 0.1]]), rtol=0, atol=1e-17)
    _, q = sq.van_loan(*integrators(3), 0.5, 0.1)
    exact = [[1e-5 / 20, 1e-4 / 8, 1e-3 / 6], [1e-4 / 8, 1e-3 / 3, 1e-2 / 2], [1e-3 / 6, 1e-2 / 2, 0.1]]
    np.testing.assert_allclose(q, 0.5 * np.array(exact), rtol=0, atol=1e-17)
    f, q = sq.van_loan([[0, 1], [-1, 0]], [[0], [2]], 1.0, 0.1)
    np.testing.assert_allclose(f, [[0.9950041653, 0.0998334166], [-0.0998334166, 0.9950041653]], atol=5e-11)
    np.testing.assert_allclose(q, [[0.0013306692, 0.0199334222], [0.0199334222, 0.3986693308]], atol=5e-11)


def test_the_process_models_are_the_same_matrices():
    model_q = {
        "cv": (sq.ConstantVelocity(0.7, axes=2), discretise.white_noise_acceleration(0.3, 0.7, axes=2)),
        "ca": (sq.ConstantAcceleration(0.7, axes=2), discretise.white_noise_jerk(0.3, 0.7, axes=2)),
        "singer": (sq.Singer(2.0, 0.7, axes=2), discretise.singer(0.3, 2.0, 0.7, axes=2)),
        "turn": (sq.CoordinatedTurn(0.5, 0.7), discretise.coordinated_turn(0.3, 0.5, 0.7)),
        "ou": (sq.GaussMarkov([2.0, 9.0], 0.7), discretise.gauss_markov(0.3, [2.0, 9.0], 0.7)),
    }
    for process, (f, q) in model_q.values():
        n = len(f)
        functions, out = process.functions(sq.Vector(n)), np.zeros((2, n * n))
        functions.jacobian(np.zeros(n), np.zeros(1), 0.3, functions.params, out[0])
        functions.noise(np.zeros(n), np.zeros(1), 0.3, functions.params, out[1])
        np.testing.assert_allclose(out[0].reshape(n, n), f, rtol=0, atol=1e-14)
        np.testing.assert_allclose(out[1].reshape(n, n), q, rtol=0, atol=1e-14 * np.abs(q).max())


@pytest.mark.parametrize("dt", [0.5, 2.0, 30.0])
def test_singer_is_singers_closed_form(dt):
    """Singer 1970, with α = 1/τ; at dt/τ of a tenth the closed form still has ten digits."""
    tau, sigma = 5.0, 1.5
    a, T = 1.0 / tau, dt
    e, f = np.exp(-a * T), discretise.singer(dt, tau, sigma)
    transition = [[1, T, (a * T - 1 + e) / a**2], [0, 1, (1 - e) / a], [0, 0, e]]
    q11 = (1 - e**2 + 2 * a * T + 2 * a**3 * T**3 / 3 - 2 * a**2 * T**2 - 4 * a * T * e) / (2 * a**5)
    q12 = (e**2 + 1 - 2 * e + 2 * a * T * e - 2 * a * T + a**2 * T**2) / (2 * a**4)
    q13 = (1 - e**2 - 2 * a * T * e) / (2 * a**3)
    q22 = (4 * e - 3 - e**2 + 2 * a * T) / (2 * a**3)
    q23, q33 = (e**2 + 1 - 2 * e) / (2 * a**2), (1 - e**2) / (2 * a)
    cov = 2 * a * sigma**2 * np.array([[q11, q12, q13], [q12, q22, q23], [q13, q23, q33]])
    np.testing.assert_allclose(f[0], transition, rtol=1e-12)
    np.testing.assert_allclose(f[1], cov, rtol=1e-9)


def test_singer_between_its_limits():
    """Short steps see white jerk, short time constants white acceleration."""
    tau, sigma = 1e4, 0.3
    jerk = discretise.white_noise_jerk(0.1, 2 * sigma**2 / tau)
    for one, other in zip(discretise.singer(0.1, tau, sigma), jerk, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-4, atol=1e-12)
    tau = 1e-5
    _, q = discretise.singer(1.0, tau, sigma)
    np.testing.assert_allclose(
        q[:2, :2], discretise.white_noise_acceleration(1.0, 2 * sigma**2 * tau)[1], rtol=1e-4
    )


def test_a_turn_keeps_the_speed():
    f, _ = discretise.coordinated_turn(0.5, np.pi, 0.1)
    np.testing.assert_allclose(f @ [0, 0, 2.0, 0], [2 / np.pi, 2 / np.pi, 0, 2.0], atol=1e-14)
    still, noise = discretise.coordinated_turn(0.5, 0.0, 0.1)
    straight, expected = discretise.white_noise_acceleration(0.5, 0.1, axes=2)
    np.testing.assert_allclose(still, straight, atol=1e-15)
    np.testing.assert_allclose(noise, expected, atol=1e-16)


def test_piecewise_noise_belongs_to_its_interval():
    """One acceleration per step: rank one, and not what two half steps give."""
    f, q = discretise.piecewise_white_acceleration(2.0, 0.3)
    np.testing.assert_allclose(q, 0.09 * np.array([[4.0, 4.0], [4.0, 4.0]]))
    half_f, half_q = discretise.piecewise_white_acceleration(1.0, 0.3)
    np.testing.assert_allclose(f, half_f @ half_f)
    assert np.abs(half_f @ half_q @ half_f.T + half_q - q).max() > 0.1
    _, q = discretise.piecewise_white_jerk(2.0, 0.3)
    np.testing.assert_allclose(q, 0.09 * np.outer([2.0, 2.0, 1.0], [2.0, 2.0, 1.0]))


@pytest.mark.parametrize("dt", [0.0, *LENGTHS, 300.0])
def test_an_input_is_held(dt):
    """A spring pushed by a constant force settles where force and spring balance."""
    a, b = [[0.0, 1.0], [-4.0, -1.0]], [[0.0], [2.0]]
    f, q, moved = sq.van_loan(a, [[0.0], [1.0]], 0.3, dt, b)
    expected = np.linalg.solve(np.array(a), (f - np.eye(2)) @ b)
    np.testing.assert_allclose(moved, expected, rtol=1e-12, atol=1e-15)
    assert np.linalg.eigvalsh(q).min() >= -1e-18
    if dt == 300.0:
        np.testing.assert_allclose(moved.ravel(), [0.5, 0.0], atol=1e-12)
        np.testing.assert_allclose(q, np.diag([0.3 / (2 * 4.0), 0.3 / 2]), atol=1e-12)  # stationary spring


def test_a_negative_interval_is_refused():
    with pytest.raises(ModelError, match=r"dt is -1.0; it must be zero or more"):
        discretise.white_noise_jerk(-1.0, 1.0)
