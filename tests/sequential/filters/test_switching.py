"""What several models of one system must share, how they switch, and what is refused."""

import math

import numpy as np
import pytest
from switching import coasting, draw

import sequential as sq
from sequential.errors import ModelError, ShapeError
from sequential.filters.switching import transitions_of

IMM = sq.InteractingMultipleModel
CALM, WILD = coasting(0.01), coasting(4.0)


def test_rates_do_not_care_how_time_is_cut():
    rates = [[-0.3, 0.2, 0.1], [0.0, -0.5, 0.5], [1.0, 1.0, -2.0]]
    stamps = np.array([0, 10**9, 3 * 10**9, 3 * 10**9 + 5])
    whole = transitions_of(stamps[[0, 2]], 3, None, rates)
    parts = transitions_of(stamps, 3, None, rates)
    np.testing.assert_array_equal(parts[0], np.eye(3))
    np.testing.assert_allclose(parts[1] @ parts[2], whole[1], atol=1e-14)
    np.testing.assert_allclose(parts.sum(axis=2), 1.0, atol=1e-14)
    leaving = transitions_of(stamps[:2], 2, None, 0.25)[1]
    assert leaving[0, 0] == pytest.approx(0.5 + 0.5 * math.exp(-0.5))
    np.testing.assert_array_equal(transitions_of(stamps[:2], 3, 0.8, None)[1].diagonal(), 0.8)


def other(**changes):
    settings = {"manifold": sq.Vector(4), "sensors": CALM.sensors, "start": 0.0, **changes}
    n = settings["manifold"].size
    return sq.StateSpace(
        settings["manifold"], sq.Gaussian(np.zeros(n), np.eye(n)),
        sq.RandomWalk(1.0), settings["sensors"], start=settings["start"],
    )  # fmt: skip


FLAT = other(manifold=sq.Vector(3), sensors={})


@pytest.mark.parametrize(
    ("settings", "error", "match"),
    [
        ({"models": ()}, ModelError, "one StateSpace for each way"),
        ({}, ModelError, "one of the two"),
        ({"transition": 0.9, "switching_rate": 0.1}, ModelError, "one of the two"),
        ({"transition": np.eye(3)}, ShapeError, r"\(2, 2\), got \(3, 3\)"),
        ({"transition": [[0.9, 0.2], [0.1, 0.9]]}, ModelError, "add up to 1"),
        ({"transition": 1.2}, ModelError, "zero or more"),
        ({"switching_rate": [[0.1, 0.1], [0.1, -0.1]]}, ModelError, "adds up to 0"),
        ({"transition": 0.9, "initial": [1.0]}, ShapeError, "one probability for each of 2"),
        ({"transition": 0.9, "initial": [1.0, 0.1]}, ModelError, "add up to 1"),
        ({"transition": 0.9, "filter": sq.UnscentedKalmanFilter()}, ModelError, "got UnscentedKalmanFilter"),
        ({"transition": 0.9, "filter": sq.KalmanFilter(form="ud")}, ModelError, "got form='ud'"),
        ({"transition": 0.9, "models": (CALM, FLAT)}, ModelError, "one state"),
        ({"transition": 0.9, "models": (CALM, other(sensors={}))}, ModelError, "same sensors"),
        ({"transition": 0.9, "models": (CALM, other(start=1.0))}, ModelError, "start="),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused(settings, error, match):
    with pytest.raises(error, match=match):
        IMM(**{"models": (CALM, WILD), **settings})


def test_the_log_is_laid_out_by_one_of_the_models(rng):
    log, _, _ = draw((CALM, WILD), np.eye(2), 5, 0.5, rng)
    with pytest.raises(ModelError, match="not among the models"):
        sq.run(IMM((CALM, WILD), transition=0.9), coasting(1.0), log)
