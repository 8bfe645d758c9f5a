"""Logs at the door: what is accepted, what is refused, and how a messy recording is mended."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sequential.errors import DataError, MissingStreamError, NotFiniteError, ShapeError, TimeOrderError
from sequential.log import SensorLog, Stream, nanoseconds, seconds


@given(st.integers(-(10**15), 10**15), st.integers(-(10**18), 10**18))
def test_seconds_since_a_near_origin_come_back_exactly(offset, origin):
    assert int(nanoseconds(float(seconds(origin + offset, origin)))) == offset


@given(st.lists(st.integers(-(2**62), 2**62), max_size=5))
def test_integers_are_nanoseconds_and_keep_their_shape(stamps):
    given_stamps = np.array(stamps, dtype=np.int64).reshape(-1, 1)
    assert np.array_equal(nanoseconds(given_stamps), given_stamps)


def test_unix_seconds_keep_what_a_float_holds():
    t = 1_700_000_000.123456
    assert abs(int(nanoseconds(t)) - 1_700_000_000_123_456_000) < 240  # spacing of floats there


@pytest.mark.parametrize(
    ("stamps", "error", "message"),
    [
        ([0.0, np.nan], NotFiniteError, "stamp 1 is nan; every stamp must be a finite number of seconds"),
        ([1.7e18], DataError, r"stamp 0 is 1\.7e\+18 s, .*floats are seconds: give nanoseconds as integers"),
        (["now"], DataError, "stamps must be an array of numbers"),
    ],
)
def test_what_is_no_stamp_is_refused(stamps, error, message):
    with pytest.raises(error, match=message):
        nanoseconds(stamps)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (([0, 1], [1.0]), ShapeError, r"2 stamps need values of shape \(2, m\), got \(1,\)"),
        (
            ([0, 1], np.zeros((2, 2, 2))),
            ShapeError,
            r"2 stamps need values of shape \(2, m\), got \(2, 2, 2\)",
        ),
        (([0, 1], [1.0, 2.0], [1.0]), ShapeError, r"2 stamps need a context of shape \(2, c\), got \(1,\)"),
        (
            ([0, 1], [[1.0], [1.0, 2.0]]),
            DataError,
            "values must be an array of numbers, with rows of one length",
        ),
        (([0], ["high"]), DataError, "values must be an array of numbers"),
        (([0], [1.0], None, "during"), DataError, "'after' its stamp or 'before' it, got 'during'"),
    ],
)
def test_what_is_no_stream_is_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        Stream(*arguments)


def test_one_column_may_be_flat_and_arrays_are_owned():
    values = np.array([1.0, 2.0])
    stream = Stream([0.0, 1.0], values, [3, 4])
    values[0] = 99.0
    assert stream.values.tolist() == [[1.0], [2.0]]
    assert stream.context.tolist() == [[3.0], [4.0]]


FAULTS = {
    "infinity": (
        Stream([0.0, 1.0, 2.0], [0.0, -np.inf, np.inf]),
        NotFiniteError,
        r"log\['gyro'\] holds infinity, .* at sample 1 \(and 1 more\); drop such .* log\.finite\(\)",
    ),
    "NaN in the context": (
        Stream([0.0, 1.0], [0.0, 1.0], [0.0, np.nan]),
        NotFiniteError,
        r"log\['gyro'\] holds infinity, or NaN in its context, at sample 1",
    ),
    "backwards": (
        Stream([5.10, 5.12, 5.11], [0.0, 1.0, 2.0]),
        TimeOrderError,
        r"log\['gyro'\] goes backwards at sample 2: 5\.120000 s then 5\.110000 s; sort .* log\.sorted\(\)",
    ),
    "repeated": (
        Stream([0.0, 1.0, 1.0, 2.0, 2.0], np.arange(5.0)),
        TimeOrderError,
        r"log\['gyro'\] repeats the stamp 1\.000000 s at sample 2 \(2 repeats in all\); .* log\.unique\(\)",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_log_refuses_faulty_streams_by_name_sample_and_remedy(fault):
    stream, error, message = FAULTS[fault]
    with pytest.raises(error, match=message) as caught:
        SensorLog({"fine": Stream([0.0], [1.0]), "gyro": stream})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_can_be_mended(fault):
    log = SensorLog.unchecked({"gyro": FAULTS[fault][0]})
    mended = log.finite().sorted().unique().check()
    assert mended.checked
    assert len(mended["gyro"]) >= 1
    assert (np.diff(mended["gyro"].t) > 0).all()


@given(st.lists(st.tuples(st.integers(0, 20), st.sampled_from([1.0, np.nan])), min_size=1, max_size=30))
def test_any_mess_can_be_mended(rows):
    t, values = zip(*rows, strict=True)
    log = SensorLog.unchecked({"s": Stream(np.array(t), values)})
    mended = log.finite().sorted().unique().check()["s"]
    assert mended.t.tolist() == sorted({stamp for stamp, value in rows if np.isfinite(value)})


def test_two_landmarks_may_be_seen_at_once():
    SensorLog({"beacon": Stream([1.0, 1.0], [5.0, 6.0], [0, 1])})
    with pytest.raises(TimeOrderError, match="repeats the stamp"):
        SensorLog({"beacon": Stream([1.0, 1.0], [5.0, 6.0], [1, 1])})


def test_what_is_not_there_is_named():
    log = SensorLog({"gps": Stream([0.0], [1.0]), "imu": Stream([0.0], [1.0])}, "drive")
    with pytest.raises(MissingStreamError, match="log 'drive' has no stream 'gsp'; it has gps, imu"):
        log["gsp"]
    with pytest.raises(MissingStreamError, match="log 'empty' holds no reading at all"):
        SensorLog({"gps": Stream([], [])}, "empty").span()
    with pytest.raises(
        DataError, match=r"log\['gps'\] is a list; a log is made of streams: Stream\(t, values\)"
    ):
        SensorLog({"gps": [1.0, 2.0]})


def test_holding_out_keeps_one_in_every():
    log = SensorLog({"gps": Stream(np.arange(10.0), np.arange(10.0)), "imu": Stream([0.0], [1.0])})
    used, held = log.hold_out("gps", 5)
    assert used["gps"].values.ravel().tolist() == [4.0, 9.0]
    assert held.values.ravel().tolist() == [0.0, 1.0, 2.0, 3.0, 5.0, 6.0, 7.0, 8.0]
    assert len(log.hold_out("gps", 1)[1]) == 0
    with pytest.raises(ShapeError, match="one reading in 0 cannot be kept; give 1 or more"):
        log.hold_out("gps", 0)


def test_logs_are_cut_and_recombined():
    log = SensorLog({"a": Stream([0, 1, 2], [0.0, 1.0, 2.0], covers="before"), "b": Stream([5], [1.0])}, "x")
    cut = log.between(1, 4)
    assert (cut["a"].t.tolist(), len(cut["b"]), cut.name, cut["a"].covers) == ([1, 2], 0, "x", "before")
    assert list(log.without("a")) == ["b"]
    assert log.span() == (0, 5)
    assert log.replaced(b=Stream([9], [2.0])).span() == (0, 9)
    assert ("a" in log, "c" in log, len(log)) == (True, False, 2)
