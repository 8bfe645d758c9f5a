"""Expectation-maximisation: the likelihood never falls, and others who do it get the same numbers."""

import dataclasses

import numpy as np
import pykalman
import pytest
from worlds import LINEAR_WORLDS, constant_velocity, drive, random_walk, unicycle_range_bearing

import sequential as sq
from sequential.smoothers.pairs import smoothed_pairs
from sequential.tuning.moments import scale_of

STEPS = np.concatenate([[0.0], np.cumsum(np.random.default_rng(0).uniform(0.1, 0.6, 250))])


def begun_elsewhere(model):
    """The same model, its noise far from what made the data."""
    sensors = {
        name: dataclasses.replace(one, noise_cov=3.0 * np.diag(np.diag(one.noise_cov)))
        for name, one in model.sensors.items()
    }
    return dataclasses.replace(model, sensors=sensors, process=sq.tuning.scaled_process(model.process, 0.3))


def history(model, log, count=12, **options):
    """Log likelihood before each iteration."""
    return [
        sq.expectation_maximization(
            model, log, iterations=k, tolerance=-1.0, intervals=False, **options
        ).log_likelihood_after
        for k in range(count)
    ]


def with_gaps(log, rng):
    """Some components, and some whole readings, missing; intervals vary."""
    streams = {}
    for name, stream in log.items():
        values = np.array(stream.values)
        values[rng.random(values.shape) < 0.2] = np.nan
        streams[name] = sq.Stream(stream.t, values)
    return log.replaced(**streams)


@pytest.mark.parametrize("world", LINEAR_WORLDS, ids=repr)
@pytest.mark.parametrize("structure", [None, "full", "diagonal", "scale"])
@pytest.mark.parametrize("gaps", [False, True], ids=["whole", "gaps"])
def test_the_likelihood_never_falls(world, structure, gaps, rng):
    log = sq.simulate(world.model, STEPS, rng, readings=world.readings).log
    log = with_gaps(log, rng) if gaps else log
    levels = history(begun_elsewhere(world.model), log, sensors=structure, process=structure)
    assert np.diff(levels).min() > -1e-9 * abs(levels[-1])
    assert levels[-1] > levels[0] + 10.0


@pytest.mark.parametrize("prior", ["mean", "both"])
def test_nor_with_the_prior(prior, rng):
    world = constant_velocity()
    model = dataclasses.replace(
        begun_elsewhere(world.model), prior=sq.Gaussian([3.0, 4.0, 0.0, 0.0], world.model.prior.cov)
    )
    log = world.draw(rng).log
    levels = history(model, log, prior=prior)
    assert np.diff(levels).min() > -1e-9 * abs(levels[-1])
    assert levels[-1] > history(model, log)[-1]


def test_pykalman_takes_the_same_steps(rng):
    """Full Q and R, one-second steps, masked rows: the same matrices after 1, 2, 5 and 20 iterations."""
    F = np.array([[1.0, 0.1, 0.0], [0.0, 1.0, 0.2], [0.0, 0.0, 1.0]])
    H, R = np.array([[1.0, 0.0, 0.0], [0.5, 1.0, 0.0]]), np.array([[0.3, 0.1], [0.1, 0.4]])
    x, seen = np.zeros(3), []
    for _ in range(120):
        seen.append(H @ x + rng.multivariate_normal(np.zeros(2), R))
        x = F @ x + rng.normal(size=3) * [0.4, 0.2, 0.3]
    seen = np.array(seen)
    seen[30:35] = np.nan
    model = sq.StateSpace(
        sq.Vector(3),
        sq.Gaussian(np.zeros(3), np.eye(3)),
        sq.LinearProcess(F, 0.3 * np.eye(3)),
        {"z": sq.LinearSensor(H, np.eye(2))},
        start=0.0,
    )
    log = sq.SensorLog({"z": sq.Stream(np.arange(120.0), seen)})
    masked = np.ma.masked_invalid(seen)
    for count in (1, 2, 5, 20):
        theirs = pykalman.KalmanFilter(
            F, H, 0.3 * np.eye(3), np.eye(2),
            initial_state_mean=np.zeros(3), initial_state_covariance=np.eye(3),
            em_vars=["transition_covariance", "observation_covariance"],
        ).em(masked, n_iter=count)  # fmt: skip
        ours = sq.expectation_maximization(
            model, log, process="full", sensors="full", iterations=count, tolerance=-1.0, intervals=False
        )
        np.testing.assert_allclose(ours.matrices["process Q"], theirs.transition_covariance, atol=1e-8)
        np.testing.assert_allclose(ours.matrices["noise_cov of z"], theirs.observation_covariance, atol=1e-8)


