"""A log as it would arrive."""

import numpy as np
import pytest

import sequential as sq
from sequential.errors import FactorlabError


def log():
    return sq.SensorLog(
        {
            "gps": sq.Stream(
                [0.0, 1.0, 2.0], [[5.0, 1.0], [6.0, 2.0], [7.0, 3.0]], noise_cov=np.ones((3, 2))
            ),
            "tag": sq.Stream([0.5, 1.0, 1.5], [1.0, 2.0, 3.0], context=[0, 1, 2], covers="before"),
        }
    )


def test_without_delays_the_stamps_decide():
    events = sq.arrivals(log())
    assert [(e.t // 500_000_000, e.name) for e in events] == [
        (0, "gps"), (1, "tag"), (2, "gps"), (2, "tag"), (3, "tag"), (4, "gps"),
    ]  # fmt: skip
    assert len(events) == 6
    assert events.lateness == 0.0
    assert events.covers == {"gps": "after", "tag": "before"}
    first, second = events[0], events[1]
    assert (first.values.tolist(), first.context, first.noise_cov.shape) == ([5.0, 1.0], None, (2, 2))
    assert (second.values.tolist(), second.context.tolist(), second.noise_cov) == ([1.0], [0.0], None)
    assert [e.name for e in events[1:3]] == ["tag", "gps"]
    np.testing.assert_array_equal(events[1:3].at, events.at[1:3])


def test_delays_decide_the_order_and_the_lateness():
    events = sq.arrivals(log(), {"gps": [0.75, 0.0, 0.0]})
    assert [e.name for e in events][:2] == ["tag", "gps"]
    assert events.lateness == pytest.approx(0.5)
    assert events.at.tolist()[:2] == [500_000_000, 750_000_000]


def test_drawn_delays_are_those_of_the_generator():
    drawn = [
        sq.arrivals(log(), {"tag": lambda rng, n: rng.exponential(0.3, n)}, np.random.default_rng(seed)).at
        for seed in (1, 1, 2)
    ]
    np.testing.assert_array_equal(drawn[0], drawn[1])
    assert (drawn[0] != drawn[2]).any()


@pytest.mark.parametrize(
    ("delays", "sentence"),
    [
        ({"imu": 0.1}, r"has no stream 'imu' to delay; it has gps, tag"),
        ({"gps": [0.1, 0.2]}, r"must be one number or 3, one for each reading, got \(2,\)"),
        ({"gps": -0.1}, r"must be zero or more seconds"),
        ({"gps": [0.1, np.nan, 0.1]}, r"must be zero or more seconds"),
        ({"gps": lambda rng, n: rng.uniform(0, 1, n)}, r"give arrivals a rng"),
    ],
)
def test_delays_that_make_no_sense_are_sentences(delays, sentence):
    with pytest.raises(FactorlabError, match=sentence):
        sq.arrivals(log(), delays)
