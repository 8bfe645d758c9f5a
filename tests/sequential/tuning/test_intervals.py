"""What is said about how well a knob is known, and what outliers may do to it."""

import numpy as np
import pytest

import sequential as sq
from sequential.model import Loss
from sequential.tuning.profile import profile_limits
from sequential.tuning.robust import bounded_nis, robust_distance
from sequential.tuning.search import curvature

WALK, SENSOR = 0.3, 0.5


def walk(values, **options):
    sensor = sq.LinearSensor([[1.0]], values["sensor"] ** 2, **options)
    return sq.StateSpace(
        sq.Vector(1), sq.Gaussian([0.0], 1.0), sq.RandomWalk(values["walk"] ** 2), {"z": sensor}, start=0.0
    )


def knobs(walk=WALK):
    return [sq.Knob("walk", walk, "m/√s", 2.0), sq.Knob("sensor", SENSOR, "m", 2.0)]


def walked(rng, count=400, values=None):
    return sq.simulate(walk(values or {"walk": WALK, "sensor": SENSOR}), np.arange(count) * 1.0, rng).log


@pytest.mark.slow
@pytest.mark.parametrize("profile", [False, True], ids=["laplace", "profile"])
def test_intervals_hold_the_truth_as_often_as_they_say(profile, seeds):
    inside, total = 0, 0
    for seed in range(len(seeds)):
        found = sq.tune(walk, knobs(), walked(np.random.default_rng([29, seed]), 200), profile=profile)
        for name, true in (("walk", WALK), ("sensor", SENSOR)):
            low, high = found.interval(name)
            inside, total = inside + (low <= true <= high), total + 1
    assert 0.84 < inside / total <= 1.0


def test_profile_of_a_quadratic_is_its_gaussian():
    hessian = -np.array([[9.0, 2.0, 0.5], [2.0, 6.0, -1.0], [0.5, -1.0, 5.0]])

    def posterior(u):  # a likelihood with this curvature less the identity, times a standard normal prior
        return 0.5 * (u - 0.1) @ hessian @ (u - 0.1)

    at = np.full(3, 0.1)
    shape = curvature(posterior, at)
    for index in range(3):
        # the prior of the variable itself is taken out: one less in its profiled precision
        precision = 1.0 / np.linalg.inv(-hessian)[index, index] - 1.0
        low, high = profile_limits(posterior, at, shape, index)
        centre = 0.1 + 0.1 / precision  # and with it the pull to zero
        drop = 2 * 1.920729 + (0.1**2 / precision)
        wide = (drop / precision) ** 0.5
        np.testing.assert_allclose([low, high], [centre - wide, centre + wide], atol=0.03)


def test_a_level_of_zero_is_open_below(rng):
    """No process noise made these data: any small enough value does, and a profile says so."""
    log = walked(rng, 300, {"walk": 1e-6, "sensor": SENSOR})
    found = sq.tune(walk, knobs(0.05), log, profile=True)
    low, high = found.interval("walk")
    assert low == 0.0
    assert high < 0.2
    assert found.unidentified == ("walk",)
    assert "walk is not identified: anything below" in found.verdict
    low, high = found.interval("sensor")
    assert low < SENSOR < high


def test_a_knob_without_effect_is_not_identified(rng):
    found = sq.tune(walk, [*knobs(), sq.Knob("idle", 7.0)], walked(rng))
    assert found.unidentified == ("idle",)
    assert found.converged
    assert (
        "idle is not identified by these readings: its value rests on what was assumed beforehand, 7"
        in found.verdict
    )


def test_before_and_after_are_judged(rng):
    found = sq.tune(walk, knobs(WALK / 20.0), walked(rng))
    assert found.before.nis["z"].verdict == "overconfident"
    assert not found.before.whitened
    assert found.after.consistent
    assert found.after.whitened
    assert found.verdict.startswith("before: mean NIS of z ")
    plain = found.to_json()
    assert plain["after"]["sensors"]["z"]["inside"]
    assert plain["knobs"]["walk"]["interval95"] == list(found.interval("walk"))
    assert plain["knobs"]["walk"]["factor"] == pytest.approx(found.factor("walk"))
    assert "walk: 0.015 -> " in str(found)


def test_intervals_cost_no_more_than_the_search_ends_with(rng):
    """The curvature is the last Newton step's own; two passes judge before and after."""
    log = walked(rng)
    assert sq.tune(walk, knobs(WALK / 2.0), log).evaluations < 110


# --- losses and gates ---


@pytest.mark.parametrize("loss", [Loss("huber", 1.345), Loss("cauchy", 2.385)], ids=lambda one: one.kind)
@pytest.mark.parametrize("dim", [1, 3])
def test_a_bounded_distance_is_consistent_at_the_normal(loss, dim, rng):
    """E[ρ(NIS/s²)] + m log s² is smallest at s = 1, and the bounded NIS has the mean of a plain one."""
    nis = rng.chisquare(dim, 200_000)
    levels = np.linspace(0.8, 1.25, 10)
    cost = [robust_distance(loss, nis / s**2, dim).mean() + 2 * dim * np.log(s) for s in levels]
    best = np.polyfit(np.log(levels), cost, 4)
    roots = np.roots(np.polyder(best))
    near = roots[np.argmin(np.abs(roots))]
    assert abs(near.imag) < 1e-9
    assert np.exp(near.real) == pytest.approx(1.0, abs=0.01)
    t = np.arange(len(nis))
    residual = np.zeros((len(nis), dim))
    residual[:, 0] = np.sqrt(nis)
    seen = sq.Innovations(t, t, residual, np.broadcast_to(np.eye(dim), (len(nis), dim, dim)), t >= 0)
    for guard in ({"loss": loss}, {"gate": 0.95}, {}):
        sensor = sq.LinearSensor(np.eye(dim), np.eye(dim), **guard)
        assert bounded_nis(seen, sensor).mean() == pytest.approx(dim, rel=0.01)


@pytest.mark.parametrize("loss", [Loss("huber", 1.345), Loss("cauchy", 2.385)], ids=lambda one: one.kind)
def test_outliers_do_not_raise_the_noise_of_a_sensor_with_a_loss(loss, rng):
    log = walked(rng, 600)
    values = np.array(log["z"].values)
    spoiled = rng.random(600) < 0.05
    values[spoiled] += 20.0 * SENSOR * rng.standard_normal((spoiled.sum(), 1))
    dirty = log.replaced(z=sq.Stream(log["z"].t, values))

    def build(v):
        return walk(v, loss=loss)

    def level(model, data):
        return sq.tune(model, knobs(), data).values["sensor"]

    assert level(walk, dirty) > 2.0 * SENSOR
    assert level(build, dirty) == pytest.approx(SENSOR, rel=0.35)
    assert level(build, log) == pytest.approx(SENSOR, rel=0.15)
