"""Particles: the Kalman filter in the limit, resampling without bias, beliefs that no Gaussian describes."""

import math

import numpy as np
import pytest
from switching import coasting, draw, wandering
from worlds import EVERY_WORLD

import sequential as sq
from sequential.errors import DataError, ModelError, NotFiniteError, ShapeError
from sequential.filters import particle

SCHEMES = particle.SCHEMES
KF, EKF = sq.KalmanFilter(), sq.ExtendedKalmanFilter()
every_scheme = pytest.mark.parametrize("scheme", SCHEMES)


def particles(count, seed=0, **settings):
    return sq.ParticleFilter(count, np.random.default_rng(seed), **settings)


@every_scheme
def test_converges_to_the_kalman_filter(scheme, rng):
    """The error falls with the root of the number of particles."""
    model = coasting(0.3)
    log, _, _ = draw((model,), np.eye(1), 40, 0.5, rng)
    exact, apart = sq.run(KF, model, log), {}
    for count in (300, 4800):
        runs = [sq.run(particles(count, seed, resampling=scheme), model, log) for seed in range(12)]
        errors = [(run.mean - exact.mean) / exact.sigmas() for run in runs]
        apart[count] = math.sqrt(np.mean(np.square(errors)))
        spread = np.mean([run.sigmas() / exact.sigmas() for run in runs])
        surprises = np.mean([run.innovations["position"].nis().mean() for run in runs])
    assert 2.5 < apart[300] / apart[4800] < 6.5
    assert apart[4800] < 0.1
    assert abs(spread - 1.0) < 0.02
    assert surprises == pytest.approx(exact.innovations["position"].nis().mean(), rel=0.05)


@every_scheme
def test_the_likelihood_is_unbiased(scheme, rng):
    """The estimate of the likelihood itself, not of its logarithm, is right on average for any N."""
    model = wandering(0.5)
    log, _, _ = draw((model,), np.eye(1), 10, 1.0, rng)
    exact = sq.run(KF, model, log).log_likelihood
    runs = [sq.run(particles(200, seed, resampling=scheme), model, log) for seed in range(400)]
    ratio = np.exp([run.log_likelihood - exact for run in runs])
    assert abs(ratio.mean() - 1.0) < 4.0 * ratio.std() / math.sqrt(len(ratio))
    assert ratio.std() / math.sqrt(len(ratio)) < 0.05


@every_scheme
@pytest.mark.parametrize("shape", ["even", "one", "tail", "zeros", "two"])
def test_resampling_draws_each_particle_as_often_as_it_weighs(scheme, shape, rng):
    count, repeats = 40, 4000
    weights = {
        "even": np.ones(count),
        "one": np.eye(count)[7],
        "tail": 0.7 ** np.arange(count),
        "zeros": np.where(np.arange(count) % 3 == 0, rng.random(count), 0.0),
        "two": np.r_[100.0, 50.0, rng.random(count - 2)],
    }[shape]
    offspring = np.array(
        [np.bincount(sq.resample(weights, rng, scheme), minlength=count) for _ in range(repeats)]
    )
    expected = count * weights / weights.sum()
    np.testing.assert_array_equal(offspring.sum(axis=1), count)
    # the variance of a count is at most that of multinomial draws
    most = np.sqrt(expected * (1.0 - expected / count) / repeats)
    assert (np.abs(offspring.mean(axis=0) - expected) <= 5.0 * most + 5.0 / repeats).all()
    assert (offspring.var(axis=0) <= (expected * (1 - expected / count)) * 1.3 + 5.0 / repeats).all()
    if scheme == "systematic":
        assert (np.abs(offspring - expected) < 1.0 + 1e-9).all()
    if scheme == "stratified":
        assert (np.abs(offspring - expected) < 2.0 + 1e-9).all()
    if scheme == "residual":
        assert (offspring >= np.floor(expected - 1e-9)).all()


def beacons(which):
    """A slow walker in the plane, ranged from two beacons on the x axis and, later, from a third."""
    places = [[-5.0, 0.0], [5.0, 0.0], [0.0, 8.0]]
    return sq.StateSpace(
        sq.Vector(2), sq.Gaussian([0.0, 0.0], 36.0 * np.eye(2)), sq.RandomWalk(0.02),
        {"range": sq.Range(places, 0.2**2)}, start=0.0,
    )  # fmt: skip


def ranged(seed, late):
    """Distances from the first two beacons in turn, from all three after `late` readings."""
    count, model = 60, beacons(0)
    which = np.where(np.arange(count) < late, np.arange(count) % 2, np.arange(count) % 3).astype(float)
    for attempt in range(50):
        drawn = sq.simulate(
            model, np.arange(count) * 0.5, np.random.default_rng([seed, attempt]),
            contexts={"range": which[:, None]},
        )  # fmt: skip
        if np.abs(drawn.truth[:, 1]).min() > 2.0 and np.abs(drawn.truth).max() < 8.0:
            return model, drawn
    raise AssertionError("no walk stays near and off the axis")


