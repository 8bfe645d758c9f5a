"""Exports of Sensor Logger and phyphox, written here in their published layout."""

import json
import shutil
import zipfile

import numpy as np
import pytest

from sequential.errors import FileFormatError, MissingStreamError
from sequential.readers import read_imu
from sequential.sensors import simulate_imu, tumble

START = 1_698_501_144_401_773_000
GRAVITY = 9.80665


@pytest.fixture
def motion(rng):
    return tumble(20.0, rng, rest=4.0, sway=0.05, period=(3.0, 10.0))


def sampled(motion, rate, offset=0.0):
    """Seconds, specific force, rate and field at a rate of its own."""
    truth = simulate_imu(motion, np.random.default_rng(0), rate=rate).truth
    return truth.t * 1e-9 + offset, truth.specific_force, truth.angular_rate, truth.field


def gravity_of(motion, rate):
    return simulate_imu(motion, np.random.default_rng(0), rate=rate).truth


def sensor_logger(folder, name, s, xyz):
    """The columns stand in the order z, y, x."""
    lines = ["time,seconds_elapsed,z,y,x"]
    for second, (x, y, z) in zip(s, xyz.tolist(), strict=True):
        lines.append(f"{START + round(second * 1e9)},{second:.9f},{z!r},{y!r},{x!r}")
    (folder / f"{name}.csv").write_text("\n".join(lines) + "\n")


def metadata(folder, platform, standardised):
    (folder / "Metadata.csv").write_text(
        "version,device name,recording epoch time,recording time,recording timezone,platform,appVersion,"
        "device id,sensors,sampleRateMs,standardisation,platform version\n"
        f"3,Phone,{START // 10**6},2023-10-28_13-52-24,Europe/Paris,{platform},1.29,"
        f"abc,Accelerometer|Gyroscope,10|10,{standardised},14\n"
    )


@pytest.fixture
def android(tmp_path, motion):
    folder = tmp_path / "2023-10-28_13-52-24"
    folder.mkdir()
    s, force, _, _ = sampled(motion, 101.0, 0.0031)
    linear = force - np.array([0, 0, GRAVITY])  # not what gravity is in a turned body, and so not to be used
    sensor_logger(folder, "TotalAcceleration", s, force)
    sensor_logger(folder, "Accelerometer", s, linear)
    s, _, rate, _ = sampled(motion, 99.0)
    sensor_logger(folder, "Gyroscope", s, rate)
    s, _, _, field = sampled(motion, 25.0, 0.0017)
    sensor_logger(folder, "Magnetometer", s, field)
    (folder / "Annotation.csv").write_text("time,seconds_elapsed,text,millisecond_press_duration\n")
    (folder / "Location.csv").write_text(
        "time,seconds_elapsed,speed,altitude,longitude,latitude\n1,0,0,0,2,48\n"
    )
    metadata(folder, "android", "false")
    return folder


def test_android(android, motion):
    imu = read_imu(android)
    assert imu.rate == pytest.approx(99.0, rel=1e-4)
    assert imu.t[0] >= START
    t = (imu.t - START) * 1e-9
    _, expected_rate = motion.attitude(t)
    np.testing.assert_allclose(imu.gyro, expected_rate, atol=1e-6)
    exact = sampled(motion, 1000.0)
    between = np.stack([np.interp(t - 0.0031, exact[0], exact[1][:, k]) for k in range(3)], axis=1)
    assert np.abs(imu.accel - between).max() < 0.02  # interpolated at 100 Hz
    known = np.isfinite(imu.mag[:, 0])
    assert 0.23 < known.mean() < 0.28
    said = " ".join(str(f) for f in imu.findings)
    assert "accelerometer (101 Hz) and gyro (99 Hz) have stamps of their own" in said
    assert "magnetometer (25 Hz)" in said


def test_folder_zip_and_nested_zip_agree(android, tmp_path):
    plain = read_imu(android)
    flat = tmp_path / "flat.zip"
    with zipfile.ZipFile(flat, "w") as archive:
        for path in android.iterdir():
            archive.write(path, path.name)
    nested = shutil.make_archive(str(tmp_path / "nested"), "zip", android.parent, android.name)
    for path in (flat, nested):
        again = read_imu(path)
        np.testing.assert_array_equal(again.accel, plain.accel)
        np.testing.assert_array_equal(again.t, plain.t)
    assert read_imu(flat).name == "flat"


