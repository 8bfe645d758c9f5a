"""On linear models every estimator is the same, and the smoothers are batch least squares."""

import dense
import numpy as np
import pytest
from worlds import LINEAR_WORLDS

import sequential as sq
from sequential.errors import DataError

linear = pytest.mark.parametrize("world", LINEAR_WORLDS, ids=repr)


def assert_same_beliefs(run, mean, cov, tolerance=1e-9):
    np.testing.assert_allclose(run.mean, mean, rtol=0, atol=tolerance * max(1.0, np.abs(mean).max()))
    np.testing.assert_allclose(run.cov, cov, rtol=0, atol=tolerance * max(1.0, np.abs(cov).max()))


@linear
@pytest.mark.parametrize(
    "estimator",
    [
        sq.ExtendedKalmanFilter(),
        sq.IteratedExtendedKalmanFilter(),
        sq.UnscentedKalmanFilter(),
        sq.UnscentedKalmanFilter(alpha=0.3, kappa=1.0),
        sq.UnscentedKalmanFilter(kappa=-1.0),
        sq.UnscentedKalmanFilter(points="julier", kappa=1.0),
        sq.UnscentedKalmanFilter(points="simplex"),
        sq.CubatureKalmanFilter(),
    ],
    ids=lambda e: e.name,
)
def test_every_filter_is_the_kalman_filter(world, estimator, rng):
    problem = world.problem(rng)
    kalman, other = sq.KalmanFilter().solve(problem), estimator.solve(problem)
    assert_same_beliefs(other, kalman.mean, kalman.cov)
    assert other.log_likelihood == pytest.approx(kalman.log_likelihood, rel=1e-9)
    for name, seen in kalman.innovations.items():
        np.testing.assert_allclose(other.innovations[name].residual, seen.residual, atol=1e-9)
        np.testing.assert_allclose(other.innovations[name].cov, seen.cov, atol=1e-9)


@linear
@pytest.mark.parametrize(
    "smoother",
    [
        sq.RauchTungStriebel(),
        sq.RauchTungStriebel(sq.KalmanFilter()),
        sq.RauchTungStriebel(sq.UnscentedKalmanFilter()),
        sq.RauchTungStriebel(sq.UnscentedKalmanFilter(points="julier", kappa=1.0)),
        sq.RauchTungStriebel(sq.UnscentedKalmanFilter(points="simplex")),
        sq.RauchTungStriebel(sq.CubatureKalmanFilter()),
        sq.IteratedSmoother(),
    ],
    ids=lambda e: e.name,
)
def test_every_smoother_is_batch_least_squares(world, smoother, rng):
    problem = world.problem(rng)
    run = smoother.solve(problem)
    about = np.zeros_like(run.mean)
    delta, cov = dense.least_squares(dense.linearise(problem, about))
    assert_same_beliefs(run, about + delta, cov)


@linear
def test_the_two_dense_routes_agree(world, rng):
    problem = world.problem(rng)
    chain = dense.linearise(problem, np.zeros((len(problem.t), problem.model.manifold.dim)))
    for one, other in zip(dense.least_squares(chain), dense.condition(chain), strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-9)


@linear
def test_the_likelihood_is_that_of_the_joint_gaussian(world, rng):
    from scipy.stats import multivariate_normal

    problem = world.problem(rng)
    nodes, d = len(problem.t), problem.model.manifold.dim
    chain = dense.linearise(problem, np.zeros((nodes, d)))
    mean, cov = dense.prior_of(chain)
    seen = multivariate_normal(chain.matrix @ mean, chain.matrix @ cov @ chain.matrix.T + chain.cov)
    expected = seen.logpdf(chain.seen)
    assert sq.KalmanFilter().solve(problem).log_likelihood == pytest.approx(expected, rel=1e-9)


@linear
@pytest.mark.parametrize("smoother", [sq.RauchTungStriebel(), sq.IteratedSmoother()], ids=lambda e: e.name)
def test_leave_one_out_is_leaving_one_out(world, smoother, rng):
    drawn = world.draw(rng)
    run = sq.run(smoother, world.model, drawn.log)
    for name, stream in drawn.log.items():
        sensor = world.model.sensors[name]
        for k in (0, len(stream) // 2, len(stream) - 1):
            others = drawn.log.replaced(**{name: stream.select(np.arange(len(stream)) != k)})
            without = sq.run(smoother, world.model, others, at=stream.t[[k]])
            at = without.index(stream.t[[k]])[0]
            h = np.asarray(sensor.matrix)
            left = run.innovations[name]
            np.testing.assert_allclose(left.residual[k], stream.values[k] - h @ without.mean[at], atol=1e-9)
            np.testing.assert_allclose(left.cov[k], h @ without.cov[at] @ h.T + sensor.noise_cov, atol=1e-9)
            assert left.kind == "leave-one-out"


@linear
def test_the_order_of_simultaneous_readings_does_not_matter(world, rng):
    drawn = world.draw(rng)
    turned = sq.StateSpace(
        world.model.manifold, world.model.prior, world.model.process,
        dict(reversed(world.model.sensors.items())), start=world.model.start,
    )  # fmt: skip
    run, other = (sq.run(sq.KalmanFilter(), m, drawn.log) for m in (world.model, turned))
    assert_same_beliefs(other, run.mean, run.cov)


@linear
def test_more_nodes_change_nothing(world, rng):
    drawn = world.draw(rng)
    between = (drawn.t[:-1] + drawn.t[1:]) // 2
    for estimator in (sq.KalmanFilter(), sq.RauchTungStriebel(), sq.IteratedSmoother()):
        run = sq.run(estimator, world.model, drawn.log)
        finer = sq.run(estimator, world.model, drawn.log, at=between)
        rows = finer.index(run.t)
        assert_same_beliefs(run, finer.mean[rows], finer.cov[rows])
        with pytest.raises(DataError, match="no estimate at"):
            run.index(between)
