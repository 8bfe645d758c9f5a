"""Units as people write them."""

import numpy as np
import pytest

from sequential.errors import DataError, FileFormatError
from sequential.readers.imu.header import describe, find_layout, parse_columns
from sequential.readers.imu.units import parse_units, scale_of

G = 9.80665
DEG = np.pi / 180


@pytest.mark.parametrize(
    ("sensor", "text", "factor"),
    [
        ("accel", "m/s^2", 1.0),
        ("accel", "m/s²", 1.0),
        ("accel", "m s^-2", 1.0),
        ("accel", "G", G),
        ("accel", "(mg)", G / 1000),
        ("accel", "16384 LSB/g", G / 16384),
        ("accel", "±2 g", G / 16384),
        ("accel", "+-16g", G / 2048),
        ("gyro", "rad/s", 1.0),
        ("gyro", "rad s^-1", 1.0),
        ("gyro", "°/s", DEG),
        ("gyro", "dps", DEG),
        ("gyro", "131 LSB/dps", DEG / 131),
        ("gyro", "±500 deg/s", DEG / 65.5),
        ("gyro", "±300 dps", DEG * 300 / 32768),
        ("mag", "µT", 1.0),
        ("mag", "μT", 1.0),
        ("mag", "”T", 1.0),
        ("mag", "gauss", 100.0),
        ("mag", "nT", 1e-3),
        ("mag", "±2 G", 100 / 12000),
        ("t", "µs", 1e3),
        ("t", "ms", 1e6),
    ],
)
def test_spellings(sensor, text, factor):
    assert scale_of(sensor, text).factor == pytest.approx(factor)


def test_temperatures():
    for text, value in (("°C", 25.0), ("K", 298.15), ("°F", 77.0)):
        scale = scale_of("temperature", text)
        assert scale.factor * value + scale.offset == pytest.approx(25.0)


@pytest.mark.parametrize("text", ["", "furlong", "0 LSB/g", "±0 g", "12 LSB/uT"])
def test_no_unit(text):
    assert scale_of("accel", text) is None


def test_counts_have_no_factor():
    assert scale_of("gyro", "counts").factor is None
    assert scale_of("accel", "LSB").factor is None


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("acel=g", "did you mean 'accel'"),
        ("accel=furlong", "'furlong' is not a unit of accel; it is one of m/s"),
        ("accel", "accel=g,gyro=deg/s"),
    ],
)
def test_bad_units(given, words):
    with pytest.raises(DataError, match=words):
        parse_units(given)


def test_units_by_mapping_and_text_agree():
    assert parse_units("acc=g, time=ms") == parse_units({"accel": "g", "t": "ms"})


@pytest.mark.parametrize(
    ("cell", "role", "unit"),
    [
        ("ax", "ax", None),
        ("Accelerometer Z (g)", "az", "g"),
        ("gyro_x_dps", "gx", "deg/s"),
        ("accX", "ax", None),
        ("x_acc", "ax", None),
        ("imu.gx", "gx", None),
        ("#timestamp [ns]", "t", "ns"),
        ("w_RS_S_y [rad s^-1]", "gy", "rad/s"),
        ("angular_velocity.z", "gz", None),
        ("mag_0", "mx", None),
        ("Temperature (°C)", "temperature", "degC"),
        ("n_samples", "sample", None),
        ("time_us", "t", "us"),
        ("acc_z_m_s2", "az", "m/s^2"),
    ],
)
def test_header_cells(cell, role, unit):
    found, scale = describe(cell)
    assert found == role
    assert (scale.name if scale else None) == unit


@pytest.mark.parametrize(
    "cell", ["gravity_x", "Absolute acceleration (m/s^2)", "quaternionX", "x", "part", ""]
)
def test_cells_that_say_nothing(cell):
    assert describe(cell) is None


def test_one_sensor_has_one_unit():
    with pytest.raises(FileFormatError, match="one sensor has one unit"):
        find_layout(["t", "ax [g]", "ay [m/s^2]", "az [g]"])


def test_columns_by_name_number_and_order():
    header = ["when", "foo", "bar", "baz"]
    by_name = parse_columns({"t": "when", "ax": "foo", "ay": "bar", "az": "baz"}, header, "f")
    assert by_name == parse_columns("t=0,ax=1,ay=2,az=3", header, "f")
    assert by_name == parse_columns(["t", "ax", "ay", "az"], header, "f")
    assert by_name == parse_columns("t,ax,ay,az", header, "f")
    assert parse_columns(["t", "-", "ax", "ay", "az"], None, "f").columns["ax"] == 2


def test_columns_that_are_not_there():
    with pytest.raises(FileFormatError, match="no column 'fo'; did you mean 'foo'"):
        parse_columns({"ax": "fo"}, ["foo", "bar"], "f")
    with pytest.raises(FileFormatError, match="not for 'axe'; did you mean 'ax'"):
        parse_columns({"axe": "foo"}, ["foo", "bar"], "f")