def test_ios_needs_gravity_and_turns_signs_round(tmp_path, motion):
    truth = gravity_of(motion, 100.0)
    s = truth.t * 1e-9
    up = truth.specific_force - 0.3
    sensor_logger(tmp_path, "Accelerometer", s, -(truth.specific_force - up))
    sensor_logger(tmp_path, "Gravity", s, -up)
    sensor_logger(tmp_path, "Gyroscope", s, truth.angular_rate)
    metadata(tmp_path, "ios", "false")
    imu = read_imu(tmp_path)
    np.testing.assert_allclose(imu.accel, truth.specific_force, atol=1e-9)
    said = " ".join(str(f) for f in imu.findings)
    assert "opposite sign" in said
    assert "plus the gravity that the phone estimated" in said
    metadata(tmp_path, "ios", "true")
    np.testing.assert_allclose(read_imu(tmp_path).accel, -truth.specific_force, atol=1e-9)


def test_without_gravity_is_refused(tmp_path, motion):
    truth = gravity_of(motion, 100.0)
    sensor_logger(tmp_path, "Accelerometer", truth.t * 1e-9, 0.01 * truth.angular_rate)
    sensor_logger(tmp_path, "Gyroscope", truth.t * 1e-9, truth.angular_rate)
    with pytest.raises(FileFormatError, match=r"without gravity .* TotalAcceleration"):
        read_imu(tmp_path)


def test_uncalibrated_in_g_is_told_by_its_size(tmp_path, motion):
    truth = gravity_of(motion, 100.0)
    sensor_logger(tmp_path, "AccelerometerUncalibrated", truth.t * 1e-9, truth.specific_force / GRAVITY)
    sensor_logger(tmp_path, "GyroscopeUncalibrated", truth.t * 1e-9, truth.angular_rate)
    imu = read_imu(tmp_path)
    np.testing.assert_allclose(imu.accel, truth.specific_force)
    assert any("taken as g" in str(f) for f in imu.findings)


def test_one_file_of_the_export(android):
    imu = read_imu(android / "Gyroscope.csv")
    assert imu.sensors == ("gyro",)
    assert imu.rate == pytest.approx(99.0, rel=1e-4)


def test_sensor_logger_json(tmp_path, motion):
    truth = gravity_of(motion, 50.0)
    records = []
    for name, values in (("TotalAcceleration", truth.specific_force), ("Gyroscope", truth.angular_rate)):
        for t, (x, y, z) in zip(truth.t, values, strict=True):
            stamp = {"sensor": name, "time": str(START + int(t)), "seconds_elapsed": str(t * 1e-9)}
            records.append({**stamp, "z": str(z), "y": str(y), "x": str(x)})
    records.append({"sensor": "Location", "time": str(START), "speed": "0"})
    path = tmp_path / "export.json"
    path.write_text(json.dumps(records))
    imu = read_imu(path)
    np.testing.assert_array_equal(imu.gyro, truth.angular_rate)
    np.testing.assert_array_equal(imu.accel, truth.specific_force)
    path.write_text("[1, 2]")
    with pytest.raises(FileFormatError, match="Sensor Logger's list of records"):
        read_imu(path)


# --- phyphox ---


def phyphox(path, label, unit, s, xyz, *, sep=",", decimal=".", time="Time (s)"):
    head = [
        f'"{time}"',
        *(f'"{label} {axis} ({unit})"'.replace('" ', '"') for axis in "xyz"),
        f'"Absolute ({unit})"',
    ]
    lines = [sep.join(head)]
    for second, row in zip(s, xyz, strict=True):
        cells = [second, *row, float(np.linalg.norm(row))]
        lines.append(sep.join(f"{cell:.9E}".replace(".", decimal) for cell in cells))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


@pytest.mark.parametrize("layout", [",.", ";,", "\t.", "\t,", ";."])
def test_phyphox(tmp_path, motion, layout):
    sep, decimal = layout
    kinds = {"sep": sep, "decimal": decimal}
    s, force, _, _ = sampled(motion, 200.0)
    phyphox(tmp_path / "Accelerometer.csv", "Acceleration", "m/s^2", s, force, **kinds)
    s, _, rate, _ = sampled(motion, 200.0)
    phyphox(tmp_path / "Gyroscope.csv", "Gyroscope", "rad/s", s, rate, **kinds)
    s, _, _, field = sampled(motion, 50.0)
    phyphox(tmp_path / "Magnetometer.csv", "Magnetic field", "µT", s, field, **kinds)
    (tmp_path / "meta").mkdir()
    (tmp_path / "meta" / "device.csv").write_text('"property","value"\n"version","1.1.16"\n')
    (tmp_path / "meta" / "time.csv").write_text(
        '"event","experiment time","system time","system time text"\n'
    )
    imu = read_imu(tmp_path)
    np.testing.assert_allclose(imu.accel, force, atol=1e-7)
    np.testing.assert_allclose(imu.gyro, rate, atol=1e-7)
    assert np.isfinite(imu.mag[:, 0]).sum() == pytest.approx(len(s), abs=2)
    assert imu.findings[0].severity == "note"


