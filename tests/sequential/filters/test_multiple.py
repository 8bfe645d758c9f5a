"""Interacting models: one model, outside oracles, calibration, gates, angles."""

import math
import warnings

import numpy as np
import pytest
from laws import EVERY_MANIFOLD
from switching import coasting, draw, enumerate_modes, matrices, wandering
from worlds import EVERY_WORLD, unicycle_range_bearing

import sequential as sq
from sequential.filters.switching import transitions_of

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    from filterpy import kalman as filterpy

IMM, RTS, EKF = sq.InteractingMultipleModel, sq.RauchTungStriebel, sq.ExtendedKalmanFilter()
CALM, WILD = coasting(0.01), coasting(4.0)
STAY = np.array([[0.95, 0.05], [0.1, 0.9]])


@pytest.mark.parametrize("world", EVERY_WORLD, ids=repr)
@pytest.mark.parametrize("filter_", [EKF, sq.IteratedExtendedKalmanFilter()], ids=lambda e: e.name)
def test_one_model_is_the_plain_filter_and_smoother(world, filter_, rng):
    log = world.draw(rng).log
    imm = IMM((world.model,), transition=1.0, filter=filter_)
    for plain, mixed in ((filter_, imm), (RTS(filter_, leave_one_out=False), RTS(imm))):
        run, other = sq.run(plain, world.model, log), sq.run(mixed, world.model, log)
        np.testing.assert_allclose(other.mean, run.mean, rtol=0, atol=1e-12)
        np.testing.assert_allclose(other.cov, run.cov, rtol=0, atol=1e-12)
        assert other.log_likelihood == pytest.approx(run.log_likelihood, rel=1e-12)
        np.testing.assert_array_equal(other.modes.probability, 1.0)
    for name, seen in sq.run(filter_, world.model, log).innovations.items():
        np.testing.assert_allclose(other.innovations[name].residual, seen.residual, atol=1e-12)
        np.testing.assert_allclose(other.innovations[name].cov, seen.cov, atol=1e-12)


@pytest.mark.parametrize("world", EVERY_WORLD, ids=repr)
def test_models_that_do_not_differ_are_one(world, rng):
    log = world.draw(rng).log
    imm = IMM((world.model,) * 3, switching_rate=2.0, initial=[0.2, 0.5, 0.3])
    for plain, mixed in ((EKF, imm), (RTS(leave_one_out=False), RTS(imm))):
        run, other = sq.run(plain, world.model, log), sq.run(mixed, world.model, log)
        sigmas = run.sigmas()
        apart = run.manifold.local(run.mean, other.mean) / np.maximum(sigmas, 1e-12)
        np.testing.assert_allclose(apart, 0.0, atol=1e-7)
        scaled = (other.cov - run.cov) / (sigmas[:, :, None] * sigmas[:, None, :]).clip(1e-24)
        np.testing.assert_allclose(scaled, 0.0, atol=1e-7)
        assert other.log_likelihood == pytest.approx(run.log_likelihood, rel=1e-9)
        chain = transitions_of(run.t, 3, None, 2.0)
        expected = np.array([0.2, 0.5, 0.3])
        for k in range(len(run)):
            expected = expected @ chain[k]
            if mixed is imm:
                np.testing.assert_allclose(other.modes.probability[k], expected, atol=1e-9)


def test_filterpy_step_by_step(rng):
    dt, start = 0.5, np.array([0.7, 0.3])
    log, _, _ = draw((CALM, WILD), STAY, 150, dt, rng)
    theirs = []
    for model in (CALM, WILD):
        one = filterpy.KalmanFilter(4, 2)
        one.x, one.P = model.prior.mean.copy(), model.prior.cov.copy()
        one.F, one.Q, one.H, one.R = matrices(model, dt)
        theirs.append(one)
    theirs = filterpy.IMMEstimator(theirs, start, STAY)
    theirs.cbar = start.copy()  # FilterPy switches before its first reading; here no time has passed yet
    run = sq.run(IMM((CALM, WILD), transition=STAY, initial=start), WILD, log)
    for k, z in enumerate(log["position"].values):
        if k:
            theirs.predict()
        theirs.update(z)
        np.testing.assert_allclose(run.mean[k], theirs.x, rtol=0, atol=1e-9)
        np.testing.assert_allclose(run.cov[k], theirs.P, rtol=0, atol=1e-9)
        np.testing.assert_allclose(run.modes.probability[k], theirs.mu, rtol=0, atol=1e-9)
        for j, one in enumerate(theirs.filters):
            np.testing.assert_allclose(run.modes.mean[j, k], one.x, rtol=0, atol=1e-9)
            np.testing.assert_allclose(run.modes.cov[j, k], one.P, rtol=0, atol=1e-9)


