"""Stamps as decimal text, to the last nanosecond: a float would lose the digits of a Unix time."""

from __future__ import annotations

from decimal import ROUND_HALF_EVEN, Decimal, InvalidOperation

__all__ = ["decimal_seconds", "stamp_ns", "stamp_s"]

NS = 1_000_000_000
MOST = 2**63 - 1


def stamp_s(text: str) -> int:
    """Nanoseconds of a number of seconds written in decimal, as in `1403715529.112143517` or `1.4e+09`.

    Raises
    ------
    ValueError
        saying what the text is instead.
    """
    whole, _, fraction = text.partition(".")
    if whole.isdecimal() and len(fraction) <= 9 and (fraction.isdecimal() or not fraction):
        return _in_range(int(whole) * NS + int(fraction.ljust(9, "0")), text)
    try:
        value = Decimal(text)
    except InvalidOperation:
        raise ValueError(f"{text!r} is not a number of seconds") from None
    if not value.is_finite() or abs(value) > MOST:
        raise ValueError(f"{text!r} is not a finite number of seconds")
    return _in_range(int((value * NS).to_integral_value(ROUND_HALF_EVEN)), text)


def stamp_ns(text: str) -> int:
    """Nanoseconds of a whole number of nanoseconds; raises ValueError as `stamp_s` does."""
    try:
        return _in_range(int(text), text)
    except ValueError:
        raise ValueError(f"{text!r} is not a whole number of nanoseconds") from None


def _in_range(ns: int, text: str) -> int:
    if abs(ns) > MOST:
        raise ValueError(
            f"{text} s is beyond what 64 bits of nanoseconds hold; nanoseconds belong in a column named t_ns"
        )
    return ns


def decimal_seconds(ns: int) -> str:
    """Write nanoseconds as seconds with nine decimals, exactly."""
    sign, size = ("-", -int(ns)) if ns < 0 else ("", int(ns))
    return f"{sign}{size // NS}.{size % NS:09d}"
