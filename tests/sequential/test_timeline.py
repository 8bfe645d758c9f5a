"""Where a log meets a model: nodes, steps, readings, and what does not fit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sequential as sq
from sequential.errors import DataError, GapError, MissingStreamError, ShapeError, TimeOrderError
from sequential.timeline import prepare


def drift(x, u, dt):
    return np.array([x[0] + dt * u[0]])


def model_of(sensors=("position",), start=None, **more):
    process = sq.Process(step=drift, noise_density=1.0, inputs=1)
    return sq.StateSpace(
        sq.Vector(1),
        sq.Gaussian([0.0], [1.0]),
        process,
        {name: sq.LinearSensor([[1.0]], 0.25) for name in sensors},
        input="speed",
        start=start,
        check=False,
        **more,
    )


def log_of(speed, position, covers="after"):
    return sq.SensorLog(
        {
            "speed": sq.Stream(np.array(speed), np.arange(len(speed)) * 1.0, covers=covers),
            "position": sq.Stream(np.array(position), np.zeros(len(position))),
        },
        "drive",
    )


stamps = st.lists(st.integers(0, 500), min_size=2, max_size=30, unique=True).map(sorted)


@given(stamps, stamps, st.sampled_from(["after", "before"]))
def test_steps_cover_the_time_between_nodes_once(speed, position, covers):
    model = model_of(start=0)
    problem = prepare(model, log_of(speed, position, covers))
    plan = problem.schedule
    for k in range(1, len(problem.t)):
        steps = slice(plan.step_ptr[k], plan.step_ptr[k + 1])
        assert np.isclose(plan.step_dt[steps].sum() * 1e9, problem.t[k] - problem.t[k - 1])
    assert (plan.step_dt > 0).all()
    assert plan.reading_ptr[-1] == len(position)
    node = np.searchsorted(problem.t, problem.reading_t)
    for k in range(len(problem.t)):
        assert (node[plan.reading_ptr[k] : plan.reading_ptr[k + 1]] == k).all()


@given(stamps, stamps)
def test_each_interval_is_driven_by_the_sample_that_covers_it(speed, position):
    for covers in ("after", "before"):
        problem = prepare(model_of(start=0), log_of(speed, position, covers))
        plan = problem.schedule
        edges = problem.t[0] + np.append(0, np.cumsum(np.round(plan.step_dt * 1e9).astype(np.int64)))
        for row, begin, end in zip(plan.step_input, edges[:-1], edges[1:], strict=True):
            if covers == "after":
                assert speed[row] <= begin or row == 0
                assert row == len(speed) - 1 or speed[row + 1] >= end
            else:
                assert speed[row] >= end or row == len(speed) - 1
                assert row == 0 or speed[row - 1] <= begin


def test_wanted_times_become_nodes_and_readings_before_the_start_are_left_out():
    problem = prepare(model_of(start=1.0), log_of([0.0, 1.0, 2.0], [0.5, 1.5]), at=np.array([1.25, 0.2]))
    assert (problem.t * 1e-9).tolist() == [1.0, 1.25, 1.5]
    assert problem.reading_row.tolist() == [1]


def test_readings_of_one_moment_share_a_node():
    log = log_of([0.0, 1.0, 2.0], [1.0, 2.0]).replaced(other=sq.Stream([1.0, 2.0], [0.0, 0.0]))
    problem = prepare(model_of(("position", "other")), log)
    assert problem.schedule.reading_ptr.tolist() == [0, 0, 2, 4]
    assert problem.schedule.sensor.tolist() == [0, 1, 0, 1]


def wide(log):
    return log.replaced(position=sq.Stream([1.0], [[1.0, 2.0]]))


LONG_GAP = log_of([*np.arange(0, 10, 0.1), *np.arange(20, 30, 0.1)], [5.0, 25.0])

MISFITS = {
    "missing sensor": (
        model_of(("gps",)),
        log_of([0.0, 1.0], [0.5]),
        MissingStreamError,
        "log 'drive' has no stream 'gps'; it has position, speed",
    ),
    "missing input": (
        model_of(),
        log_of([0.0, 1.0], [0.5]).without("speed"),
        MissingStreamError,
        "log 'drive' has no stream 'speed'; it has position",
    ),
    "empty sensor": (
        model_of(),
        log_of([0.0, 1.0], []),
        MissingStreamError,
        r"log\['position'\] has no reading at or after the start; drop the sensor or mend the log",
    ),
    "late start": (
        model_of(start=9.0),
        log_of([0.0, 10.0], [0.5]),
        MissingStreamError,
        r"log\['position'\] has no reading at or after the start",
    ),
    "empty input": (
        model_of(),
        log_of([], [0.5]),
        MissingStreamError,
        r"log\['speed'\] drives the process and is empty",
    ),
    "columns of a sensor": (
        model_of(),
        wide(log_of([0.0, 1.0], [0.5])),
        ShapeError,
        r"log\['position'\] has 2 columns, the model takes 1",
    ),
    "columns of the input": (
        model_of(),
        log_of([0.0], [0.5]).replaced(speed=sq.Stream([0.0], [[1.0, 2.0]])),
        ShapeError,
        r"log\['speed'\] has 2 columns, the model takes 1",
    ),
    "a gap": (
        model_of(),
        LONG_GAP,
        GapError,
        r"log\['speed'\] .* 10\.100 s after 9\.900 s .* limit 10\.000 s\); cut .* max_gap=…",
    ),
    "an input that ends early": (
        model_of(),
        log_of(np.arange(0, 5, 0.01), [1.0, 50.0]),
        GapError,
        r"log\['speed'\] drives the process but pauses for 45\.010 s after 4\.990 s",
    ),
    "an unchecked mess": (
        model_of(),
        sq.SensorLog.unchecked(
            {"speed": sq.Stream([0.0, 2.0, 1.0], [1.0, 1.0, 1.0]), "position": sq.Stream([0.5], [1.0])}
        ),
        TimeOrderError,
        r"log\['speed'\] goes backwards at sample 2",
    ),
}


@pytest.mark.parametrize("misfit", MISFITS)
def test_a_log_that_does_not_fit_is_a_sentence(misfit):
    model, log, error, message = MISFITS[misfit]
    with pytest.raises(error, match=message) as caught:
        prepare(model, log)
    assert "\n" not in str(caught.value)


def test_a_gap_may_be_allowed():
    assert len(prepare(model_of(), LONG_GAP, max_gap=11.0).t) == 3


def test_a_landmark_sensor_needs_to_be_told_which():
    sensors = {"beacon": sq.Range([[0.0, 0.0], [5.0, 5.0]], 0.01)}
    model = sq.StateSpace(sq.Vector(2), sq.Gaussian([1.0, 1.0], [1.0, 1.0]), sq.RandomWalk(1.0), sensors)
    with pytest.raises(ShapeError, match=r"log\['beacon'\] needs 1 context columns .* it has 0"):
        prepare(model, sq.SensorLog({"beacon": sq.Stream([0.0], [1.0])}))
    for index in (2.0, -1.0, 0.5):
        log = sq.SensorLog({"beacon": sq.Stream([0.0, 1.0], [1.0, 1.0], [0.0, index])})
        message = (
            rf"log\['beacon'\] sees landmark {index:g} at sample 1, but its sensor has 2 landmarks, 0 to 1"
        )
        with pytest.raises(DataError, match=message):
            prepare(model, log)
