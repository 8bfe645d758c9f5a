"""Linear differential equations: exact over any step, and the same however the step is cut."""

import numpy as np
import pytest
from linear_processes import CONTINUOUS, SWING, declare
from scipy.linalg import expm

import sequential as sq
from sequential.errors import FactorlabError, ModelError, ShapeError
from sequential.model import evaluate

every_process = pytest.mark.parametrize("name", CONTINUOUS)
LENGTHS = (1e-6, 1e-3, 0.1, 0.7, 5.0, 60.0)


def matrices(process, manifold, dt, u=None):
    """F, Q and what the input does over dt, from the raw functions."""
    n, f = manifold.size, process.functions(manifold)
    u = np.zeros(max(f.inputs, 1)) if u is None else u
    transition = evaluate(f.jacobian, np.zeros(n), u, dt, f.params, n * n).reshape(n, n)
    noise = evaluate(f.noise, np.zeros(n), u, dt, f.params, n * n).reshape(n, n)
    return transition, noise, evaluate(f.value, np.zeros(n), u, dt, f.params, n)


@every_process
@pytest.mark.parametrize("dt", LENGTHS)
def test_two_half_steps_are_one_step(name, dt):
    """F = F½ F½, Q = F½ Q½ F½ᵀ + Q½, and the input twice."""
    process, manifold = CONTINUOUS[name]
    u = np.linspace(0.5, 1.0, process.functions(manifold).inputs)
    whole, half = matrices(process, manifold, dt, u), matrices(process, manifold, dt / 2, u)
    again = (half[0] @ half[0], half[0] @ half[1] @ half[0].T + half[1], half[0] @ half[2] + half[2])
    for one, other in zip(whole, again, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-13 * max(np.abs(other).max(), 1e-300))


@every_process
@pytest.mark.parametrize("dt", LENGTHS)
def test_it_is_the_matrix_exponential(name, dt):
    """Extended precision, van Loan's block matrix, and scipy as far as it is exact itself."""
    process, manifold = CONTINUOUS[name]
    a, density, b = process.dynamics(manifold)
    n, m = b.shape
    f, q, moved = matrices(process, manifold, dt, np.ones(max(m, 1)))
    expected = exponential(a * dt)
    rounding = 1e-14 + 1e-16 * np.abs(a).sum() * dt  # its condition number grows with ‖A dt‖
    np.testing.assert_allclose(f, expected, rtol=0, atol=rounding * np.abs(expected).max())
    np.testing.assert_allclose(f, expm(a * dt), rtol=0, atol=1e-11 * np.abs(expected).max())
    assert np.abs(sq.van_loan(a, np.eye(n), density, dt)[1] - q).max() <= 1e-14 * np.abs(q).max()
    np.testing.assert_array_equal(q, q.T)
    augmented = np.block([[a, b @ np.ones((m, 1))], [np.zeros((1, n + 1))]])
    arrived = exponential(augmented * dt)
    np.testing.assert_allclose(moved, arrived[:n, n], rtol=0, atol=2 * rounding * np.abs(arrived).max())


@pytest.mark.parametrize("seed", range(40))
def test_random_equations_are_exact_too(seed):
    """Sizes 1 to 7, from slow to stiff, stable and not."""
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(1, 8)), int(rng.integers(1, 3))
    a = rng.standard_normal((n, n)) * 10.0 ** rng.uniform(-2, 1) - seed % 3 * np.eye(n)
    g, b, dt = rng.standard_normal((n, 2)), rng.standard_normal((n, m)), 10.0 ** rng.uniform(-3, 0.3)
    process = sq.ContinuousProcess(a, g, [1.0, 2.0], b)
    u = rng.standard_normal(m)
    f, q, moved = matrices(process, sq.Vector(n), dt, u)
    exact = exponential(np.block([[a, b], [np.zeros((m, n + m))]]) * dt)
    scale = np.abs(exact).max()
    np.testing.assert_allclose(f, exact[:n, :n], rtol=0, atol=1e-14 * scale)
    np.testing.assert_allclose(moved, exact[:n, n:] @ u, rtol=0, atol=3e-14 * scale)
    # dQ/dt = A Q + Q Aᵀ + D, so the flow's difference to its start is A Q + Q Aᵀ + D integrated: Lyapunov
    residual = a @ q + q @ a.T + g @ np.diag([1.0, 2.0]) @ g.T - f @ g @ np.diag([1.0, 2.0]) @ g.T @ f.T
    size = np.abs(a).max() * np.abs(q).max() + np.abs(f @ g).max() ** 2
    np.testing.assert_allclose(residual, 0.0, atol=1e-12 * size)


