"""The search for the guilty noise: exact rescaling, and the right noise found by simulation."""

from dataclasses import replace

import numpy as np
import pytest

import sequential as sq
from sequential.evaluate import blame
from sequential.evaluate.rescale import accepted_only, log_likelihood, scalings

H = np.array([[1.0, 0.0]])


def quiet(x, dt):
    return np.array([[dt * dt * dt / 3.0, dt * dt / 2.0], [dt * dt / 2.0, dt]]) * 0.2


def coast(x, dt):
    return np.array([x[0] + dt * x[1], x[1]])


def simulate(rng, q=0.2, sigmas=(0.5, 2.0), count=400, dt=0.5):
    """Positions of a body under white acceleration, read by a fine sensor and a coarse one in turn."""
    x, t, rows = np.array([0.0, 1.0]), 0.0, ([], [])
    root = np.linalg.cholesky(q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]]))
    for k in range(count):
        x = np.array([[1.0, dt], [0.0, 1.0]]) @ x + root @ rng.standard_normal(2)
        t += dt
        rows[k % 2].append((t, x[0] + sigmas[k % 2] * rng.standard_normal()))
    streams = {
        n: sq.Stream(np.array(r)[:, 0], np.array(r)[:, 1])
        for n, r in zip(("fine", "coarse"), rows, strict=True)
    }
    return sq.SensorLog(streams)


def model_of(process=None, fine=0.5, coarse=2.0, **sensor):
    return sq.StateSpace(
        sq.Vector(2),
        sq.Gaussian([0.0, 1.0], [0.1, 0.1]),
        sq.ConstantVelocity(0.2) if process is None else process,
        {"fine": sq.LinearSensor(H, fine**2, **sensor), "coarse": sq.LinearSensor(H, coarse**2)},
        start=0.0,
    )


CASES = {
    "process too small": (model_of(sq.ConstantVelocity(0.2 / 15**2)), "process", 15.0),
    "process too large": (model_of(sq.ConstantVelocity(0.2 * 8**2)), "process", 1 / 8),
    "fine sensor too small": (model_of(fine=0.1), "fine", 5.0),
    "coarse sensor too small": (model_of(coarse=0.2), "coarse", 10.0),
    "coarse sensor too large": (model_of(coarse=20.0), "coarse", 0.1),
}


@pytest.mark.parametrize("case", CASES)
def test_the_guilty_noise_is_found_and_measured(case, rng):
    model, family, factor = CASES[case]
    found = blame(sq.prepare(model, simulate(rng)))
    assert found.clear
    assert found.guilty.family == family
    assert found.guilty.factor == pytest.approx(factor, rel=0.35)
    assert found.guilty.nis["fine"] == pytest.approx(1.0, abs=0.35)
    assert ("too small" if factor > 1 else "too large") in found.verdict


def test_noise_that_fits_is_not_blamed(rng):
    found = blame(sq.prepare(model_of(), simulate(rng)))
    assert found.guilty is None
    assert found.verdict.startswith("the noises are in balance")


def test_everything_too_small_is_called_that(rng):
    model = model_of(sq.ConstantVelocity(0.2 / 9), fine=0.5 / 3, coarse=2.0 / 3)
    found = blame(sq.prepare(model, simulate(rng)))
    assert found.guilty.name == "every noise"
    assert found.guilty.factor == pytest.approx(3.0, rel=0.1)