def nile():
    """Flow of the Nile at Aswan, 10⁸ m³, 1871 to 1970 (Durbin and Koopman 2012, table 2.1's series)."""
    return np.array(
        [
            1120, 1160, 963, 1210, 1160, 1160, 813, 1230, 1370, 1140, 995, 935, 1110, 994, 1020, 960, 1180,
            799, 958, 1140, 1100, 1210, 1150, 1250, 1260, 1220, 1030, 1100, 774, 840, 874, 694, 940, 833,
            701, 916, 692, 1020, 1050, 969, 831, 726, 456, 824, 702, 1120, 1100, 832, 764, 821, 768, 845,
            864, 862, 698, 845, 744, 796, 1040, 759, 781, 865, 845, 944, 984, 897, 822, 1010, 771, 676, 649,
            846, 812, 742, 801, 1040, 860, 874, 848, 890, 744, 749, 838, 1050, 918, 986, 797, 923, 975, 815,
            1020, 906, 901, 1170, 912, 746, 919, 718, 714, 740,
        ],
        dtype=float,
    )  # fmt: skip


def level_of_the_nile(values):
    return sq.StateSpace(
        sq.Vector(1),
        sq.Gaussian([0.0], 1e12),
        sq.RandomWalk(values["level"] ** 2),
        {"flow": sq.LinearSensor([[1.0]], values["reading"] ** 2)},
        start=0.0,
    )


def test_the_nile_is_fitted_as_in_the_literature():
    """The diffuse maximum is (15 098.6, 1 469.1) with -632.54563; statsmodels stops at -632.5457."""
    log = sq.SensorLog({"flow": sq.Stream(np.arange(100.0), nile())})
    diffuse = 0.5 * np.log(2 * np.pi * 1e12)  # what the first reading adds to a likelihood with that prior
    start = level_of_the_nile({"level": 30.0, "reading": 100.0})
    em = sq.expectation_maximization(start, log, iterations=2000, tolerance=1e-10)
    knobs = [sq.Knob("level", 30.0, decades=3.0), sq.Knob("reading", 100.0, decades=3.0)]
    ml = sq.tune(level_of_the_nile, knobs, log)
    for found, close in ((em, 1e-4), (ml, 2e-2)):
        level, reading = (v**2 for v in found.values.values())
        assert [reading, level] == pytest.approx([15098.6, 1469.1], rel=close)
        assert found.log_likelihood_after + diffuse > -632.5457
        assert found.converged
    assert em.log_likelihood_after + diffuse == pytest.approx(-632.5456257, abs=1e-6)
    for ours, theirs in zip(em.values, ml.values, strict=True):
        assert em.decades[ours] == pytest.approx(ml.decades[theirs], rel=0.1)


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say(seeds):
    world = random_walk()
    true = {"pair x0 σ": 0.3**0.5, "pair x1 σ": 0.2**0.5, "sum σ": 0.4**0.5, "process x1 σ": 0.3**0.5}
    inside, total = 0, 0
    for seed in range(len(seeds)):
        log = sq.simulate(world.model, STEPS, np.random.default_rng([41, seed]), readings=world.readings).log
        found = sq.expectation_maximization(world.model, log, iterations=60)
        for name, value in true.items():
            low, high = found.interval(name)
            inside, total = inside + (low <= value <= high), total + 1
    assert 0.85 < inside / total <= 1.0


def test_masks_and_words_hold_what_they_say(rng):
    world = random_walk()
    log = sq.simulate(world.model, STEPS, rng, readings=world.readings).log
    mask = np.array([[1, 1, 0], [1, 1, 0], [0, 0, 0]])
    found = sq.expectation_maximization(
        world.model, log, process=mask, sensors={"pair": "diagonal", "sum": "held"}, iterations=5
    )
    density = found.matrices["process density"]
    assert density[2, 2] == world.model.process.density[2][2]
    assert density[0, 2] == density[1, 2] == 0.0
    assert density[0, 1] != 0.05
    pair = found.matrices["noise_cov of pair"]
    assert pair[0, 1] == 0.0
    assert found.values["sum σ"] == pytest.approx(0.4**0.5, abs=1e-15)
    declared = sq.expectation_maximization(world.model, log, iterations=5).matrices["process density"]
    assert declared[0, 2] == declared[1, 2] == 0.0, "zeros as declared stay zero"