def exponential(matrix):
    """exp of a matrix in extended precision: Taylor's series of a small share of it, squared up."""
    matrix = matrix.astype(np.longdouble)
    times = max(0, int(np.ceil(np.log2(float(np.abs(matrix).sum()) + 1e-30)))) + 3
    matrix = matrix / np.longdouble(2) ** times
    total = term = np.eye(len(matrix), dtype=np.longdouble)
    for k in range(1, 25):
        term = term @ matrix / k
        total = total + term
    for _ in range(times):
        total = total @ total
    return total.astype(np.float64)


@every_process
def test_compiled_and_plain_functions_agree(name, rng):
    """The covariance of a whole run through kernels is the recursion with the matrices above."""
    process, manifold = CONTINUOUS[name]
    model = declare(process, manifold, {})
    t = np.cumsum(np.concatenate([[0.0], rng.uniform(0.05, 4.0, 12)]))
    u = rng.standard_normal((13, model.process_functions.inputs))
    log = sq.SensorLog({"drive": sq.Stream(t, u)} if model.input else {"none": sq.Stream(t, t)})
    run = sq.run(sq.KalmanFilter(), model, log, at=t, max_gap=10.0)
    x, p = model.prior.mean, model.prior.cov
    for k in range(1, 13):
        f, q, moved = matrices(process, manifold, t[k] - t[k - 1], u[k - 1] if model.input else None)
        x, p = f @ x + moved, f @ p @ f.T + q
        np.testing.assert_allclose(run.mean[k], x, rtol=1e-8, atol=1e-8)  # stamps are whole nanoseconds
        np.testing.assert_allclose(run.cov[k], p, rtol=0, atol=1e-7 * np.abs(p).max())


