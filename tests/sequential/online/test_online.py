"""Sample by sample: the same numbers as the whole log, beliefs that are values, and mistakes as sentences."""

import copy
import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import worlds

import sequential as sq

FILTERS = [
    sq.ExtendedKalmanFilter(),
    sq.IteratedExtendedKalmanFilter(),
    sq.ExtendedKalmanFilter(form="ud"),
    sq.ExtendedKalmanFilter(form="sqrt"),
    sq.IteratedExtendedKalmanFilter(form="ud"),
    sq.ExtendedKalmanFilter(form="information"),
    sq.UnscentedKalmanFilter(),
    sq.UnscentedKalmanFilter(points="simplex"),
    sq.CubatureKalmanFilter(),
]
every_filter = pytest.mark.parametrize("estimator", FILTERS, ids=lambda e: e.name)
every_world = pytest.mark.parametrize("world", worlds.EVERY_WORLD, ids=repr)


def walk(online, problem, *, together=False):
    """Every node of a problem by hand: beliefs after its readings, and the innovations in order."""
    plan, names = problem.schedule, list(problem.model.sensors)
    sizes = [s.manifold.size for s in problem.model.sensors.values()]
    contexts = [f.inputs for f in problem.model.sensor_functions.values()]
    inputs = problem.model.process_functions.inputs
    belief, beliefs, innovations = online.start(problem.t[0]), [], []
    for node in range(len(problem.t)):
        steps = [
            (float(plan.step_dt[s]), plan.inputs[plan.step_input[s]] if inputs else None)
            for s in range(plan.step_ptr[node], plan.step_ptr[node + 1])
        ]
        readings = range(plan.reading_ptr[node], plan.reading_ptr[node + 1])
        last = steps.pop() if together and steps and readings else None
        for dt, u in steps:
            belief = online.predict(belief, dt, u)
        for r in readings:
            s = plan.sensor[r]
            z, context = plan.z[r, : sizes[s]], plan.context[r, : contexts[s]]
            if last is not None:
                belief, innovation = online.step(belief, last[0], names[s], z, last[1], context)
                last = None
            else:
                belief, innovation = online.update(belief, names[s], z, context)
            innovations.append(innovation)
        beliefs.append(belief)
    return beliefs, innovations


@every_world
@every_filter
@pytest.mark.parametrize("together", [False, True], ids=["predict and update", "step"])
def test_samples_give_what_the_log_gives_bit_for_bit(world, estimator, together, rng):
    problem = world.problem(rng)
    run = estimator.solve(problem)
    beliefs, innovations = walk(sq.Online(estimator, world.model), problem, together=together)
    np.testing.assert_array_equal([b.mean for b in beliefs], run.mean)
    np.testing.assert_array_equal([b.cov for b in beliefs], run.cov)
    assert [b.t for b in beliefs] == run.t.tolist()
    assert math.fsum(i.log_likelihood for i in innovations) == pytest.approx(run.log_likelihood, rel=1e-12)
    order = np.argsort(problem.schedule.sensor, kind="stable")
    seen = [innovations[k] for k in order]
    for name in world.model.sensors:
        logged = run.innovations[name]
        mine, seen = seen[: len(logged.t)], seen[len(logged.t) :]
        np.testing.assert_array_equal([i.residual for i in mine], logged.residual)
        np.testing.assert_array_equal([i.cov for i in mine], logged.cov)
        np.testing.assert_allclose([i.nis for i in mine], logged.nis(), rtol=1e-9)
        assert [i.accepted for i in mine] == logged.accepted.tolist()