def test_phyphox_xyz_headers_take_the_sensor_from_the_file(tmp_path, motion):
    s, force, rate, _ = sampled(motion, 100.0)
    phyphox(tmp_path / "Accelerometer.csv", "", "m/s^2", s, force)
    phyphox(tmp_path / "Gyroscope.csv", "", "rad/s", s, rate)
    np.testing.assert_allclose(read_imu(tmp_path).gyro, rate, atol=1e-7)


def test_phyphox_in_french(tmp_path, motion):
    s, force, rate, _ = sampled(motion, 100.0)
    french = {"sep": ";", "decimal": ",", "time": "Temps (s)"}
    phyphox(tmp_path / "Accéléromètre.csv", "Accélération", "m/s^2", s, force, **french)
    phyphox(tmp_path / "Gyroscope.csv", "Gyroscope", "rad/s", s, rate, **french)
    imu = read_imu(tmp_path)
    assert imu.sensors == ("accel", "gyro")
    np.testing.assert_allclose(imu.accel, force, atol=1e-7)


def test_phyphox_raw_data_of_one_sensor(tmp_path, motion):
    s, _, rate, _ = sampled(motion, 100.0)
    path = tmp_path / "Raw Data.csv"
    phyphox(path, "Gyroscope", "rad/s", s, rate)
    np.testing.assert_allclose(read_imu(path).gyro, rate, atol=1e-7)
    np.testing.assert_allclose(read_imu(tmp_path).gyro, rate, atol=1e-7)


@pytest.mark.parametrize("name", ["Linear Accelerometer.csv", "Raw Data.csv"])
def test_phyphox_acceleration_without_g(tmp_path, motion, name):
    s, _, rate, _ = sampled(motion, 100.0)
    phyphox(tmp_path / name, "Linear Acceleration", "m/s^2", s, 0.1 * rate + 1e-3)
    phyphox(tmp_path / "Gyroscope.csv", "Gyroscope", "rad/s", s, rate)
    for path in (tmp_path, tmp_path / name):
        with pytest.raises(FileFormatError, match=r"gravity.*'Acceleration \(with"):
            read_imu(path)


# --- streams that do not fit ---


def test_a_pause_of_one_sensor_is_left_out(android):
    path = android / "TotalAcceleration.csv"
    lines = path.read_text().splitlines()
    path.write_text("\n".join(lines[:500] + lines[900:]))
    imu = read_imu(android)
    assert imu.dt.max() == pytest.approx(400 / 101, abs=0.05)
    assert any(f.severity == "warn" and "left out" in f.what for f in imu.findings)


def test_a_faster_stream_is_averaged(tmp_path, motion):
    """400 Hz on 50 Hz: a vibration of 199 Hz must not come out as a slow one."""
    s, force, _, _ = sampled(motion, 400.0)
    shaken = force + 5.0 * np.sin(2 * np.pi * 199.0 * s)[:, None]
    sensor_logger(tmp_path, "TotalAcceleration", s, shaken)
    slow, _, rate, _ = sampled(motion, 50.0)
    sensor_logger(tmp_path, "Gyroscope", slow, rate)
    imu = read_imu(tmp_path)
    wanted = sampled(motion, 50.0)[1]
    assert np.abs(imu.accel[2:-2] - wanted[2 : len(imu.accel) - 2]).max() < 1.2


def test_streams_of_different_days(tmp_path, motion):
    s, force, rate, _ = sampled(motion, 100.0)
    sensor_logger(tmp_path, "TotalAcceleration", s, force)
    sensor_logger(tmp_path, "Gyroscope", s + 86400.0, rate)
    with pytest.raises(FileFormatError, match="no moment in common"):
        read_imu(tmp_path)


def test_an_export_of_something_else(tmp_path):
    (tmp_path / "Location.csv").write_text("time,seconds_elapsed,latitude,longitude\n1,2,3,4\n")
    with pytest.raises(MissingStreamError, match="has none of TotalAcceleration"):
        read_imu(tmp_path)
    (tmp_path / "Location.csv").rename(tmp_path / "data.xls")
    with pytest.raises(FileFormatError, match="in phyphox choose CSV, not Excel"):
        read_imu(tmp_path)
    broken = tmp_path / "broken.zip"
    broken.write_bytes(b"PK\x03\x04 not really")
    with pytest.raises(FileFormatError, match="not a zip that can be read"):
        read_imu(broken)


def test_rows_without_numbers_and_out_of_order(android):
    path = android / "TotalAcceleration.csv"
    lines = path.read_text().splitlines()
    lines[10] = lines[10].rsplit(",", 3)[0] + ",,,"
    lines[20], lines[21] = lines[21], lines[20]
    lines.insert(30, lines[30])
    path.write_text("\n".join(lines))
    (android / "Gravity.csv").write_text("time,seconds_elapsed,z,y,x\n1,2,,,\n")
    imu = read_imu(android)
    assert (np.diff(imu.t) > 0).all()
    assert any("2 rows that repeat one or hold no number" in f.what for f in imu.findings)
