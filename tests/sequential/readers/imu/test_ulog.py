"""PX4's flight logs, written byte by byte as docs.px4.io describes the format."""

import struct
import sys

import numpy as np
import pytest

from sequential.errors import DataError, FileFormatError, MissingStreamError
from sequential.readers import read_imu
from sequential.sensors import simulate_imu, tumble

RATE = 200.0


@pytest.fixture
def truth(rng):
    return simulate_imu(tumble(10.0, rng, rest=2.0), rng, rate=RATE).truth


def message(kind, payload):
    return struct.pack("<HB", len(payload), ord(kind)) + payload


class ULogWriter:
    """The bytes of docs.px4.io, ULog file format: header, definitions, data."""

    def __init__(self):
        magic = bytes([0x55, 0x4C, 0x6F, 0x67, 0x01, 0x12, 0x35, 0x01])
        self.head = magic + struct.pack("<Q", 1_000_000) + message("B", bytes(40))
        self.formats, self.subscriptions, self.data = b"", b"", []
        self.ids = {}

    def topic(self, name, fields, layout):
        self.formats += message("F", f"{name}:{fields}".encode())
        ident = len(self.ids)
        self.ids[name] = (ident, layout)
        self.subscriptions += message("A", struct.pack("<BH", 0, ident) + name.encode())

    def add(self, name, *values):
        ident, layout = self.ids[name]
        self.data.append(
            (values[0], message("D", struct.pack("<H", ident) + struct.pack("<" + layout, *values)))
        )

    def write(self, path):
        body = b"".join(bits for _, bits in sorted(self.data, key=lambda pair: pair[0]))
        path.write_bytes(self.head + self.formats + self.subscriptions + body)
        return path


@pytest.fixture
def ulog(tmp_path, truth):
    log = ULogWriter()
    log.topic(
        "sensor_combined",
        "uint64_t timestamp;float[3] gyro_rad;uint32_t gyro_integral_dt;"
        "int32_t accelerometer_timestamp_relative;float[3] accelerometer_m_s2;"
        "uint32_t accelerometer_integral_dt;",
        "Q3fIi3fI",
    )
    fields = "uint64_t timestamp;uint64_t timestamp_sample;float[3] magnetometer_ga;"
    log.topic("vehicle_magnetometer", fields, "QQ3f")
    for k, t in enumerate(truth.t):
        stamp = 1_000_000 + int(t) // 1000
        log.add("sensor_combined", stamp, *truth.angular_rate[k], 5000, 0, *truth.specific_force[k], 5000)
        if k % 4 == 0:
            log.add("vehicle_magnetometer", stamp + 300, stamp, *(truth.field[k] / 100.0))
    return log.write(tmp_path / "flight.ulg")


def test_ulog(ulog, truth):
    imu = read_imu(ulog)
    assert imu.rate == pytest.approx(RATE)
    assert imu.t[0] == 1_000_000_000
    np.testing.assert_allclose(imu.gyro, truth.angular_rate, atol=1e-6)
    np.testing.assert_allclose(imu.accel, truth.specific_force, atol=1e-5)
    known = np.isfinite(imu.mag[:, 0])
    np.testing.assert_array_equal(np.flatnonzero(known), np.arange(0, len(imu), 4))
    np.testing.assert_allclose(imu.mag[known], truth.field[::4], atol=1e-4)
    assert any("z down" in f.what for f in imu.findings)


def test_ulog_of_the_raw_sensors(tmp_path, truth):
    log = ULogWriter()
    fields = "uint64_t timestamp;uint64_t timestamp_sample;uint32_t device_id;float x;float y;float z;"
    for topic in ("sensor_accel", "sensor_gyro", "sensor_mag"):
        log.topic(topic, fields, "QQI3f")
    for k, t in enumerate(truth.t):
        stamp = int(t) // 1000
        log.add("sensor_gyro", stamp + 900, stamp + 500, 1, *truth.angular_rate[k])
        log.add("sensor_accel", stamp + 900, stamp + 700, 2, *truth.specific_force[k])
        log.add("sensor_mag", stamp + 950, stamp + 700, 3, *(truth.field[k] / 100.0))
    imu = read_imu(log.write(tmp_path / "raw.ulg"))
    np.testing.assert_allclose(imu.gyro, truth.angular_rate[1 : len(imu) + 1], atol=1e-6)
    assert any("have stamps of their own" in f.what for f in imu.findings)


def test_ulog_without_an_imu(tmp_path):
    log = ULogWriter()
    log.topic("sensor_baro", "uint64_t timestamp;float pressure;", "Qf")
    log.add("sensor_baro", 5, 101325.0)
    with pytest.raises(MissingStreamError, match="none of the topics sensor_combined"):
        read_imu(log.write(tmp_path / "x.ulg"))
    (tmp_path / "y.ulg").write_bytes(b"not a log at all")
    with pytest.raises(FileFormatError, match="is not a ULog"):
        read_imu(tmp_path / "y.ulg")


def test_ulog_needs_pyulog(ulog, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyulog", None)
    with pytest.raises(DataError, match=r"pip install 'factorlab\[ulog\]'"):
        read_imu(ulog)
