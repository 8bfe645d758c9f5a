"""Numbers and bands are read back as they were written."""

import numpy as np
import pytest

from factorlab.l19.results.numbers import band_of, band_text, number_of, number_text

ENDS = (None, 0.0, 1.0, -2.5, 0.03, 1234.5, 2.5e-7, -6e7)


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (3.0, "3"), (-3.25, "−3,25"), (0.0123456, "0,01235"), (1.2e-5, "1,2·10⁻⁵"), (1e9, "1·10⁹"),
     (float("nan"), "–"), (60.0, "60"), (99999.6, "99999,6"), (0.99999, "1")],
)  # fmt: skip
def test_as_a_french_reader_expects(value, text):
    digits = 6 if value == 99999.6 else 4
    assert number_text(value, digits) == text


def test_numbers_come_back(rng):
    for value in rng.standard_normal(300) * 10.0 ** rng.integers(-12, 12, 300):
        assert number_of(number_text(value)) == pytest.approx(value, rel=5e-4)
        assert number_of(number_text(value, 15)) == pytest.approx(value, rel=1e-13)


@pytest.mark.parametrize("low", ENDS)
@pytest.mark.parametrize("high", ENDS)
def test_bands_come_back_exactly(low, high):
    assert band_of(band_text(low, high)) == (low, high)


@pytest.mark.parametrize("text", ["", "environ 3", "1 à", "3 %"])
def test_what_is_no_band_is_refused(text):
    with pytest.raises(ValueError, match=r".+"):
        band_of(text)


def test_no_number_is_none():
    assert np.isnan(number_of("–"))