@pytest.mark.parametrize("seed", range(4))
def test_two_places_at_once(seed):
    """Two beacons cannot tell y from -y: the EKF, begun between them, sees no slope and learns nothing."""
    model, drawn = ranged(seed, late=24)
    run = sq.run(particles(6000, seed, keep=True), model, drawn.log)
    states, weights = run.particles.states[15], run.particles.weights[15]
    assert 0.05 < weights[states[:, 1] > 0].sum() < 0.95
    assert np.abs(states[:, 1]) @ weights == pytest.approx(abs(drawn.truth[15, 1]), abs=0.8)
    assert run.sigmas()[15, 1] > 1.0  # the belief is as wide as it must be
    assert np.linalg.norm(run.mean - drawn.truth, axis=1)[-8:].max() < 1.0  # the third beacon settles it
    before = drawn.log["range"].select(np.arange(60) < 24)
    ekf = sq.run(EKF, model, drawn.log.replaced(range=before))
    assert np.abs(ekf.mean[:, 1]).max() < 1e-9
    assert ekf.sigmas()[:, 1].min() > 5.9


def planar(x):
    return np.array([x[0], x[1]])


def test_a_kidnapped_heading(seeds):
    """Position fixes of a vehicle whose heading is unknown by half a turn and more."""
    fails = {"pf": 0, "ekf": 0}
    count = 101
    for seed in list(seeds)[:10]:
        rng = np.random.default_rng([3, seed])
        true, prior = (
            sq.StateSpace(
                sq.SE2(), sq.Gaussian([0.0, 0.0, heading], sq.diagonal([0.3, 0.3, sigma])),
                sq.Unicycle(0.05, 0.05, 0.02), {"fix": sq.Sensor(planar, [0.09, 0.09])}, "odometry", 0.0,
            )
            for heading, sigma in ((3.1, 0.05), (0.0, 2.0))
        )  # fmt: skip
        drive = np.column_stack([np.full(count, 1.0), 0.2 * np.sin(0.1 * np.arange(count))])
        drawn = sq.simulate(true, np.arange(count) * 0.2, rng, inputs=drive, readings={"fix": 20})
        for name, estimator in (("pf", particles(3000, seed)), ("ekf", EKF)):
            run = sq.run(estimator, prior, drawn.log)
            off = run.manifold.local(run.mean[-1], drawn.truth[drawn.t == run.t[-1]][0])
            fails[name] += abs(off[2]) > 0.5
    assert fails["pf"] == 0
    assert fails["ekf"] >= 3


@pytest.mark.parametrize("world", [w for w in EVERY_WORLD if w.model.manifold.dim <= 6], ids=repr)
def test_every_world_of_few_dimensions(world, rng):
    """Close to the extended filter where that one is nearly exact."""
    log = world.draw(rng).log
    run, ekf = sq.run(particles(4000), world.model, log), sq.run(EKF, world.model, log)
    apart = run.manifold.local(ekf.mean, run.mean) / ekf.sigmas()
    assert np.median(np.abs(apart)) < 0.25
    assert 0.8 < np.median(run.sigmas() / ekf.sigmas()) < 1.2
    world.model.manifold.check(run.mean)
    assert run.log_likelihood == pytest.approx(ekf.log_likelihood, abs=0.15 * len(run) + 5.0)


def test_a_seed_says_it_all(rng):
    model = wandering(0.5)
    log, _, _ = draw((model,), np.eye(1), 20, 1.0, rng)
    runs = [sq.run(particles(100, seed), model, log) for seed in (5, 5, 6)]
    np.testing.assert_array_equal(runs[0].mean, runs[1].mean)
    assert (runs[0].mean != runs[2].mean).any()
    estimator = particles(100, 5)
    again = [sq.run(estimator, model, log).mean for _ in range(2)]
    np.testing.assert_array_equal(again[0], runs[0].mean)
    assert (again[0] != again[1]).any()


@pytest.mark.parametrize("drawn", [1, 7, 60, 10**6])
def test_memory_is_bounded(drawn, monkeypatch, rng):
    """Pieces of the log join without gap or overlap, within nodes too, and none asks for too much."""
    monkeypatch.setattr(particle, "DRAWN", drawn)
    step_ptr = np.concatenate([[0, 0], np.cumsum(rng.integers(0, 9, 50))])
    spans, at = list(particle._spans(step_ptr, 4, 3)), np.array([0, 0])
    for first, last in spans:
        np.testing.assert_array_equal(first, at)
        at = last
        assert step_ptr[last[0]] <= last[1]
        assert last[0] == 51 or last[1] <= step_ptr[last[0] + 1]
        assert (last[1] - first[1]) * 4 <= max(drawn, 4)
        assert (last[0] - first[0]) * 3 <= max(drawn, 3)
    np.testing.assert_array_equal(at, [51, step_ptr[-1]])
    model = EVERY_WORLD[2].model
    log = EVERY_WORLD[2].draw(rng).log
    run, ekf = sq.run(particles(500), model, log), sq.run(EKF, model, log)
    assert np.median(np.abs(run.manifold.local(ekf.mean, run.mean) / ekf.sigmas())) < 0.5


