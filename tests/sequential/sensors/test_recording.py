"""ImuRecording: what passes the door, what does not, and the way through a log and back."""

import numpy as np
import pytest

from sequential.errors import DataError, MissingStreamError, NotFiniteError, ShapeError, TimeOrderError
from sequential.log import SensorLog, Stream
from sequential.sensors import Finding, ImuRecording


def recording(count=50, **changes):
    rng = np.random.default_rng(3)
    mag = rng.normal(size=(count, 3))
    mag[1::2] = np.nan
    parts = {
        "t": np.arange(count) * 10_000_000 + 1_700_000_000_000_000_000,
        "accel": rng.normal(size=(count, 3)),
        "gyro": rng.normal(size=(count, 3)),
        "mag": mag,
        "temperature": np.linspace(20, 21, count),
    }
    return ImuRecording(**{**parts, **changes})


def test_rate_and_duration():
    imu = recording()
    assert imu.rate == pytest.approx(100.0)
    assert imu.duration == pytest.approx(0.49)
    assert imu.dt.shape == (49,)
    assert imu.sensors == ("accel", "gyro", "mag")


def test_arrays_are_sealed_copies():
    gyro = np.zeros((50, 3))
    imu = recording(gyro=gyro)
    gyro[0] = 1.0
    assert imu.gyro[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        imu.gyro[0, 0] = 2.0


def test_slice_keeps_stamps_and_both_ends():
    part = recording().slice(0.1, 0.2)
    assert len(part) == 11
    assert part.t[0] == recording().t[10]
    with pytest.raises(DataError, match=r"lasts 0\.490 s"):
        recording().slice(5.0)


def test_log_and_back_is_the_same():
    imu = recording()
    log = imu.to_log()
    assert log["imu"].values.shape == (50, 6)
    np.testing.assert_array_equal(log["imu"].values[:, :3], imu.accel)
    back = ImuRecording.from_log(log)
    for name in ("t", "accel", "gyro", "mag", "temperature"):
        np.testing.assert_array_equal(getattr(back, name), getattr(imu, name))


def test_one_sensor_goes_through_a_log():
    for name in ("accel", "gyro", "mag"):
        one = ImuRecording(t=[0.0, 0.1], **{name: np.ones((2, 3))})
        assert ImuRecording.from_log(one.to_log()).sensors == (name,)


@pytest.mark.parametrize(
    ("changes", "error", "words"),
    [
        ({"accel": np.zeros((50, 2))}, ShapeError, r"accel .* must be \(50, 3\)"),
        ({"gyro": np.zeros((49, 3))}, ShapeError, "gyro"),
        ({"t": np.zeros(50)}, TimeOrderError, "repeats at sample 1"),
        ({"t": -np.arange(50.0)}, TimeOrderError, "goes backwards at sample 1"),
        ({"gyro": np.full((50, 3), np.nan)}, NotFiniteError, "gyro .* drop such rows"),
        ({"mag": np.tile([1.0, np.nan, 1.0], (50, 1))}, NotFiniteError, "three NaN"),
        ({"temperature": np.zeros(3)}, ShapeError, "temperature"),
        ({"accel": None, "gyro": None, "mag": None}, MissingStreamError, "holds no sensor"),
        ({"gyro_unit": "deg/s"}, DataError, "'rad/s' or 'counts'"),
    ],
)
def test_door(changes, error, words):
    with pytest.raises(error, match=words):
        recording(**changes)


def test_require_names_what_is_missing():
    imu = recording(gyro=None, accel_unit="counts")
    assert imu.require("mag") is imu
    assert imu.require("accel", si=False) is imu
    with pytest.raises(MissingStreamError, match="has no gyro"):
        imu.require("gyro")
    with pytest.raises(DataError, match="in counts"):
        imu.require("accel")


def test_log_without_inertial_streams():
    with pytest.raises(MissingStreamError, match="none of the streams"):
        ImuRecording.from_log(SensorLog({"gps": Stream([0.0], [[1.0]])}))


def test_finding_is_a_sentence():
    assert str(Finding("warn", "gaps", "t = 1 s", "cut it")) == "gaps (t = 1 s): cut it"
