"""Stamps in decimal keep every nanosecond."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sequential.log import nanoseconds, seconds
from sequential.readers.stamps import decimal_seconds, stamp_ns, stamp_s

STAMPS = st.integers(-(2**63) + 1, 2**63 - 1)


@given(STAMPS)
def test_decimal_text_is_exact_both_ways(ns):
    assert stamp_s(decimal_seconds(ns)) == ns
    assert stamp_ns(str(ns)) == ns


@given(st.integers(0, 2 * 10**18))
def test_exponents_and_long_fractions_agree_with_plain_decimals(ns):
    assert stamp_s(f"{ns}e-9") == ns
    assert stamp_s(f"{decimal_seconds(ns)}000000") == ns
    assert stamp_s(f"+{decimal_seconds(ns)}") == ns


@given(st.integers(-(10**15), 10**15))
def test_float_seconds_of_a_week_come_back_to_the_nanosecond(ns):
    # 10^15 ns are 11.6 days: a float holds them with a resolution of 0.1 ns.
    assert int(nanoseconds(float(seconds(ns)))) == ns


@pytest.mark.parametrize(
    ("text", "ns"),
    [
        ("1403715529.112143517", 1403715529112143517),
        ("1.403715529112143517e+09", 1403715529112143517),
        ("-0.5", -500_000_000),
        ("0.0000000005", 0),
        ("0.0000000015", 2),
        (".25", 250_000_000),
        ("7.", 7_000_000_000),
    ],
)
def test_known_stamps(text, ns):
    assert stamp_s(text) == ns


@pytest.mark.parametrize("text", ["", "abc", "1,5", "nan", "inf", "²", "1e30", "12:30"])
def test_what_is_no_stamp_is_refused(text):
    with pytest.raises(ValueError, match="seconds"):
        stamp_s(text)


def test_nanoseconds_in_a_column_of_seconds_are_recognised():
    with pytest.raises(ValueError, match="nanoseconds belong in a column named t_ns"):
        stamp_s("1403715529112143517")
    with pytest.raises(ValueError, match=r"'1\.5' is not a whole number of nanoseconds"):
        stamp_ns("1.5")
