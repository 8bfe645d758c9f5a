"""Wrapping an angle: into ]-pi, pi], once and for all, without touching what is inside."""

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from sequential.manifold import wrap_angle

angles = st.floats(-1e6, 1e6).map(np.float64)


@given(angles)
@example(np.float64(np.nextafter(-np.pi, 0.0)))
@example(np.float64(np.nextafter(np.pi, 4.0)))
@example(np.float64(-np.pi))
@example(np.float64(3.0 * np.pi))
def test_wrapped_angle_is_inside_and_stays(angle):
    wrapped = wrap_angle(angle)
    assert -np.pi < wrapped <= np.pi
    assert wrap_angle(wrapped) == wrapped
    assert abs(np.exp(1j * angle) - np.exp(1j * wrapped)) <= 1e-15 + 1e-15 * abs(angle)


@given(st.floats(-3.14, 3.14).map(np.float64))
def test_angle_inside_is_kept_to_the_last_bit(angle):
    assert wrap_angle(angle) == angle


def test_the_cut_belongs_to_plus_pi():
    np.testing.assert_array_equal(wrap_angle(np.array([-np.pi, np.pi])), [np.pi, np.pi])


def test_nan_is_not_hidden():
    assert np.isnan(wrap_angle(np.float64(np.nan)))
