"""Units as people write them in headers and options, and what they are in SI."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from math import pi

from sequential.errors import DataError
from sequential.sensors.gravity import STANDARD_GRAVITY

__all__ = ["FACTORS", "GRAVITY", "Scale", "known_units", "parse_units", "scale_of"]

GRAVITY = STANDARD_GRAVITY  # m/s² in one g
DEG = pi / 180.0

FACTORS: dict[str, dict[str, float]] = {
    "accel": {"m/s^2": 1.0, "g": GRAVITY, "mg": 1e-3 * GRAVITY, "cm/s^2": 0.01},
    "gyro": {"rad/s": 1.0, "deg/s": DEG, "mdeg/s": 1e-3 * DEG, "rpm": pi / 30.0},
    "mag": {"uT": 1.0, "nT": 1e-3, "mT": 1e3, "T": 1e6, "G": 100.0, "mG": 0.1},
    "temperature": {"degC": 1.0, "K": 1.0, "degF": 5.0 / 9.0},
    "t": {"s": 1e9, "ms": 1e6, "us": 1e3, "ns": 1.0},
}
OFFSETS = {"K": -273.15, "degF": -160.0 / 9.0}  # °C, added after the factor
SPELLINGS: dict[str, dict[str, str]] = {
    "accel": {
        **dict.fromkeys(("m/s2", "m/s/s", "ms-2", "mps2", "m/sec2", "m/s**2", "ms2", "m/s"), "m/s^2"),
        **dict.fromkeys(("g", "gn", "g0", "gs", "gforce"), "g"),
        **dict.fromkeys(("mg", "millig", "mgn"), "mg"),
        **dict.fromkeys(("cm/s2", "gal"), "cm/s^2"),
    },
    "gyro": {
        **dict.fromkeys(("rad/s", "rads-1", "rad/sec", "rads", "radps", "rps", "1/s", "s-1"), "rad/s"),
        **dict.fromkeys(("deg/s", "degs-1", "dps", "deg/sec", "degs", "degrees/s", "degps"), "deg/s"),
        **dict.fromkeys(("mdps", "mdeg/s"), "mdeg/s"),
        "rpm": "rpm",
    },
    "mag": {
        **dict.fromkeys(("ut", "microtesla", "utesla"), "uT"),
        **dict.fromkeys(("nt", "nanotesla"), "nT"),
        **dict.fromkeys(("mt", "millitesla"), "mT"),
        **dict.fromkeys(("t", "tesla"), "T"),
        **dict.fromkeys(("g", "ga", "gauss"), "G"),
        **dict.fromkeys(("mg", "mga", "mgauss", "milligauss"), "mG"),
    },
    "temperature": {
        **dict.fromkeys(("degc", "c", "celsius"), "degC"),
        **dict.fromkeys(("k", "kelvin"), "K"),
        **dict.fromkeys(("degf", "f", "fahrenheit"), "degF"),
    },
    "t": {
        **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), "s"),
        **dict.fromkeys(("ms", "msec", "millis", "millisecond", "milliseconds"), "ms"),
        **dict.fromkeys(("us", "usec", "micros", "microsecond", "microseconds"), "us"),
        **dict.fromkeys(("ns", "nsec", "nanos", "nanosecond", "nanoseconds"), "ns"),
    },
}
COUNTS = {"counts", "count", "lsb", "raw", "adc", "au", "a.u.", "digits"}
SIGNS = str.maketrans({"²": "2", "⁻": "-", "¹": "1", "µ": "u", "μ": "u", "°": "deg", "º": "deg", "±": "+-"})
SENSITIVITY = re.compile(r"(\d+\.?\d*)(?:lsb|counts?|digits?)/\(?([a-z/0-9]+)\)?")
FULL_SCALE = re.compile(r"(?:counts|lsb|raw)?(?:\+-|\+/-)(\d+\.?\d*)([a-z/0-9]+)")
# What data sheets state (MPU-6050, QMC5883L), a little off 32768 counts by the range.
SHEET = {
    ("gyro", "deg/s"): {250.0: 131.0, 500.0: 65.5, 1000.0: 32.8, 2000.0: 16.4},
    ("mag", "G"): {2.0: 12000.0, 8.0: 3000.0},
}


@dataclass(frozen=True, slots=True)
class Scale:
    """`si = factor * value + offset`; a factor of None leaves counts as they are."""

    name: str
    factor: float | None
    offset: float = 0.0


def known_units(sensor: str) -> tuple[str, ...]:
    """What may be written for a sensor, besides `counts`, `16384 LSB/g` and `±2 g` of 16-bit converters."""
    return tuple(FACTORS[sensor])


def scale_of(sensor: str, text: str) -> Scale | None:
    """The scale that a text names for `accel`, `gyro`, `mag`, `temperature` or `t`; None for no unit.

    `16384 LSB/g` and `131 LSB/dps` are sensitivities; `±4 g` and `±500 dps` are the ranges of a 16-bit
    converter, with the sensitivities of the MPU-6050's data sheet.
    """
    clean = re.sub(r"[\s_^·*]", "", text.strip().lower().translate(SIGNS)).strip("[]()")
    if clean in COUNTS and sensor in {"accel", "gyro", "mag"}:
        return Scale("counts", None)
    if sensor == "mag" and re.fullmatch(r"[^\x00-\x7f]+t", clean):
        return Scale("uT", 1.0)  # a µ that lost its encoding on the way
    if name := SPELLINGS[sensor].get(clean):
        return Scale(name, FACTORS[sensor][name], OFFSETS.get(name, 0.0))
    return None if sensor == "t" else _per_count(sensor, clean)


def _per_count(sensor: str, clean: str) -> Scale | None:
    """The scale of a sensitivity, `131lsb/dps`, or of a full scale, `+-250dps`."""
    sensitivity, full_scale = SENSITIVITY.fullmatch(clean), FULL_SCALE.fullmatch(clean)
    found = sensitivity or full_scale
    unit = SPELLINGS[sensor].get(found[2]) if found else None
    if found is None or unit is None or not (number := float(found[1])):
        return None
    counts = number if sensitivity else SHEET.get((sensor, unit), {}).get(number, 32768.0 / number)
    return Scale(f"{counts:g} LSB/{unit}", FACTORS[sensor][unit] / counts)


def parse_units(given: Mapping[str, str] | str | None) -> dict[str, Scale]:
    """Scales by sensor, from a mapping or from `accel=g,gyro=deg/s,t=ms`.

    Raises
    ------
    DataError
        for a sensor or a unit that is not known, with what is.
    """
    if given is None:
        return {}
    pairs = given.items() if isinstance(given, Mapping) else _split(given)
    scales = {}
    for sensor, text in pairs:
        name = {"time": "t", "acc": "accel", "gyr": "gyro", "temp": "temperature"}.get(sensor, sensor)
        if name not in FACTORS:
            near = get_close_matches(sensor, FACTORS, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise DataError(f"units are given for {', '.join(FACTORS)}, not for {sensor!r}{hint}")
        scale = scale_of(name, text)
        if scale is None:
            raise DataError(
                f"{text!r} is not a unit of {name}; it is one of {', '.join(known_units(name))}, counts, "
                "a sensitivity such as '16384 LSB/g', or the range of a 16-bit converter such as '±4 g'"
            )
        scales[name] = scale
    return scales


def _split(text: str) -> list[tuple[str, str]]:
    pairs = []
    for part in filter(None, (word.strip() for word in text.split(","))):
        name, sign, value = part.partition("=")
        if not sign:
            raise DataError(f"{part!r} is not NAME=UNIT; units are written accel=g,gyro=deg/s,mag=uT,t=ms")
        pairs.append((name.strip(), value.strip()))
    return pairs