def test_close_to_the_sum_over_all_sequences(seeds):
    """Nine nodes, 512 sequences of modes, each an exact linear Gaussian problem."""
    models, chain = (wandering(0.01), wandering(2.0)), np.array([[0.9, 0.1], [0.2, 0.8]])
    forward, backward, chances, totals = [], [], [], []
    for seed in list(seeds)[:10]:
        log, _, _ = draw(models, chain, 9, 1.0, np.random.default_rng([5, seed]))
        mean, cov, share, total = enumerate_modes(models, chain, log["z"].values, 1.0, np.array([0.5, 0.5]))
        imm = IMM(models, transition=chain)
        ahead, back = (sq.run(estimator, models[0], log) for estimator in (imm, RTS(imm)))
        sigma = np.sqrt(cov[:, 0, 0])
        forward.append(np.abs(ahead.modes.probability - share).mean())
        chances.append(np.abs(back.modes.probability - share).mean())
        backward.append(np.abs((back.mean - mean)[:, 0] / sigma).mean())
        totals.append(ahead.log_likelihood - total)
        np.testing.assert_allclose(back.cov[:, 0, 0], cov[:, 0, 0], rtol=0.5)
    assert np.mean(backward) < 0.08
    assert np.mean(chances) < 0.04
    assert np.mean(forward) > 0.06
    assert np.max(np.abs(totals)) < 0.5


@pytest.mark.slow
def test_probabilities_are_calibrated(seeds):
    """Of all the times at which a model is called 70 % likely, it is in force at about seven in ten."""
    imm = IMM((CALM, WILD), transition=STAY)
    for estimator in (imm, RTS(imm)):
        said, was = [], []
        for seed in seeds:
            log, _, modes = draw((CALM, WILD), STAY, 300, 0.5, np.random.default_rng([9, seed]))
            said.append(sq.run(estimator, CALM, log).modes.probability[:, 1])
            was.append(modes)
        said, was = np.array(said), np.array(was)
        assert abs((said - was).mean()) < 4.0 * (said - was).mean(axis=1).std() / math.sqrt(len(said)) + 0.02
        bins = np.digitize(said, [0.05, 0.2, 0.4, 0.6, 0.8, 0.95])
        for b in range(7):
            if (inside := bins == b).sum() > 200:
                assert abs(was[inside].mean() - said[inside].mean()) < 0.08
        # and they say something: a guess by the chain's long-run shares is worse
        assert ((said - was) ** 2).mean() < 0.75 * (was.mean() - was).var()


def test_better_than_either_model_on_a_manoeuvre(seeds):
    errors = {}
    estimators = {"calm": (EKF, CALM), "wild": (EKF, WILD), "imm": (IMM((CALM, WILD), transition=STAY), CALM)}
    estimators["smoothed"] = (RTS(estimators["imm"][0]), CALM)
    estimators["wild smoothed"] = (RTS(leave_one_out=False), WILD)
    for seed in seeds:
        log, truth, _ = draw((CALM, WILD), STAY, 200, 0.5, np.random.default_rng([13, seed]))
        for name, (estimator, model) in estimators.items():
            run = sq.run(estimator, model, log)
            errors.setdefault(name, []).append(((run.mean - truth)[:, :2] ** 2).sum(axis=1).mean())
    rms = {name: math.sqrt(np.mean(values)) for name, values in errors.items()}
    assert rms["imm"] < 0.93 * min(rms["calm"], rms["wild"])
    assert rms["smoothed"] < 0.93 * rms["wild smoothed"] < rms["imm"]


def test_a_gate_is_shut_by_all_models_or_none(rng):
    calm, wild = coasting(0.001, gate=0.999), coasting(100.0, gate=0.999)
    log, _, _ = draw((calm, wild), STAY, 60, 0.5, rng, initial=[1.0, 0.0])
    z = log["position"].values.copy()
    z[30] += 1e4
    spoilt = log.replaced(position=sq.Stream(log["position"].t, z))
    imm = IMM((calm, wild), switching_rate=0.2)
    run = sq.run(imm, calm, spoilt)
    assert not run.innovations["position"].accepted[30]
    assert run.report.rejected == (~run.innovations["position"].accepted).sum()
    rest = spoilt.replaced(position=log["position"].select(np.arange(60) != 30))
    without = sq.run(imm, calm, rest, at=log["position"].t)
    np.testing.assert_allclose(run.mean, without.mean, atol=1e-9)
    np.testing.assert_allclose(run.modes.probability, without.modes.probability, atol=1e-9)
    z[30] = log["position"].values[30] + 5.0  # beyond the calm model's gate, inside the other's
    step = sq.run(imm, calm, log.replaced(position=sq.Stream(log["position"].t, z)))
    assert step.innovations["position"].accepted[30]
    assert sq.run(EKF, calm, log.replaced(position=sq.Stream(log["position"].t, z))).report.rejected > 0


def test_missing_components_and_noises_of_their_own(rng):
    """Models may differ in their sensor's noise; a missing component stays missing in both."""
    sharp, blunt = coasting(0.1, variance=0.05), coasting(0.1, variance=5.0)
    log, _, _ = draw((sharp, blunt), STAY, 80, 0.5, rng)
    z = log["position"].values.copy()
    z[::3, 0] = np.nan
    z[5] = np.nan
    log = log.replaced(position=sq.Stream(log["position"].t, z))
    run = sq.run(IMM((sharp, blunt), transition=STAY), sharp, log)
    assert run.report.missing == 1
    assert np.isnan(run.innovations["position"].residual[0, 0])
    for start, model in (([1.0, 0.0], sharp), ([0.0, 1.0], blunt)):
        alone = sq.run(IMM((sharp, blunt), transition=np.eye(2), initial=start), sharp, log)
        np.testing.assert_allclose(alone.mean, sq.run(EKF, model, log).mean, atol=1e-12)
        assert alone.log_likelihood == pytest.approx(sq.run(EKF, model, log).log_likelihood)


