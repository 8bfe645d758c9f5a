"""Events as they arrive: in order they give the run, late ones give the run on the sorted log."""

import math

import numpy as np
import pytest
import worlds

import sequential as sq
from sequential.errors import FactorlabError

FILTERS = [sq.ExtendedKalmanFilter(), sq.IteratedExtendedKalmanFilter(), sq.ExtendedKalmanFilter(form="ud")]
every_filter = pytest.mark.parametrize("estimator", FILTERS, ids=lambda e: e.name)
every_world = pytest.mark.parametrize("world", worlds.EVERY_WORLD, ids=repr)


def last_at_each_time(estimates):
    """The estimate after the last event of each moment."""
    return {estimate.t: estimate for estimate in estimates}


def assert_beliefs_are_those_of(run, found):
    """At every node but the prior's, where there need not be an event."""
    rows = [k for k, t in enumerate(run.t.tolist()) if k or t in found]
    beliefs = [found[t].belief for t in run.t[rows].tolist()]
    np.testing.assert_allclose([b.mean for b in beliefs], run.mean[rows], rtol=0, atol=1e-12)
    np.testing.assert_allclose([b.cov for b in beliefs], run.cov[rows], rtol=0, atol=1e-12)


@every_world
@every_filter
def test_events_in_order_give_the_run(world, estimator, rng):
    log = world.draw(rng).log
    run = sq.run(estimator, world.model, log)
    estimates = sq.stream(estimator, world.model, sq.arrivals(log))
    made = list(estimates)
    assert_beliefs_are_those_of(run, last_at_each_time(made))
    assert len(made) == sum(len(stream) for stream in log.streams.values())
    assert not any(estimate.late for estimate in made)
    for name, innovations in run.innovations.items():
        mine = [e.innovation for e in made if e.name == name]
        np.testing.assert_allclose([i.residual for i in mine], innovations.residual, rtol=0, atol=1e-12)
    assert all(e.innovation is None for e in made if e.name == world.model.input)
    assert estimates.summary.message == ""


@every_world
@pytest.mark.parametrize("seed", range(3))
def test_shuffled_events_end_where_the_sorted_log_ends(world, seed):
    rng = np.random.default_rng(seed)
    log = world.draw(rng).log
    last = max(int(stream.t[-1]) for stream in log.streams.values())
    run = sq.run(sq.ExtendedKalmanFilter(), world.model, log, at=np.array([last]))
    shuffled = sq.arrivals(log, dict.fromkeys(log, lambda rng, n: rng.uniform(0.0, 0.8, n)), rng)
    estimates = sq.stream(sq.ExtendedKalmanFilter(), world.model, shuffled, max_delay=0.8)
    made = list(estimates)
    assert any(estimate.late for estimate in made)
    assert estimates.summary.late == sum(estimate.late for estimate in made)
    assert estimates.summary.rejected == {}
    assert estimates.belief.t == run.t[-1]
    np.testing.assert_allclose(estimates.belief.mean, run.mean[-1], rtol=0, atol=1e-12)
    np.testing.assert_allclose(estimates.belief.cov, run.cov[-1], rtol=0, atol=1e-12)


def driven(covers, rng):
    """A log whose input holds after its stamps, or before them, with readings between the samples."""
    log = worlds.unicycle_range_bearing().draw(rng).log
    odometry = log["odometry"]
    landmark = log["landmark"]
    moved = sq.Stream(landmark.t - 37_000_000, landmark.values, landmark.context)
    return log.replaced(
        odometry=sq.Stream(odometry.t, odometry.values, covers=covers), landmark=moved.select(moved.t > 0)
    )


@pytest.mark.parametrize("covers", ["after", "before"])
@pytest.mark.parametrize("delays", [{}, {"landmark": 0.25}, {"odometry": 0.25}], ids=["none", "z", "u"])
@pytest.mark.parametrize("start", [0.0, None, 0.45])
def test_inputs_hold_for_the_intervals_that_the_log_says(covers, delays, start, rng):
    log, model = driven(covers, rng), worlds.unicycle_range_bearing().model
    model = sq.StateSpace(model.manifold, model.prior, model.process, model.sensors, model.input, start)
    run = sq.run(sq.ExtendedKalmanFilter(), model, log)
    estimates = sq.stream(
        sq.ExtendedKalmanFilter(), model, sq.arrivals(log, delays), max_delay=0.25 if delays else 0.0
    )
    before_last = [e for e in estimates if e.t <= run.t[-1]]
    assert len(before_last) > 100
    # replayed up to the last reading: a belief for the time after it is moved on from there
    beyond = log["odometry"].t[log["odometry"].t >= run.t[-1]]
    again = sq.run(sq.ExtendedKalmanFilter(), model, log, at=beyond)
    assert estimates.belief.t == again.t[-1]
    np.testing.assert_allclose(estimates.belief.mean, again.mean[-1], rtol=0, atol=1e-12)
    np.testing.assert_allclose(estimates.belief.cov, again.cov[-1], rtol=0, atol=1e-12)
    if not delays and covers == "after":
        assert_beliefs_are_those_of(run, last_at_each_time(before_last))


