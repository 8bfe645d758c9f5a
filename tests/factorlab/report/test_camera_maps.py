"""Levels of a map: round numbers that span what is drawn."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from factorlab.report.camera_maps import levels_of
from factorlab.report.style import styled

sizes = st.floats(1e-4, 1e4)


@given(low=sizes, ratio=st.floats(1.0, 1e4))
def test_levels_span_the_values_and_grow(low, ratio):
    values = np.geomspace(low, low * ratio, 200)
    levels = levels_of(values)
    assert len(levels) >= 4
    assert (np.diff(levels) > 0.0).all()
    assert levels[0] <= values[0] * (1 + 1e-9)
    assert levels[-1] >= np.percentile(values, 99.5) * (1 - 1e-9)


@pytest.mark.parametrize("values", [np.full((3, 4), np.nan), np.zeros((3, 4)), np.full((3, 4), 2.0)])
def test_a_map_without_relief_can_be_drawn(values):
    levels = levels_of(values)
    with styled("test"):
        assert (np.diff(levels) > 0.0).all()