@pytest.mark.parametrize("loss", [None, sq.Loss("huber", 1.345), sq.Loss("cauchy", 1.0)])
@pytest.mark.parametrize("z", [0.3, 2.0, -3.0])
def test_a_loss_is_the_tail_that_it_stands_for(loss, z):
    """One reading: the estimate is that of the density, integrated on a grid."""
    sensor, prior = sq.LinearSensor([[1.0]], 0.25, loss=loss), sq.Gaussian([0.0], 1.0)
    model = sq.StateSpace(sq.Vector(1), prior, sq.RandomWalk(1.0), {"z": sensor})
    run = sq.run(particles(100_000), model, sq.SensorLog({"z": sq.Stream([0.0], [z])}))
    x = np.linspace(-8.0, 8.0, 4001)
    r = np.abs(z - x) / 0.5
    tail = 0.5 * r**2
    if loss is not None and loss.kind == "huber":
        tail = np.where(r <= loss.k, tail, loss.k * (r - 0.5 * loss.k))
    elif loss is not None:
        tail = 0.5 * loss.k**2 * np.log1p(r**2 / loss.k**2)
    density = np.exp(-0.5 * x**2 - tail)
    mean = (x * density).sum() / density.sum()
    assert run.mean[0, 0] == pytest.approx(mean, abs=0.02)
    assert run.cov[0, 0, 0] == pytest.approx(((x - mean) ** 2 * density).sum() / density.sum(), rel=0.05)
    evidence = density.sum() * (x[1] - x[0]) / math.sqrt(2 * math.pi)
    assert run.log_likelihood == pytest.approx(math.log(evidence / math.sqrt(2 * math.pi * 0.25)), abs=0.04)


def test_gates_and_missing_components(rng):
    model, gated = coasting(0.3), coasting(0.3, gate=0.9999)
    log, _, _ = draw((model,), np.eye(1), 40, 0.5, rng)
    t, z = log["position"].t, log["position"].values.copy()
    z[20] += 6.0
    run = sq.run(particles(3000), gated, log.replaced(position=sq.Stream(t, z)))
    np.testing.assert_array_equal(np.flatnonzero(~run.innovations["position"].accepted), [20])
    rest = log.replaced(position=log["position"].select(np.arange(40) != 20))
    without = sq.run(particles(3000), gated, rest, at=t)
    np.testing.assert_array_equal(run.mean, without.mean)
    z = log["position"].values.copy()
    z[5:15, 1] = np.nan
    partial = log.replaced(position=sq.Stream(t, z))
    run, exact = sq.run(particles(5000), model, partial), sq.run(KF, model, partial)
    assert np.abs((run.mean - exact.mean) / exact.sigmas()).mean() < 0.1
    assert np.isnan(run.innovations["position"].residual[7, 1])
    assert run.log_likelihood == pytest.approx(exact.log_likelihood, abs=3.0)
    assert run.report.details["effective_min"] == run.particles.effective.min()


def test_what_cannot_be_is_refused(rng):
    model = wandering(0.5)
    log, _, _ = draw((model,), np.eye(1), 5, 1.0, rng)
    for settings, match in (
        ({"rng": None}, "draws from the generator"),
        ({"particles": 0}, "one particle or more"),
        ({"threshold": 1.5}, "share of the particles"),
        ({"resampling": "wheel"}, "no resampling 'wheel'"),
    ):
        with pytest.raises(ModelError, match=match):
            sq.ParticleFilter(**{"rng": rng, **settings})
    with pytest.raises(ModelError, match="particles keep no Gaussian prediction"):
        sq.run(sq.RauchTungStriebel(particles(10)), model, log)
    with pytest.raises(ShapeError, match=r"shape \(N,\)"):
        sq.resample(np.ones((2, 2)), rng)
    with pytest.raises(DataError, match="not all zero"):
        sq.resample([0.0, 0.0], rng)


def broken(x):
    return np.array([math.nan * x[0]])


def test_nothing_finite_to_expect(rng):
    model = sq.StateSpace(
        sq.Vector(1), sq.Gaussian([0.0], 1.0), sq.RandomWalk(1.0), {"z": sq.Sensor(broken, 1.0)}, check=False
    )
    with pytest.raises(NotFiniteError, match="no particle expects anything finite of 'z'"):
        sq.run(particles(10), model, sq.SensorLog({"z": sq.Stream([0.0, 1.0], [0.0, 1.0])}))