def cart(start=0.0, **settings):
    return sq.StateSpace(
        sq.Vector(2),
        sq.Gaussian([0.0, 1.0], [1.0, 1.0]),
        sq.ConstantVelocity(0.1),
        {"position": sq.LinearSensor([[1.0, 0.0]], 0.25, **settings)},
        start=start,
    )


def feed(events, model=None, **settings):
    estimates = sq.stream(sq.KalmanFilter(), model or cart(), events, **settings)
    return list(estimates), estimates


def test_what_comes_too_late_is_left_out_and_counted():
    events = [(0.1, "position", 0.1), (1.0, "position", 1.0), (0.4, "position", 9.0), (0.5, "position", 0.6)]
    made, estimates = feed(events, max_delay=0.5)
    assert [e.late for e in made] == [False, False, True, True]
    assert [e.used for e in made] == [True, True, False, True]
    assert made[2].belief is made[1].belief
    assert made[2].innovation is None
    summary = estimates.summary
    assert (summary.used, summary.late, summary.rejected, summary.replayed) == (3, 1, {"position": 1}, 1)
    assert summary.worst["position"] == pytest.approx(0.6)
    assert summary.message.startswith(
        "1 events of 'position' came more than max_delay=0.5 s late and were left out, the worst by 0.600 s"
    )
    without, _ = feed([events[0], events[3], events[1]])
    np.testing.assert_array_equal(made[3].belief.mean, without[-1].belief.mean)


def test_a_late_reading_is_held_against_what_was_known_at_its_time():
    made, _ = feed([(0.5, "position", 0.4), (1.0, "position", 1.3), (0.7, "position", 0.6)], max_delay=1.0)
    sorted_, _ = feed([(0.5, "position", 0.4), (0.7, "position", 0.6), (1.0, "position", 1.3)])
    assert made[2].t == 700_000_000
    assert made[2].belief.t == 1_000_000_000
    np.testing.assert_array_equal(made[2].innovation.residual, sorted_[1].innovation.residual)
    assert made[2].innovation.log_likelihood == sorted_[1].innovation.log_likelihood


def test_readings_before_the_start_are_counted():
    made, estimates = feed([(1.0, "position", 0.9), (2.0, "position", 2.0)], cart(start=1.5))
    assert [e.used for e in made] == [False, True]
    assert estimates.summary.early == {"position": 1}
    assert estimates.summary.message == "1 readings of 'position' lie before the start"


def test_without_a_start_the_first_event_in_time_is_the_start():
    events = [(1.0, "position", 0.9), (0.8, "position", 0.7), (1.4, "position", 1.6)]
    made, estimates = feed(events, cart(start=None), max_delay=0.5)
    log = sq.SensorLog({"position": sq.Stream([0.8, 1.0, 1.4], [0.7, 0.9, 1.6])})
    run = sq.run(sq.KalmanFilter(), cart(start=None), log)
    np.testing.assert_allclose(estimates.belief.mean, run.mean[-1], rtol=0, atol=1e-12)
    assert made[0].belief.t == 1_000_000_000


def test_missing_components_and_noises_of_their_own(rng):
    t = np.arange(1, 20) * 0.1
    values = rng.normal(size=(19, 2))
    values[3, 0], values[5], values[9, 1] = np.nan, np.nan, np.nan
    noise = rng.uniform(0.1, 1.0, (19, 2))
    sensors = {"both": sq.LinearSensor(np.eye(2), 0.5 * np.eye(2))}
    model = cart()
    model = sq.StateSpace(model.manifold, model.prior, model.process, sensors, start=0.0)
    for cov in (None, noise):
        log = sq.SensorLog({"both": sq.Stream(t, values, noise_cov=cov)})
        run = sq.run(sq.KalmanFilter(), model, log)
        made, estimates = feed(sq.arrivals(log), model)
        assert_beliefs_are_those_of(sq.run(sq.KalmanFilter(), model, log, at=t), last_at_each_time(made))
        assert estimates.summary.missing == run.report.missing == 1
        assert estimates.summary.message == "1 readings had no component and said nothing"


def test_the_buffer_holds_no_more_than_the_delay():
    replay = sq.Replay(sq.KalmanFilter(), cart(), max_delay=0.5)
    for k in range(1000):
        replay.push(0.01 * k, "position", 0.01 * k)
        assert len(replay._events) <= 52
    assert replay.belief.t == 9_990_000_000