def test_sensors_in_another_order_are_the_same_sensors(rng):
    world = EVERY_WORLD[1]
    model, log = world.model, world.draw(rng).log
    names = list(model.sensors)[::-1]
    turned = sq.StateSpace(
        model.manifold, model.prior, model.process, {name: model.sensors[name] for name in names}, start=0.0
    )
    run = sq.run(IMM((model, turned), transition=0.9), model, log)
    np.testing.assert_allclose(run.mean, sq.run(EKF, model, log).mean, atol=1e-12)
    np.testing.assert_allclose(run.modes.probability, 0.5, atol=1e-12)


def slippery(turn):
    """A drive on a good and on a slippery floor, in a world turned by an angle."""
    world = unicycle_range_bearing()
    c, s = math.cos(turn), math.sin(turn)
    marks = np.asarray(world.model.sensors["landmark"].landmarks) @ np.array([[c, s], [-s, c]])
    x, y, heading = world.model.prior.mean
    mean = [c * x - s * y, s * x + c * y, math.remainder(heading + turn, 2 * math.pi)]
    sensors = {"landmark": sq.RangeBearing(marks, sq.diagonal([0.1, 0.03]))}
    prior = sq.Gaussian(mean, world.model.prior.cov)
    good, bad = (
        sq.StateSpace(sq.SE2(), prior, sq.Unicycle(a, a, a), sensors, "odometry", 0.0) for a in (0.02, 0.5)
    )
    return good, bad


@pytest.mark.parametrize("turn", [2.5, math.pi, math.radians(359.0)])
def test_turning_the_world_changes_nothing(turn):
    """Beliefs on both sides of ±π are mixed as neighbours."""
    world = unicycle_range_bearing()
    log = world.draw(np.random.default_rng(3)).log
    runs = []
    for angle in (0.0, turn):
        good, bad = slippery(angle)
        imm = IMM((good, bad), switching_rate=0.3)
        runs.append((sq.run(imm, good, log), sq.run(RTS(imm), good, log)))
    for straight, turned in zip(*runs, strict=True):
        heading = np.angle(np.exp(1j * (straight.mean[:, 2] + turn - turned.mean[:, 2])))
        np.testing.assert_allclose(heading, 0.0, atol=1e-6)
        np.testing.assert_allclose(straight.cov, turned.cov, rtol=0, atol=1e-7)
        np.testing.assert_allclose(straight.modes.probability, turned.modes.probability, atol=1e-6)


@pytest.mark.parametrize("manifold", EVERY_MANIFOLD, ids=repr)
def test_mixtures_on_every_manifold(manifold, rng):
    """The mean is where the weighted tangents balance; covariances are those of many draws."""
    from sequential.kernels.mixing import mix

    d, count = manifold.dim, 3
    centre = manifold.random(rng)
    means = manifold.retract(centre, 0.05 * rng.standard_normal((count, d)))
    factors = 0.02 * rng.standard_normal((count, d, d))
    covs, weights = factors @ np.swapaxes(factors, 1, 2), np.array([0.2, 0.5, 0.3])
    mean, cov = np.empty(manifold.size), np.empty((d, d))
    scratch = (np.empty(d), np.empty(d), *(np.empty((d, d)) for _ in range(4)))
    mix(manifold.table(), weights, means, covs, mean, cov, *scratch)
    apart = manifold.local(mean, means)
    np.testing.assert_allclose(weights @ apart, 0.0, atol=1e-12)
    draws = rng.choice(count, p=weights, size=200_000 // d)
    steps = np.einsum("nij,nj->ni", factors[draws], rng.standard_normal((len(draws), d)))
    seen = manifold.local(mean, manifold.retract(means[draws], steps))
    sigmas = np.sqrt(np.diagonal(cov))
    scaled = (np.cov(seen.T).reshape(d, d) - cov) / np.outer(sigmas, sigmas)
    assert np.abs(scaled).max() < 6.0 / math.sqrt(len(draws)) + 0.02


def test_names_and_reports(rng):
    log, _, _ = draw((CALM, WILD), STAY, 20, 0.5, rng)
    imm = IMM((CALM, WILD), transition=0.9, filter=sq.KalmanFilter())
    run = sq.run(imm, CALM, log)
    assert run.report.estimator == "imm_kf"
    assert sq.run(RTS(imm), CALM, log).report.estimator == "imm_kf_rts"
    assert run.modes.likeliest().shape == (20,)
    np.testing.assert_allclose(run.modes.probability.sum(axis=1), 1.0, atol=1e-12)
    with pytest.raises(ValueError, match="read-only"):
        run.modes.probability[0] = 0.0
