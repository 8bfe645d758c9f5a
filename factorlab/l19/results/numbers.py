"""Numbers and bands as RESULTATS.md writes them in French, and read back."""

from __future__ import annotations

from math import floor, isfinite, log10

__all__ = ["band_of", "band_text", "number_of", "number_text"]

UP = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
DOWN = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
NONE = "–"


def number_text(value: float, digits: int = 4) -> str:
    """With a decimal comma: `0,0123`, `−3,2`, `1,2·10⁻⁵`; `–` for what is no number."""
    if not isfinite(value):
        return NONE
    if value == 0:
        return "0"
    if float(value).is_integer() and abs(value) < 1e6:
        return f"{value:.0f}".replace("-", "−")
    size = abs(value)
    exponent = floor(log10(size))
    if -4 < exponent < 6:
        text = f"{size:.{max(digits - 1 - exponent, 0)}f}"
        text = text.rstrip("0").rstrip(".") if "." in text else text
    else:
        mantissa, _, power = f"{size:.{digits - 1}e}".partition("e")
        text = f"{mantissa.rstrip('0').rstrip('.')}·10{str(int(power)).translate(UP)}"
    return ("−" if value < 0 else "") + text.replace(".", ",")


def number_of(text: str) -> float:
    """What `number_text` has written.

    Raises
    ------
    ValueError
        where it has not.
    """
    plain = text.strip().replace("−", "-").replace(",", ".")
    if plain == NONE:
        return float("nan")
    mantissa, _, power = plain.partition("·10")
    return float(f"{mantissa}e{power.translate(DOWN)}" if power else mantissa)


def band_text(low: float | None, high: float | None) -> str:
    """`0,9 à 1,1`, `≤ 2`, `≥ 3`, or `–` where nothing is judged."""
    ends = [None if end is None else number_text(end, 6) for end in (low, high)]
    if ends[0] is None and ends[1] is None:
        return NONE
    if ends[0] is None:
        return f"≤ {ends[1]}"
    return f"≥ {ends[0]}" if ends[1] is None else f"{ends[0]} à {ends[1]}"


def band_of(text: str) -> tuple[float | None, float | None]:
    """Both ends, None where open.

    Raises
    ------
    ValueError
        where the text is no band.
    """
    plain = text.strip()
    if plain == NONE:
        return None, None
    if plain.startswith("≤"):
        return None, number_of(plain[1:])
    if plain.startswith("≥"):
        return number_of(plain[1:]), None
    low, high = plain.split(" à ")
    return number_of(low), number_of(high)