@every_process
@pytest.mark.parametrize(
    "estimator", [sq.UnscentedKalmanFilter(), sq.IteratedSmoother()], ids=lambda e: e.name
)
def test_every_kernel_can_call_it(name, estimator, rng):
    """Long steps are doubled up in scratch memory of the function's own."""
    process, manifold = CONTINUOUS[name]
    model = declare(process, manifold)
    t = np.cumsum(np.concatenate([[0.0], rng.uniform(0.05, 4.0, 20)]))
    u = rng.standard_normal((21, model.process_functions.inputs)) if model.input else None
    log = sq.simulate(model, t, rng, inputs=u).log
    run, kalman = (sq.run(e, model, log, max_gap=10.0) for e in (estimator, sq.KalmanFilter()))
    scale = np.abs(kalman.cov).max(axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(run.mean[-1], kalman.mean[-1], atol=1e-8)
    np.testing.assert_allclose(run.cov[-1] / scale[-1], kalman.cov[-1] / scale[-1], atol=1e-8)


@every_process
@pytest.mark.slow
def test_simulation_spreads_as_the_noise_says(name, seeds):
    """Covariance of many draws of one step, entry by entry, within five of its own standard errors."""
    process, manifold = CONTINUOUS[name]
    n, dt = manifold.size, 0.8
    f, q, _ = matrices(process, manifold, dt)
    known = 1e-12 * np.eye(n)
    model = declare(process, manifold, prior_cov=known)
    steps, count = 2, 40 * len(seeds)
    t = np.arange(steps + 1) * dt
    inputs = np.zeros((steps + 1, model.process_functions.inputs)) if model.input else None
    rng = np.random.default_rng(5)
    ends = np.array([sq.simulate(model, t, rng, inputs=inputs).truth[-1] for _ in range(count)])
    expected = f @ q @ f.T + q
    sigmas = np.sqrt(np.diag(expected))
    error = (ends.T @ ends / count - expected) / np.where(sigmas > 0, np.outer(sigmas, sigmas), 1.0)
    assert np.abs(error).max() < 5.0 * np.sqrt(2.0 / count)


def test_a_gauss_markov_process_forgets_and_settles():
    process = sq.GaussMarkov([2.0, 50.0], [0.5, 0.1])
    f, q, _ = matrices(process, sq.Vector(2), 0.3)
    np.testing.assert_allclose(np.diag(f), np.exp([-0.15, -0.006]), rtol=1e-14)
    np.testing.assert_allclose(np.diag(q), -np.array([0.25, 0.01]) * np.expm1([-0.3, -0.012]), rtol=1e-14)
    _, settled, _ = matrices(process, sq.Vector(2), 1e5)
    np.testing.assert_allclose(settled, np.diag([0.25, 0.01]), rtol=1e-12)
    cov = [[1.0, 0.3], [0.3, 0.5]]
    _, settled, _ = matrices(sq.GaussMarkov([2.0, 5.0], cov=cov), sq.Vector(2), 1e3)
    np.testing.assert_allclose(settled, cov, rtol=1e-12)


def test_a_bias_beside_a_motion_is_found(rng):
    """A drifting offset of one of two position sensors, as part of a product state."""
    state = sq.Product(motion=sq.Vector(2), bias=sq.Vector(1))
    process = sq.Independent(bias=sq.GaussMarkov(40.0, 2.0), motion=sq.ConstantVelocity(0.05))
    sensors = {"true": sq.LinearSensor([[1, 0, 0]], 0.3), "offset": sq.LinearSensor([[1, 0, 1]], 0.1)}
    model = declare(process, state, sensors, np.diag([1.0, 1.0, 4.0]))
    drawn = sq.simulate(model, np.arange(400) * 0.5, rng)
    run = sq.run(sq.RauchTungStriebel(), model, drawn.log)
    error = run.part("bias")[:, 0] - drawn.truth[:, 2]
    assert np.sqrt(np.mean(error**2)) < 0.6
    assert np.mean(error**2 / run.cov[:, 2, 2]) < 2.0


MISFITS = {
    "A": (lambda: sq.ContinuousProcess(np.zeros((2, 3)), [1, 1], 1.0), ShapeError, "A .* is square"),
    "G": (lambda: sq.ContinuousProcess(np.eye(2), [1, 1, 1], 1.0), ShapeError, r"G .* shape \(2, k\)"),
    "S": (lambda: sq.ContinuousProcess(np.eye(2), [1, 1], -1.0), FactorlabError, "spectral_density is not"),
    "units": (
        lambda: sq.ContinuousProcess(1e200 * np.eye(2), [1, 1], 1.0).functions(sq.Vector(2)),
        ModelError, "too large for double precision; use other units",
    ),
    "manifold": (lambda: SWING.functions(sq.SO3()), ModelError, r"ContinuousProcess needs Vector\(2\)"),
    "time constant": (
        lambda: sq.GaussMarkov(0.0, 1.0).functions(sq.Vector(1)), ModelError, "time_constant is 0.0; it must",
    ),
    "no sigma": (lambda: sq.GaussMarkov(1.0).functions(sq.Vector(1)), ModelError, "either sigma=… or cov=…"),
    "part": (
        lambda: sq.Independent(a=sq.Unicycle(1, 1, 1)), ModelError, "part 'a' of Independent is a Unicycle",
    ),
    "parts": (
        lambda: sq.Independent(a=sq.RandomWalk(1)).functions(sq.Vector(1)), ModelError, "moves the parts a;",
    ),
}  # fmt: skip


@pytest.mark.filterwarnings("ignore:overflow", "ignore:invalid value")
@pytest.mark.parametrize("misfit", MISFITS)
def test_a_misfit_is_a_sentence(misfit):
    make, error, message = MISFITS[misfit]
    with pytest.raises(error, match=message):
        make()
