"""Whatever comes in whatever order: the end is that of the whole log of what was used."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import sequential as sq


def drift(x, u, dt):
    return np.array([0.9**dt * x[0] + dt * u[0]])


def model(start):
    sensors = {name: sq.LinearSensor([[1.0]], noise) for name, noise in (("near", 0.25), ("far", 0.5))}
    process = sq.Process(step=drift, noise_density=1.0, inputs=1)
    prior = sq.Gaussian([0.0], [1.0])
    return sq.StateSpace(sq.Vector(1), prior, process, sensors, input="speed", start=start, check=False)


MODELS = {start: model(start) for start in (None, 0, 40_000_000_000)}
FILTER = sq.ExtendedKalmanFilter()
stamps = st.lists(st.integers(0, 99), min_size=1, max_size=12, unique=True)


@st.composite
def arriving(draw):
    """Events of three streams in any order; two streams may share a stamp."""
    events = [
        (t * 1_000_000_000, name, 0.1 * t + shift)
        for name, shift in (("speed", 0.0), ("near", 1.0), ("far", 2.0))
        for t in draw(stamps)
    ]
    return draw(st.permutations(events))


def log_of(events, covers):
    """The events that are used, in the order of their stamps."""
    streams = {}
    for name in ("speed", "near", "far"):
        mine = sorted((t, value) for t, stream, value in events if stream == name)
        assume(mine)
        t, values = np.array(mine).T
        streams[name] = sq.Stream(t.astype(np.int64), values, covers=covers)
    return sq.SensorLog(streams)


@pytest.mark.parametrize("start", MODELS)
@given(
    events=arriving(),
    covers=st.sampled_from(["after", "before"]),
    max_delay=st.sampled_from([0.0, 5.0, 30.0, math.inf]),
)
def test_the_end_is_that_of_the_log_of_what_was_used(start, events, covers, max_delay):
    estimates = sq.stream(FILTER, MODELS[start], events, max_delay=max_delay, covers=covers, max_gap=math.inf)
    made = list(estimates)
    used = [event for event, estimate in zip(events, made, strict=True) if estimate.used]
    newest = -1
    for event, estimate in zip(events, made, strict=True):
        assert estimate.late == (event[0] < newest)
        if newest - event[0] > max_delay * 1e9:
            assert not estimate.used
        newest = max(newest, event[0])
    assume(any(name != "speed" and t >= (start or 0) for t, name, _ in used))
    log = log_of(used, covers)
    assume(all((log[name].t >= (start or 0)).any() for name in ("near", "far")))
    if start is None:  # events that were left out do not move the start either
        assume(min(t for t, _, _ in used) == log.span()[0])
    end = estimates.belief
    run = sq.run(FILTER, MODELS[start], log, at=np.array([end.t]), max_gap=math.inf)
    assert run.t[-1] == end.t
    np.testing.assert_allclose(end.mean, run.mean[-1], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(end.cov, run.cov[-1], rtol=1e-12)
