"""Spans, tails and silences against what a person would point at."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sequential.evaluate.moments import pauses, tail, worst_span


def test_a_burst_has_a_when():
    t, excess = np.arange(100.0), np.full(100, -1.0)
    excess[40:45] = 10.0
    span = worst_span(t, excess, 99.0)
    assert (span.start, span.stop, span.readings) in {(40.0, 42.0, 3), (41.0, 43.0, 3), (42.0, 44.0, 3)}
    assert str(span) == f"t = {span.start:.0f}-{span.stop:.0f} s (60% of the excess)"


def test_one_reading_is_called_one_reading():
    excess = np.zeros(50)
    excess[7] = 5.0
    assert str(worst_span(np.arange(50.0), excess, 49.0)) == "t = 7 s (100% of the excess in one reading)"


def test_an_even_excess_has_no_when():
    assert worst_span(np.arange(100.0), np.ones(100), 99.0) is None
    assert worst_span(np.arange(100.0), -np.ones(100), 99.0) is None


@given(st.lists(st.floats(0, 10), min_size=1, max_size=25))
def test_the_span_is_the_shortest_that_is_heavy_enough(excess):
    excess = np.array(excess)
    t = np.arange(len(excess)) * 1.0
    span = worst_span(t, excess, 1e9)
    total = excess.sum()
    if span is None:
        assert total <= 0
        return
    heavy = [
        j - i
        for i in range(len(t))
        for j in range(i, len(t))
        if excess[i : j + 1].sum() >= 0.6 * total * (1 - 1e-9)
    ]
    assert span.stop - span.start == min(heavy)
    assert span.share >= 0.6 - 1e-9


def test_few_readings_with_most_of_the_sum_are_a_tail():
    values = np.ones(100)
    values[[10, 50, 90]] = 200.0
    found = tail(np.arange(100.0), values, 99.0)
    assert (found.few, found.count, found.burst) == (3, 100, None)
    values[:] = 1.0
    values[[50, 51, 52]] = 200.0
    assert tail(np.arange(100.0), values, 99.0).burst == (50.0, 52.0)


def test_chi_square_values_have_no_tail(rng):
    assert tail(np.arange(300.0), rng.chisquare(3, 300), 299.0) is None
    assert tail(np.arange(9.0), np.arange(9.0) ** 9, 8.0) is None


def test_silences_in_between_and_at_the_end():
    t = np.concatenate([np.arange(0.0, 10.0), np.arange(30.0, 40.0)])
    found = pauses(t, stop=39.0)
    assert (found.count, found.longest, found.begins, found.usual) == (1, 21.0, 9.0, 1.0)
    assert pauses(t[:10], stop=100.0).longest == 91.0
    assert pauses(t[:10], stop=12.0) is None
    assert pauses(t[:2], stop=1000.0) is None
