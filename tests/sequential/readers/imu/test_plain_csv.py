"""Tables that people write: round trips, spreadsheets, missing and broken cells, columns of any name."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from imu_tables import rows, written

from sequential.errors import FileFormatError
from sequential.readers import read_imu, write_imu
from sequential.sensors import ImuErrors, ImuRecording, simulate_imu, tumble

G = 9.80665
FIELDS = ("t", "accel", "gyro", "mag", "temperature")


def assert_same(a, b):
    for name in FIELDS:
        one, other = getattr(a, name), getattr(b, name)
        assert (one is None) == (other is None)
        if one is not None:
            np.testing.assert_array_equal(one, other)
    assert (a.accel_unit, a.gyro_unit, a.mag_unit) == (b.accel_unit, b.gyro_unit, b.mag_unit)


@pytest.fixture
def moving(rng):
    return simulate_imu(tumble(20.0, rng, rest=3.0), rng, rate=50.0, temperature=25.0).recording


# --- round trips ---

FLOATS = st.floats(-1e6, 1e6, allow_nan=False, width=64)


@given(
    values=arrays(np.float64, st.tuples(st.integers(2, 12), st.just(6)), elements=FLOATS),
    steps=st.lists(st.integers(1, 10**10), min_size=11, max_size=11),
    start=st.integers(-(10**15), 1_800_000_000 * 10**9),
    sensors=st.sampled_from(["accel", "gyro", "both"]),
)
def test_what_is_written_is_read(tmp_path_factory, values, steps, start, sensors):
    t = start + np.concatenate([[0], np.cumsum(steps)])[: len(values)]
    accel = values[:, :3] if sensors != "gyro" else None
    gyro = values[:, 3:] if sensors != "accel" else None
    recording = ImuRecording(t, accel, gyro, accel_unit="counts", name="x")
    path = tmp_path_factory.mktemp("imu") / "x.csv"
    write_imu(recording, path)
    again = read_imu(path)
    for name in FIELDS[:3]:
        if getattr(recording, name) is not None:
            np.testing.assert_array_equal(getattr(again, name), getattr(recording, name))


def test_a_simulated_recording_survives(tmp_path, rng):
    errors = ImuErrors(gyro_lsb=1e-3)
    imu = simulate_imu(tumble(5.0, rng), rng, errors=errors, mag_every=4, temperature=21.5).recording
    write_imu(imu, tmp_path / "simulated.csv")
    again = read_imu(tmp_path / "simulated.csv")
    assert_same(again, imu)
    assert again.name == "simulated"
    assert again.findings == ()


def test_unix_times_keep_every_nanosecond(tmp_path):
    t = 1_700_000_000_123_456_789 + np.arange(20) * 9_999_999
    write_imu(ImuRecording(t, accel=np.full((20, 3), G)), tmp_path / "x.csv")
    np.testing.assert_array_equal(read_imu(tmp_path / "x.csv").t, t)


# --- units given, guessed, stated by the user ---


@pytest.mark.parametrize(
    ("header", "scale"),
    [
        ("t,ax,ay,az,gx,gy,gz", (1.0, 1.0)),
        ("t,ax,ay,az,gx,gy,gz", (1 / G, 180 / np.pi)),
        ("t,ax,ay,az,gx,gy,gz", (1000 / G, 180 / np.pi)),
        ("t [s],ax [g],ay [g],az [g],gx (deg/s),gy (deg/s),gz (deg/s)", (1 / G, 180 / np.pi)),
        ("time,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z", (1.0, 1.0)),
        ("Timestamp,AccX,AccY,AccZ,GyroX,GyroY,GyroZ", (1 / G, 180 / np.pi)),
        ("time_s,acc_x_g,acc_y_g,acc_z_g,gyr_x_dps,gyr_y_dps,gyr_z_dps", (1 / G, 180 / np.pi)),
    ],
)
def test_units_come_out_right(tmp_path, moving, header, scale):
    path = written(tmp_path / "x.csv", "\n".join([header, *rows(moving, scale=scale)]))
    imu = read_imu(path)
    np.testing.assert_allclose(imu.accel, moving.accel, atol=1e-6)
    np.testing.assert_allclose(imu.gyro, moving.gyro, atol=1e-6)
    guessed = [f for f in imu.findings if "taken as" in f.what]
    assert len(guessed) == (0 if "g]" in header or "_g" in header else 2 if "_s" in header else len(guessed))


@pytest.mark.parametrize("counts", [16384, 8192, 4096, 2048])
@pytest.mark.parametrize("dps", [131, 65.5, 32.8, 16.4])
def test_counts_of_every_range(tmp_path, moving, counts, dps):
    lines = [
        ",".join(f"{v:.0f}" for v in (*a, *g))
        for a, g in zip(moving.accel / G * counts, np.rad2deg(moving.gyro) * dps, strict=True)
    ]
    imu = read_imu(written(tmp_path / "x.csv", "\n".join(["Fs,50", "ax,ay,az,gx,gy,gz", *lines])))
    np.testing.assert_allclose(imu.accel, moving.accel, atol=0.51 * G / counts)
    np.testing.assert_allclose(imu.gyro, moving.gyro, atol=0.51 * np.deg2rad(1 / dps))


def test_the_user_knows_better(tmp_path, moving):
    path = written(tmp_path / "x.csv", "\n".join(["t,ax [g],ay [g],az [g],gx,gy,gz", *rows(moving)]))
    with pytest.raises(FileFormatError, match="x"):
        read_imu(path, units={"accel": "cm/s^2"})  # 0.098 m/s²: no gravity
    imu = read_imu(path, units={"accel": "m/s^2", "gyro": "rad/s", "t": "s"})
    np.testing.assert_allclose(imu.accel, moving.accel, atol=1e-6)
    assert imu.findings == ()


@pytest.mark.parametrize(
    ("unit", "per_second", "said"), [("ms", 1e3, "ms"), ("us", 1e6, "us"), ("ns", 1e9, "ns"), ("s", 1.0, "s")]
)
def test_time_units_are_guessed(tmp_path, moving, unit, per_second, said):
    lines = rows(moving, stamp=lambda s: f"{s * per_second:.10g}")
    imu = read_imu(written(tmp_path / "x.csv", "\n".join(["t,ax,ay,az,gx,gy,gz", *lines])))
    assert imu.rate == pytest.approx(50.0)
    assert any(f"taken as {said}, which makes 50 Hz" in f.what for f in imu.findings)


@pytest.mark.parametrize("power", [0, 3, 6, 9])
def test_unix_times_tell_their_unit(tmp_path, moving, power):
    lines = rows(moving, stamp=lambda s: str(1_700_000_000 * 10**power + round(s * 10**power)))
    imu = read_imu(
        written(tmp_path / "x.csv", "\n".join(["time,ax,ay,az,gx,gy,gz", *lines])), units="gyro=rad/s"
    )
    assert imu.t[0] == 1_700_000_000 * 10**9
    assert imu.rate == pytest.approx(50.0)


def test_dates(tmp_path, moving):
    lines = rows(moving, stamp=lambda s: f"2026-01-31 12:00:{s:09.6f}")
    imu = read_imu(written(tmp_path / "x.csv", "\n".join(["time,ax,ay,az,gx,gy,gz", *lines])))
    assert imu.rate == pytest.approx(50.0)
    assert imu.t[0] == np.datetime64("2026-01-31T12:00:00", "ns").astype(int)


def test_a_counter_that_overflows(tmp_path, moving):
    start = 2**32 - 3_000_000
    lines = rows(moving, stamp=lambda s: str((start + round(s * 1e6)) % 2**32))
    imu = read_imu(written(tmp_path / "x.csv", "\n".join(["micros,ax,ay,az,gx,gy,gz", *lines])))
    assert imu.duration == pytest.approx(20.0)
    assert imu.rate == pytest.approx(50.0)


# --- spreadsheets ---


@pytest.mark.parametrize("bom", ["", "\ufeff"])
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
@pytest.mark.parametrize(
    ("sep", "decimal"), [(",", "."), (";", ","), (";", "."), ("\t", ","), ("\t", "."), (" ", ".")]
)
def test_separators_of_every_office(tmp_path, moving, bom, newline, sep, decimal):
    lines = [sep.join(["t", "ax", "ay", "az", "gx", "gy", "gz"]), *rows(moving, sep=sep, decimal=decimal)]
    path = tmp_path / "x.csv"
    path.write_bytes((bom + newline.join(lines) + newline).encode())
    np.testing.assert_allclose(read_imu(path).accel, moving.accel, atol=1e-6)


@pytest.mark.parametrize("encoding", ["cp1252", "utf-16", "utf-8"])
def test_encodings(tmp_path, moving, encoding):
    path = tmp_path / "x.csv"
    header = "t (s);ax (m/s²);ay (m/s²);az (m/s²);gx (°/s);gy (°/s);gz (°/s)"
    path.write_bytes(
        "\n".join([header, *rows(moving, sep=";", decimal=",", scale=(1, 180 / np.pi))]).encode(encoding)
    )
    np.testing.assert_allclose(read_imu(path).gyro, moving.gyro, atol=1e-6)


def test_quotes_comments_preamble_and_blank_lines(tmp_path, moving):
    lines = ["# logger 1.2", "Device,MPU", "", '"t","ax","ay","az","gx","gy","gz"', *rows(moving)]
    lines.insert(30, "# paused")
    lines.insert(40, "")
    assert len(read_imu(written(tmp_path / "x.csv", "\n".join(lines)))) == len(moving)


def test_quoted_cells_with_commas_of_their_own(tmp_path, moving):
    lines = [f'"a walk, fast",{line}' for line in rows(moving)]
    lines[3] = '"x",' + ",".join(f'"{cell}"'.replace(".", ",") for cell in rows(moving)[3].split(","))
    imu = read_imu(written(tmp_path / "x.csv", "\n".join(["label,t,ax,ay,az,gx,gy,gz", *lines])))
    np.testing.assert_allclose(imu.accel, moving.accel, atol=1e-6)


def test_a_header_of_two_lines(tmp_path, moving):
    lines = ["t,ax,ay,az,gx,gy,gz", "s,m/s2,m/s2,m/s2,rad/s,rad/s,rad/s", *rows(moving)]
    assert len(read_imu(written(tmp_path / "x.csv", "\n".join(lines)))) == len(moving)


def test_other_columns_are_left_alone(tmp_path, moving):
    lines = [f"{line},walk,{k}" for k, line in enumerate(rows(moving))]
    imu = read_imu(written(tmp_path / "x.csv", "\n".join(["t,ax,ay,az,gx,gy,gz,label,foo", *lines])))
    assert imu.sensors == ("accel", "gyro")


# --- columns named by the user ---


def test_columns_with_names_of_their_own(tmp_path, moving):
    path = written(tmp_path / "x.csv", "\n".join(["when,p,q,r,u,v,w", *rows(moving)]))
    with pytest.raises(
        FileFormatError, match=r"columns 'when', 'p', 'q', 'r', 'u', 'v', 'w'; expected are t, ax"
    ):
        read_imu(path)
    named = {"t": "when", "ax": "p", "ay": "q", "az": "r", "gx": "u", "gy": "v", "gz": "w"}
    np.testing.assert_allclose(read_imu(path, columns=named).gyro, moving.gyro, atol=1e-6)
    text = "t=when,ax=p,ay=q,az=r"
    assert read_imu(path, columns=text).sensors == ("accel",)


def test_numbers_without_a_header(tmp_path, moving):
    path = written(tmp_path / "x.csv", "\n".join(rows(moving)))
    with pytest.raises(FileFormatError, match="7 columns without names"):
        read_imu(path)
    assert len(read_imu(path, columns="t,ax,ay,az,gx,gy,gz")) == len(moving)
