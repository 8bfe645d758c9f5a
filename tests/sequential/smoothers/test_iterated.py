"""The iterated smoother: when it stops, what it says when it cannot, and what robust losses do to it."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from worlds import EVERY_WORLD

import sequential as sq
from sequential.errors import NotConvergedError

DRIVE = next(world for world in EVERY_WORLD if "range and bearing" in world.name)
ROBUST = sq.Loss("cauchy", 1.0)


def test_stopping_early_is_an_error_or_a_message(rng):
    log = DRIVE.draw(rng).log
    with pytest.raises(
        NotConvergedError, match=r"still moving by .* σ after 1 iterations; raise max_iterations"
    ):
        sq.run(sq.IteratedSmoother(max_iterations=1, tolerance=1e-12), DRIVE.model, log)
    run = sq.run(sq.IteratedSmoother(max_iterations=1, tolerance=1e-12, check=False), DRIVE.model, log)
    assert not run.report.converged
    assert "still moving" in run.report.message


def test_a_linear_chain_needs_two_iterations(rng):
    world = next(world for world in EVERY_WORLD if world.linear)
    run = sq.run(sq.IteratedSmoother(), world.model, world.draw(rng).log)
    assert run.report.converged
    assert run.report.iterations <= 2


def test_a_wrong_start_heading_is_recovered(rng):
    """The prior says 1.2 rad off and admits it; iterating finds the track that a single pass misses."""
    drawn = DRIVE.draw(rng)
    mean = drawn.truth[0] + np.array([0.0, 0.0, 1.2])
    prior = sq.Gaussian(mean, sq.diagonal([0.5, 0.5, 1.5]))
    model = sq.StateSpace(
        sq.SE2(), prior, DRIVE.model.process, DRIVE.model.sensors, input="odometry", start=0.0
    )
    good = sq.run(sq.IteratedSmoother(), DRIVE.model, drawn.log)
    run = sq.run(sq.IteratedSmoother(max_iterations=60), model, drawn.log)
    off = run.manifold.local(good.mean, run.mean) / good.sigmas()
    assert np.abs(off[5:]).max() < 1.0


def test_a_robust_loss_is_minimised(rng):
    """Iterative reweighting ends where the sum of Cauchy's ρ(r) = k²/2 log(1 + r²/k²) is least."""
    t, noise = np.arange(8.0), 0.2
    z = rng.normal(0.0, 0.4, 8)
    z[4] = 6.0
    model = sq.StateSpace(
        sq.Vector(1),
        sq.Gaussian([0.0], 1.0),
        sq.RandomWalk(0.3),
        {"z": sq.LinearSensor([[1.0]], noise, loss=ROBUST)},
    )
    run = sq.run(
        sq.IteratedSmoother(tolerance=1e-10, max_iterations=500), model, sq.SensorLog({"z": sq.Stream(t, z)})
    )

    def cost(x):
        squared = (z - x) ** 2 / noise
        robust = np.sqrt(np.log1p(squared))
        return np.concatenate([[x[0]], np.diff(x) / np.sqrt(0.3), robust])

    best = least_squares(cost, run.mean[:, 0] + 0.01, xtol=1e-15, ftol=1e-15, gtol=1e-12).x
    np.testing.assert_allclose(run.mean[:, 0], best, atol=1e-6)
    assert abs(run.mean[4, 0]) < 1.0


def test_its_likelihood_is_that_of_the_filter(rng):
    log = DRIVE.draw(rng).log
    smoother, ekf = (sq.run(e, DRIVE.model, log) for e in (sq.IteratedSmoother(), sq.ExtendedKalmanFilter()))
    assert smoother.log_likelihood == pytest.approx(ekf.log_likelihood)
    assert smoother.innovations["landmark"].kind == "leave-one-out"
    assert ekf.innovations["landmark"].kind == "filter"