def test_a_repeated_gate_is_judged_anew():
    """A reading that was surprising is not, once the late one before it has come."""
    events = [(1.0, "position", 1.0), (3.0, "position", 40.0), (2.0, "position", 20.0)]
    made, estimates = feed(events, cart(gate=0.9999), max_delay=5.0)
    assert not made[1].innovation.accepted
    run = sq.run(
        sq.KalmanFilter(),
        cart(gate=0.9999),
        sq.SensorLog({"position": sq.Stream([1.0, 2.0, 3.0], [1.0, 20.0, 40.0])}),
    )
    np.testing.assert_allclose(estimates.belief.mean, run.mean[-1], rtol=1e-12)


@pytest.mark.parametrize(
    ("events", "settings", "sentence"),
    [
        ([(0.1, "gps", 1.0)], {}, r"the model has no sensor 'gps'; it has 'position'"),
        ([(0.1, "position", [1.0, 2.0])], {}, r"a reading of 'position' is one number"),
        ([(math.nan, "position", 1.0)], {}, r"every stamp must be a finite number"),
        ([], {"max_delay": -1.0}, r"max_delay is zero or more seconds, got -1"),
    ],
    ids=["a name", "a shape", "a stamp", "a delay"],
)
def test_an_event_that_does_not_fit_is_a_sentence(events, settings, sentence):
    with pytest.raises(FactorlabError, match=sentence):
        feed(events, **settings)


def test_a_buffer_may_be_used_again():
    """Drivers write every reading to one place."""
    replay, buffer = sq.Replay(sq.KalmanFilter(), cart(), max_delay=1.0), np.zeros(1)
    for t, value in ((0.1, 0.2), (0.3, 0.5), (0.2, 0.3)):
        buffer[0] = value
        replay.push(t, "position", buffer)
    made, _ = feed([(0.1, "position", 0.2), (0.2, "position", 0.3), (0.3, "position", 0.5)])
    np.testing.assert_array_equal(replay.belief.mean, made[-1].belief.mean)


def test_an_event_that_fails_is_as_if_it_had_not_come():
    def observe(x):
        if eval("x[0] > 1e3"):  # noqa: S307 - so that it runs in Python
            raise OverflowError("out of range")
        return x[:1]

    sensors = {"far": sq.LinearSensor([[1.0, 0.0]], 0.25), "near": sq.Sensor(observe, 0.25)}
    model = cart()
    model = sq.StateSpace(model.manifold, model.prior, model.process, sensors, start=0.0, check=False)
    replay = sq.Replay(sq.ExtendedKalmanFilter(), model, max_delay=9.0)
    replay.push(1.0, "near", 1.0)
    belief = replay.push(5.0, "far", 1e6).belief
    with pytest.raises(OverflowError, match="out of range"):
        replay.push(6.0, "near", 1.0)
    with pytest.raises(FactorlabError, match="it must be finite"):
        replay.push(6.0, "far", math.inf)
    assert replay.belief.t == belief.t
    np.testing.assert_array_equal(replay.belief.mean, belief.mean)
    assert replay.summary.used == 2
    assert replay.push(6.0, "far", 1e6).used


def pushed(events, **settings):
    replay = sq.Replay(sq.ExtendedKalmanFilter(), worlds.unicycle_range_bearing().model, **settings)
    for event in events:
        replay.push(*event)
    return replay


@pytest.mark.parametrize(
    ("events", "settings", "sentence"),
    [
        ([(0.0, "odometry", [1.0, 0.0]), (0.1, "odometry", [1.0, 0.0]), (12.0, "landmark", [9.0, 0.0], 0)],
         {}, r"'odometry' drives the process but pauses for 11.900 s after 0.100 s .* limit 10.000 s"),
        ([(0.5, "landmark", [9.0, 0.0], 0), (1.6, "landmark", [9.0, 0.0], 0)],
         {}, r"no sample of it has come in the first 1.100 s"),
        ([(0.0, "odometry", [1.0, math.nan])], {}, r"'odometry' drives the process and is \[ 1. nan\]"),
        ([(0.0, "odometry", [1.0])], {}, r"driven by 2 numbers of 'odometry', got an array of shape \(1,\)"),
        ([], {"covers": "around"}, r"'after' its stamp or 'before' it, got 'around'"),
    ],
    ids=["a pause", "no input", "a hole", "a shape", "covers"],
)  # fmt: skip
def test_an_input_that_does_not_fit_is_a_sentence(events, settings, sentence):
    with pytest.raises(FactorlabError, match=sentence):
        pushed(events, **settings)


def test_readings_wait_for_the_first_input_and_a_pause_may_be_allowed():
    replay = pushed([(0.0, "landmark", [9.0, 0.0], 0), (0.2, "landmark", [9.0, 0.1], 0)])
    assert replay.belief.t == 0
    replay.push(0.2, "odometry", [1.0, 0.1])
    assert replay.belief.t == 200_000_000
    allowed = pushed([(0.0, "odometry", [1.0, 0.0]), (0.1, "odometry", [1.0, 0.0])], max_gap=math.inf)
    assert allowed.push(60.0, "landmark", [9.0, 0.0], 0).belief.t == 60_000_000_000
