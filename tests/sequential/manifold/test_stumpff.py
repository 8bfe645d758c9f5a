"""Stumpff functions against their series in exact arithmetic, and against the textbook forms."""

from fractions import Fraction
from math import factorial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sequential.manifold.stumpff import SERIES_BELOW, half_cotangent, inverse_coefficient, stumpff

squared_angles = st.one_of(st.floats(0.0, 40.0), st.floats(0.0, 1e-6), st.floats(0.999, 1.001))


def exact(order, squared):
    x = Fraction(squared)
    return float(sum((-x) ** j / factorial(order + 2 * j) for j in range(40)))


@pytest.mark.parametrize("order", range(6))
@given(squared=squared_angles)
def test_stumpff_matches_exact_series(order, squared):
    value = stumpff(order, np.float64(squared))
    np.testing.assert_allclose(value, exact(order, squared), rtol=1e-13, atol=2e-16)


@pytest.mark.parametrize("order", range(6))
def test_no_step_where_series_and_closed_form_meet(order):
    below, above = stumpff(order, np.array([np.nextafter(SERIES_BELOW, 0.0), SERIES_BELOW]))
    assert below == pytest.approx(above, rel=1e-13)


@given(st.floats(0.5, 6.0))
def test_named_combinations_match_the_textbook(angle):
    cotangent = angle / 2.0 / np.tan(angle / 2.0)
    assert half_cotangent(np.float64(angle**2)) == pytest.approx(cotangent, rel=1e-12, abs=1e-14)
    coefficient = (1.0 - cotangent) / angle**2
    assert inverse_coefficient(np.float64(angle**2)) == pytest.approx(coefficient, rel=1e-12)


def test_limits_at_zero():
    zero = np.zeros(2)
    np.testing.assert_array_equal(half_cotangent(zero), [1.0, 1.0])
    np.testing.assert_allclose(inverse_coefficient(zero), [1.0 / 12.0] * 2, rtol=1e-15)