@pytest.mark.parametrize("world", [w for w in worlds.EVERY_WORLD if w.linear], ids=repr)
def test_the_linear_filter_gives_what_the_log_gives(world, rng):
    problem = world.problem(rng)
    run = sq.KalmanFilter().solve(problem)
    beliefs, _ = walk(sq.Online(sq.KalmanFilter(), world.model), problem)
    np.testing.assert_allclose([b.mean for b in beliefs], run.mean, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose([b.cov for b in beliefs], run.cov, rtol=1e-12, atol=1e-12)


def cart(**settings):
    return sq.StateSpace(
        sq.Vector(2),
        sq.Gaussian([0.0, 1.0], [1.0, 1.0]),
        sq.ConstantVelocity(0.1),
        {
            "position": sq.LinearSensor([[1.0, 0.0]], 0.25, **settings),
            "both": sq.LinearSensor(np.eye(2), [[0.3, 0.1], [0.1, 0.2]]),
        },
    )


def test_beliefs_are_values():
    online = sq.Online(sq.KalmanFilter(), cart())
    start = online.start(3.0)
    mean, cov = start.mean.copy(), start.cov.copy()
    moved = online.predict(start, 0.5)
    updated, innovation = online.update(moved, "position", 0.4)
    residual = innovation.residual.copy()
    again, _ = online.update(moved, "position", 0.4)
    assert (start.t, moved.t, updated.t) == (3_000_000_000, 3_500_000_000, 3_500_000_000)
    np.testing.assert_array_equal(again.mean, updated.mean)
    np.testing.assert_array_equal(start.mean, mean)
    np.testing.assert_array_equal(start.cov, cov)
    np.testing.assert_array_equal(innovation.residual, residual)
    np.testing.assert_allclose(updated.sigmas**2, np.diag(updated.cov))
    assert "t=3.500000 s" in repr(updated)
    assert "accepted=True" in repr(innovation)
    for values in (start.mean, updated.cov, innovation.residual, innovation.cov):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 1.0
    with pytest.raises(AttributeError):
        start.t = 5


def test_a_belief_may_be_handed_from_filter_to_filter_and_be_ones_own():
    model = cart()
    one, other = (sq.Online(f, model) for f in (sq.KalmanFilter(), sq.ExtendedKalmanFilter()))
    begun = one.predict(one.start(), 0.3)
    same = other.update(begun, "position", 0.1)[0]
    np.testing.assert_array_equal(same.mean, one.update(begun, "position", 0.1)[0].mean)
    for form in ("ud", "sqrt", "information"):
        factored = sq.Online(sq.KalmanFilter(form=form), model)
        there, _ = factored.update(begun, "position", 0.1)
        back, _ = one.update(there, "position", 0.2)
        np.testing.assert_allclose(there.cov, same.cov, rtol=1e-12)
        np.testing.assert_allclose(back.mean, one.update(same, "position", 0.2)[0].mean, rtol=1e-12)
    own = other.belief(begun.gaussian(), begun.t)
    np.testing.assert_array_equal(other.update(own, "position", 0.1)[0].mean, same.mean)
    assert own.manifold is model.manifold


def test_a_missing_component_says_nothing():
    online = sq.Online(sq.KalmanFilter(), cart())
    begun = online.predict(online.start(), 0.3)
    partial, innovation = online.update(begun, "both", [0.4, math.nan])
    single, alone = online.update(begun, "position", 0.4, noise_cov=0.3)
    np.testing.assert_allclose(partial.mean, single.mean, rtol=1e-14)
    np.testing.assert_allclose(partial.cov, single.cov, rtol=1e-14)
    assert innovation.nis == pytest.approx(alone.nis, rel=1e-12)
    assert innovation.log_likelihood == pytest.approx(alone.log_likelihood, rel=1e-12)
    whole, nothing = online.step(begun, 0.2, "both", [math.nan, math.nan])
    np.testing.assert_array_equal(whole.mean, online.predict(begun, 0.2).mean)
    assert (nothing.accepted, nothing.log_likelihood) == (False, 0.0)
    assert math.isnan(nothing.nis)
    # the slot of other noises is written anew every time
    plain = sq.Online(sq.KalmanFilter(), cart()).update(begun, "both", [0.4, 1.0])[0]
    np.testing.assert_array_equal(online.update(begun, "both", [0.4, 1.0])[0].cov, plain.cov)


def test_a_reading_may_bring_its_own_noise():
    online = sq.Online(sq.KalmanFilter(), cart())
    begun = online.start()
    for noise in ([0.02, 0.7], [[0.02, 0.01], [0.01, 0.7]]):
        other = cart()
        sensors = {**other.sensors, "both": sq.LinearSensor(np.eye(2), noise)}
        other = sq.StateSpace(other.manifold, other.prior, other.process, sensors)
        expected, _ = sq.Online(sq.KalmanFilter(), other).update(begun, "both", [0.4, 0.9])
        given, _ = online.update(begun, "both", [0.4, 0.9], noise_cov=noise)
        np.testing.assert_array_equal(given.mean, expected.mean)
        np.testing.assert_array_equal(given.cov, expected.cov)


def test_a_gate_leaves_the_belief_as_it_was():
    online = sq.Online(sq.KalmanFilter(), cart(gate=0.999))
    begun = online.start()
    after, innovation = online.update(begun, "position", 50.0)
    np.testing.assert_array_equal(after.mean, begun.mean)
    np.testing.assert_array_equal(after.cov, begun.cov)
    assert (innovation.accepted, innovation.log_likelihood) == (False, 0.0)
    assert innovation.nis > 1000


def test_any_layout_of_numbers_is_understood():
    online = sq.Online(sq.KalmanFilter(), cart())
    begun, column = online.start(), np.array([[0.4, 7.0], [0.9, 8.0]])[:, 0]
    expected, _ = online.update(begun, "both", np.array([0.4, 0.9]))
    for z in (column, [0.4, 0.9], (0.4, 0.9), np.array([0.4, 0.9], dtype=object)):
        np.testing.assert_array_equal(online.update(begun, "both", z)[0].mean, expected.mean)
    scalar, _ = online.update(begun, "position", 2)
    np.testing.assert_array_equal(scalar.mean, online.update(begun, "position", np.array([2.0]))[0].mean)


def test_a_copy_has_memory_of_its_own():
    online = sq.Online(sq.KalmanFilter(), cart())
    expected, _ = online.update(online.start(), "position", 0.4)
    twin = copy.deepcopy(online)
    assert twin._address != online._address
    del online
    np.testing.assert_array_equal(twin.update(twin.start(), "position", 0.4)[0].mean, expected.mean)
    assert twin.filter == sq.KalmanFilter()


def test_threads_with_filters_of_their_own_do_not_meet(rng):
    world = worlds.unicycle_range_bearing()
    problems = [world.problem(np.random.default_rng(seed)) for seed in range(4)]
    expected = [sq.ExtendedKalmanFilter().solve(p).mean[-1] for p in problems]

    def work(problem):
        online = sq.Online(sq.ExtendedKalmanFilter(), world.model)
        return [walk(online, problem)[0][-1].mean for _ in range(5)]

    with ThreadPoolExecutor(4) as pool:
        for found, mean in zip(pool.map(work, problems), expected, strict=True):
            np.testing.assert_array_equal(found, np.tile(mean, (5, 1)))


def test_what_numba_refuses_runs_in_python_and_its_error_comes_through():
    unknown = {"scale": 1.0}

    def observe(x):
        return np.array([eval("x[0]") * unknown["scale"]])  # noqa: S307 - Numba has no eval

    process = sq.RandomWalk(0.1)
    model = sq.StateSpace(
        sq.Vector(1), sq.Gaussian([1.0], [1.0]), process, {"z": sq.Sensor(observe, 0.5)}, check=False
    )
    linear = sq.StateSpace(model.manifold, model.prior, process, {"z": sq.LinearSensor([[1.0]], 0.5)})
    online, peer = (sq.Online(sq.ExtendedKalmanFilter(), m) for m in (model, linear))
    found, _ = online.step(online.start(), 0.5, "z", 1.7)
    np.testing.assert_allclose(found.cov, peer.step(peer.start(), 0.5, "z", 1.7)[0].cov, rtol=1e-8)
    del unknown["scale"]
    with pytest.raises(KeyError, match="scale"):
        online.update(found, "z", 1.7)
    unknown["scale"] = 1.0
    assert online.update(found, "z", 1.7)[1].accepted