@pytest.mark.parametrize("estimator", [sq.ExtendedKalmanFilter(), sq.IteratedExtendedKalmanFilter()])
@pytest.mark.parametrize("factor", [0.1, 3.0, 40.0])
def test_a_process_is_scaled_exactly_by_scaling_everything_else(estimator, factor, rng):
    model = model_of()
    problem = sq.prepare(model, simulate(rng, count=60))
    scaled, unit = next(s for s in scalings(model) if s.family == "process").apply(model, factor)
    run = estimator.solve(replace(problem, model=scaled))
    direct = estimator.solve(replace(problem, model=model_of(sq.ConstantVelocity(0.2 * factor**2))))
    np.testing.assert_allclose(run.mean, direct.mean, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(run.cov * unit**2, direct.cov, rtol=1e-8)
    total = sum(log_likelihood(i, unit) for i in run.innovations.values())
    assert total == pytest.approx(direct.log_likelihood, rel=1e-9)


@pytest.mark.parametrize("loss", [sq.Loss("huber", 1.0), sq.Loss("cauchy", 1.0)])
def test_robust_weights_survive_the_scaling(loss, rng):
    model = model_of(loss=loss)
    problem = sq.prepare(model, simulate(rng, count=60))
    scaled, unit = next(s for s in scalings(model) if s.family == "process").apply(model, 5.0)
    run = sq.ExtendedKalmanFilter().solve(replace(problem, model=scaled))
    direct = replace(problem, model=model_of(sq.ConstantVelocity(0.2 * 25.0), loss=loss))
    direct = sq.ExtendedKalmanFilter().solve(direct)
    np.testing.assert_allclose(run.mean, direct.mean, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(run.cov * unit**2, direct.cov, rtol=1e-8)


def test_a_users_own_noise_function_is_scaled_too(rng):
    own = sq.Process(step=coast, noise_cov=quiet)
    log = simulate(rng, q=0.2 * 400)
    found = blame(sq.prepare(model_of(own), log))
    assert found.guilty.name == "process noise"
    assert found.guilty.factor == pytest.approx(20.0, rel=0.35)


def test_gated_readings_do_not_take_part(rng):
    log = simulate(rng)
    values = np.array(log["fine"].values)
    values[::10] += 100.0
    log = log.replaced(fine=sq.Stream(log["fine"].t, values))
    problem = sq.prepare(model_of(gate=0.9999), log)
    run = sq.ExtendedKalmanFilter().solve(problem)
    fewer = accepted_only(problem, run)
    again = sq.ExtendedKalmanFilter().solve(fewer)
    assert len(fewer.reading_t) == len(problem.reading_t) - run.report.rejected
    np.testing.assert_allclose(again.mean, run.mean, rtol=1e-12, atol=1e-12)
    assert again.log_likelihood == pytest.approx(run.log_likelihood, rel=1e-12)
    assert blame(problem).guilty is None


def test_the_parts_of_an_odometry_are_told_apart(rng):
    process = sq.Unicycle(along=0.02, across=0.005, heading=0.02)
    landmarks = [[20.0, 5.0], [-10.0, 15.0], [5.0, -20.0]]
    sensor = sq.RangeBearing(landmarks, [0.01, 1e-4])
    t = np.arange(0, 60, 0.1)
    u = np.column_stack([np.ones(len(t)), 0.3 * np.sin(0.2 * t)])
    x, seen = np.zeros(3), []
    for k in range(len(t) - 1):
        slip = np.array([0.02, 0.005, 0.02]) * np.sqrt(0.1) * rng.standard_normal(3)
        x = sq.SE2().retract(sq.SE2().retract(x, np.array([u[k, 0] * 0.1, 0.0, u[k, 1] * 0.1])), slip)
        delta = np.asarray(landmarks[k % 3]) - x[:2]
        reading = [np.hypot(*delta), np.arctan2(delta[1], delta[0]) - x[2]]
        seen.append(reading + np.array([0.1, 0.01]) * rng.standard_normal(2))
    stream = sq.Stream(t[1:], np.array(seen), np.arange(len(t) - 1) % 3)
    log = sq.SensorLog({"u": sq.Stream(t, u), "marks": stream})

    def model(heading):
        wrong = replace(process, heading=heading)
        return sq.StateSpace(
            sq.SE2(), sq.Gaussian(np.zeros(3), [1e-4] * 3), wrong, {"marks": sensor}, "u", start=0.0
        )

    assert blame(sq.prepare(model(0.02), log)).guilty is None
    found = blame(sq.prepare(model(0.001), log))
    assert found.guilty.name == "heading noise"
    assert found.guilty.factor == pytest.approx(20.0, rel=0.4)