def test_cross_covariances_are_those_of_the_joint_gaussian(rng):
    """Neighbours smoothed together, against conditioning all nodes at once."""
    from dense import linearise, prior_of

    problem = constant_velocity().problem(rng)
    pairs = smoothed_pairs(problem, sq.KalmanFilter())
    chain = linearise(problem, pairs.mean)
    _, cov = prior_of(chain)
    cross = cov @ chain.matrix.T
    posterior = cov - cross @ np.linalg.solve(chain.matrix @ cross + chain.cov, cross.T)
    d = pairs.cov.shape[1]
    for k in (1, 7, len(pairs.mean) - 1):
        block = posterior[k * d : (k + 1) * d, (k - 1) * d : k * d]
        np.testing.assert_allclose(pairs.cross[k], block, atol=1e-9)


def test_a_scale_of_a_singular_noise_counts_its_rank():
    noise = np.array([[[1.0, 1.0], [1.0, 1.0]], [[4.0, 0.0], [0.0, 0.0]]])
    assert scale_of(noise, 2.5 * noise) == pytest.approx(2.5)


def test_a_curved_world_is_fitted(rng):
    world = unicycle_range_bearing()
    drawn = sq.simulate(
        world.model, np.arange(801) * 0.1, rng,
        inputs=drive(801),
        readings={"landmark": np.arange(4, 801, 4)}, contexts={"landmark": (np.arange(200) % 4)[:, None]},
    )  # fmt: skip
    sensor = dataclasses.replace(world.model.sensors["landmark"], noise_cov=sq.diagonal([0.3, 0.01]))
    start = dataclasses.replace(world.model, sensors={"landmark": sensor})
    found = sq.expectation_maximization(start, drawn.log, iterations=40, tolerance=0.01)
    assert found.values["landmark range.x0 σ"] == pytest.approx(0.1, rel=0.25)
    assert found.values["landmark bearing.angle σ"] == pytest.approx(0.03, rel=0.25)
    assert found.log_likelihood_after > found.log_likelihood_before + 50
    assert found.after.consistent
    assert found.values["process σ"] == pytest.approx(1.0, rel=0.35)


def test_a_process_that_nobody_can_scale_is_held_and_told(rng):
    def spread(x, dt):
        return np.array([[0.09 * dt]])

    def stay(x, dt):
        return x + 0.0 * dt

    model = sq.StateSpace(
        sq.Vector(1), sq.Gaussian([0.0], 1.0), sq.Process(stay, noise_cov=spread, linear=True),
        {"z": sq.LinearSensor([[1.0]], 1.0)}, start=0.0, check=False,
    )  # fmt: skip
    log = sq.simulate(model, np.arange(100.0), rng).log
    found = sq.expectation_maximization(model, log, iterations=3)
    assert list(found.values) == ["z σ"]
    assert "held" in found.notes[0]


def test_independent_parts_have_a_factor_each(rng):
    """Intervals that vary, one part with an input-free drift: each density is found, and the rest stays."""
    state = sq.Product(motion=sq.Vector(2), bias=sq.Vector(1), still=sq.Vector(1))

    def build(motion, bias):
        parts = {
            "motion": sq.ConstantVelocity(motion),
            "bias": sq.GaussMarkov(50.0, bias),
            "still": sq.RandomWalk(0.0),
        }
        sensors = {
            "both": sq.LinearSensor([[1, 0, 1, 1]], 0.01),
            "one": sq.LinearSensor([[1, 0, 0, 0]], 0.04),
        }
        prior = sq.Gaussian([0.0, 0.0, 0.0, 0.3], [1.0, 1.0, 0.25, 1e-6])
        return sq.StateSpace(state, prior, sq.Independent(**parts), sensors, start=0.0)

    t = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 0.6, 1500))])
    log = sq.simulate(build(0.3, 0.5), t, rng).log
    levels = history(build(3.0, 0.1), log)
    assert np.diff(levels).min() > -1e-9 * abs(levels[-1])
    found = sq.expectation_maximization(build(3.0, 0.1), log, iterations=300)
    assert set(found.values) == {"process motion σ", "process bias σ", "both σ", "one σ"}
    assert found.values["process motion σ"] == pytest.approx(0.1**0.5, rel=0.25)
    assert found.values["process bias σ"] == pytest.approx(5.0, rel=0.4)
    assert found.values["both σ"] == pytest.approx(0.1, rel=0.2)
    parts = found.model.process.processes
    assert parts["bias"].sigma == pytest.approx(0.1 * found.values["process bias σ"])
    assert {knob.name for knob in sq.tuning.noise_knobs(build(3.0, 0.1))} == set(found.values)
