"""CSV and NPZ logs: the layouts, what a file may look like, round trips, and sentences for every fault."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sequential.errors import DataError, FileFormatError, MissingStreamError, NotFiniteError, TimeOrderError
from sequential.log import SensorLog, Stream
from sequential.readers import read_log, write_log

LONG = """\
# covers imu=before
t,stream,v0,v1,v2,c0
0.00,imu,0.1,0.2,0.3
0.01,imu,0.4,0.5,0.6,
0.01,gps,4.0,2.0
0.02,beacon,7.5,,,2
0.02,beacon,8.5,,,3
"""
WIDE = """\
t,imu.ax,imu.ay,imu.az,gps.x,gps.y,beacon.range,beacon@landmark
0.00,0.1,0.2,0.3,,,,
0.01,0.4,0.5,0.6,4.0,2.0,,
0.02,,,,,,7.5,2
0.02,,,,,,8.5,3
"""


def write(tmp_path, text, name="drive.csv", encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return path


def assert_same(log, other):
    assert set(log) == set(other)
    for name, stream in log.items():
        assert np.array_equal(stream.t, other[name].t)
        assert np.array_equal(stream.values, other[name].values)
        assert stream.covers == other[name].covers
        assert (stream.context is None) == (other[name].context is None)
        if stream.context is not None:
            assert np.array_equal(stream.context, other[name].context)


def test_the_long_layout(tmp_path):
    log = read_log(write(tmp_path, LONG))
    assert (log.name, list(log)) == ("drive", ["imu", "gps", "beacon"])
    assert log["imu"].t.tolist() == [0, 10_000_000]
    assert log["imu"].values.tolist() == [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]
    assert log["gps"].values.tolist() == [[4.0, 2.0]]
    assert log["beacon"].context.tolist() == [[2.0], [3.0]]
    assert (log["imu"].covers, log["gps"].covers) == ("before", "after")


def test_the_wide_layout_is_the_same_log(tmp_path):
    wide = read_log(write(tmp_path, WIDE), covers={"imu": "before"})
    assert_same(wide, read_log(write(tmp_path, LONG, "long.csv")))


def test_a_column_without_a_dot_is_a_stream_of_one_value(tmp_path):
    log = read_log(
        write(tmp_path, "t_ns,depth,front.gps.x\n1403715529112143517,2.5,\n1403715529112143518,,1\n")
    )
    assert log["depth"].t.tolist() == [1403715529112143517]
    assert log["front.gps"].values.tolist() == [[1.0]]


DISGUISES = {
    "byte order mark": lambda text: "\ufeff" + text,
    "windows line ends": lambda text: text.replace("\n", "\r\n"),
    "semicolons": lambda text: text.replace(",", ";"),
    "decimal commas": lambda text: text.replace(",", ";").replace(".", ","),
    "tabs": lambda text: text.replace(",", "\t"),
    "comments and empty lines": lambda text: "# a comment\n\n" + text.replace("\n0.02", "\n\n# note\n0.02"),
    "blanks around cells": lambda text: text.replace(",", " , "),
    "quotes": lambda text: text.replace("imu", '"imu"').replace('covers "imu"', "covers imu"),
    "trailing separators": lambda text: text.replace("c0\n", "c0,,\n"),
}


@pytest.mark.parametrize("disguise", DISGUISES)
def test_what_a_csv_may_look_like(disguise, tmp_path):
    disguised = read_log(write(tmp_path, DISGUISES[disguise](LONG)))
    assert_same(disguised, read_log(write(tmp_path, LONG, "plain.csv")))


def a_log(rng):
    t = 1_700_000_000_123_456_789 + np.arange(6) * 10_000_000
    return SensorLog(
        {
            "imu": Stream(t, rng.standard_normal((6, 6)), covers="before"),
            "beacon": Stream(t[[0, 0, 3]], [1 / 3, 2 / 3, 1e-300], [[0.0], [1.0], [0.0]]),
        },
        "drive",
    )


@pytest.mark.parametrize("ending", ["csv", "npz"])
def test_written_logs_come_back_to_the_last_bit(ending, tmp_path, rng):
    log = a_log(rng)
    write_log(tmp_path / f"drive.{ending}", log)
    again = read_log(tmp_path / f"drive.{ending}")
    assert_same(again, log)
    assert again.name == "drive"
    assert [p.name for p in tmp_path.iterdir()] == [f"drive.{ending}"]


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=5))
def test_every_finite_number_survives_a_csv(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("log") / "log.csv"
    write_log(path, SensorLog({"s": Stream([0.5], [values])}))
    assert read_log(path)["s"].values.tolist() == [values]


def test_npz_arrays(tmp_path):
    np.savez(tmp_path / "a.npz", gps_t=[0.5, 1.5], gps=[1.0, 2.0], gps_context=[7, 8], notes=np.array("mine"))
    log = read_log(tmp_path / "a.npz", covers={"gps": "before"})
    assert list(log) == ["gps"]
    assert log["gps"].t.tolist() == [500_000_000, 1_500_000_000]
    assert log["gps"].context.tolist() == [[7.0], [8.0]]
    assert log["gps"].covers == "before"


def test_a_messy_log_can_be_read_unchecked_and_mended(tmp_path):
    path = write(tmp_path, "t,stream,v0\n2,a,20\n1,a,10\n1,a,11\n")
    with pytest.raises(
        TimeOrderError, match=r"drive\.csv, line 3: log\['a'\] goes backwards at sample 1: 2\.0"
    ):
        read_log(path)
    assert read_log(path, check=False)["a"].values.ravel().tolist() == [20.0, 10.0, 11.0]


LONG_FAULTS = {
    "too many cells": (
        "0.1,gps,1,2,3,4",
        FileFormatError,
        "line 3: 6 cells where the header names 5 columns",
    ),
    "a wider reading": (
        "0.1,gps,1,2,3",
        FileFormatError,
        r"line 3: 'gps' has 3 values here, 2 in its first row \(line 2\)",
    ),
    "a reading of nothing": ("0.1,gps,,", FileFormatError, "line 3: 'gps' has 0 values here"),
    "a hole": ("0.1,gps,,2", FileFormatError, "line 3, column 'v0': '' is not a number"),
    "text": ("0.1,gps,1,fix", FileFormatError, "line 3, column 'v1': 'fix' is not a number"),
    "infinity": (
        "0.1,gps,1,inf",
        NotFiniteError,
        "line 3, column 'v1': inf where a number is needed",
    ),
    "a bad stamp": (
        "noon,gps,1,2",
        FileFormatError,
        "line 3, column 't': .*'gps': 'noon' is not a number of seconds",
    ),
    "no stamp": (",gps,1,2", FileFormatError, "line 3, column 't': .*'' is not a number of seconds"),
    "no name": ("0.1,,1,2", FileFormatError, "line 3: the cell of column 'stream' is empty"),
    "backwards": (
        "-0.1,gps,1,2",
        TimeOrderError,
        r"line 3: log\['gps'\] goes backwards at sample 1.*log\.sorted\(\)",
    ),
    "a repeat": (
        "0.0,gps,1,2",
        TimeOrderError,
        r"line 3: log\['gps'\] repeats the stamp 0\.0.*log\.unique\(\)",
    ),
}


@pytest.mark.parametrize("fault", LONG_FAULTS)
def test_faults_of_a_long_log(fault, tmp_path):
    line, error, message = LONG_FAULTS[fault]
    path = write(tmp_path, f"t,stream,v0,v1,v2\n0.0,gps,1,2\n{line}\n")
    with pytest.raises(error, match=message) as caught:
        read_log(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


WIDE_FAULTS = {
    "too few cells": ("t,a.x,a.y\n0,1,2\n1,2\n", FileFormatError, "line 3: 2 cells where the header names 3"),
    "half a reading": (
        "t,a.x,a.y\n0,1,2\n1,2,\n",
        FileFormatError,
        "line 3: the cell of column 'a.y' is empty",
    ),
    "no context": (
        "t,a.x,a@id\n0,1,2\n1,2,\n",
        FileFormatError,
        "line 3: the cell of column 'a@id' is empty",
    ),
    "an empty stream": (
        "t,a.x,b.x\n0,1,\n",
        MissingStreamError,
        "the stream 'b' has columns but not one reading",
    ),
    "context alone": ("t,a@id\n0,1\n", FileFormatError, "'a@id' is the context of a stream without a value"),
    "infinity": ("t,a.x\n0,inf\n", NotFiniteError, r"line 2, column 'a\.x': inf where a number is needed"),
    "no time": ("time,a.x\n0,1\n", FileFormatError, "one time column, 't' .* or 't_ns' .*; it has time, a.x"),
    "two times": ("t,t_ns,a.x\n0,0,1\n", FileFormatError, "the header needs one time column"),
    "no header": ("0.0,1.0,2.0\n", FileFormatError, "line 1: the first row must name every column"),
    "an unnamed column": ("t,,a.x\n0,1,1\n", FileFormatError, "line 1: the first row must name every column"),
    "a name twice": ("t,a.x,a.x\n0,1,1\n", FileFormatError, "names the column 'a.x' twice"),
    "no lines": ("# only a comment\n", FileFormatError, "is empty; a log begins with a header"),
    "no reading": ("t,stream,v0\n", MissingStreamError, "has a header and no reading"),
    "unknown column": ("t,stream,v0,speed\n0,a,1,2\n", FileFormatError, "'speed' is not one of a long log"),
    "unknown covers": (
        "# covers b=before\nt,a.x\n0,1\n",
        FileFormatError,
        r"'covers b=before' must name a stream.*\(a\)",
    ),
    "bad covers": ("# covers a=during\nt,a.x\n0,1\n", FileFormatError, "say 'after' or 'before'"),
    "an open quote": ('t,a.x\n0,"1\n1,2\n', FileFormatError, "a quoted cell runs over the end of its line"),
}


@pytest.mark.parametrize("fault", WIDE_FAULTS)
def test_faults_of_headers_and_wide_logs(fault, tmp_path):
    text, error, message = WIDE_FAULTS[fault]
    path = write(tmp_path, text)
    with pytest.raises(error, match=message) as caught:
        read_log(path)
    assert str(caught.value).startswith(str(path))


NPZ_FAULTS = {
    "stamps alone": (
        {"gps_t": [0.0]},
        FileFormatError,
        "the array 'gps_t' needs its readings in an array 'gps'",
    ),
    "nothing": ({"gps": [1.0]}, FileFormatError, "no stream found; .* The file holds gps"),
    "empty": ({"gps_t": [], "gps": []}, MissingStreamError, "the stream 'gps' has not one reading"),
    "lengths": (
        {"gps_t": [0.0], "gps": [1.0, 2.0]},
        DataError,
        r"stream 'gps': 1 stamps need values of shape \(1, m\)",
    ),
    "text": ({"gps_t": [0.0], "gps": ["a"]}, FileFormatError, "'gps' holds <U1, numbers are needed"),
    "objects": (
        {"gps_t": [0.0], "gps": np.array([None])},
        FileFormatError,
        "not an archive of numeric arrays",
    ),
    "covers": (
        {"gps_t": [0.0], "gps": [1.0], "gps_covers": "x"},
        FileFormatError,
        "it says 'after' or 'before'",
    ),
    "infinity": (
        {"gps_t": [0.0], "gps": [np.inf]},
        NotFiniteError,
        r"log\['gps'\] holds infinity, or NaN in its context, at sample 0",
    ),
    "NaN stamp": ({"gps_t": [np.nan], "gps": [1.0]}, NotFiniteError, "stamp 0 is nan"),
    "backwards": (
        {"gps_t": [1.0, 0.0], "gps": [1.0, 2.0]},
        TimeOrderError,
        r"log\['gps'\] goes backwards at sample 1",
    ),
}


@pytest.mark.parametrize("fault", NPZ_FAULTS)
def test_faults_of_archives(fault, tmp_path):
    arrays, error, message = NPZ_FAULTS[fault]
    np.savez(tmp_path / "drive.npz", **arrays)
    with pytest.raises(error, match=message):
        read_log(tmp_path / "drive.npz")


def test_files_that_are_no_logs(tmp_path):
    (tmp_path / "drive.npz").write_bytes(b"not an archive")
    (tmp_path / "drive.csv").write_bytes(b"t,a\n0,\xff\xfe\n")
    with pytest.raises(FileFormatError, match=r"not an archive of numeric arrays as numpy\.savez writes it"):
        read_log(tmp_path / "drive.npz")
    with pytest.raises(FileFormatError, match=r"not text in UTF-8 \(byte 6\); save it as UTF-8"):
        read_log(tmp_path / "drive.csv")
    with pytest.raises(DataError, match=r"there is no file .*dirve\.csv; did you mean .*drive\.csv\?"):
        read_log(tmp_path / "dirve.csv")
    with pytest.raises(DataError, match=r"there is no file .*; check the name and the folder"):
        read_log(tmp_path / "elsewhere" / "log.csv")
