"""Tables with faults: each is mended and told, or refused with a sentence that names the place."""

import numpy as np
import pytest
from imu_tables import rows, written

from sequential.errors import DataError, FileFormatError, MissingStreamError
from sequential.readers import read_imu
from sequential.sensors import ImuRecording, simulate_imu, tumble


@pytest.fixture
def moving(rng):
    return simulate_imu(tumble(20.0, rng, rest=3.0), rng, rate=50.0).recording


# --- broken files ---


def test_an_axis_is_missing(tmp_path):
    path = written(tmp_path / "x.csv", "t,ax,az,gx,gy,gz\n0,1,2,3,4,5\n")
    with pytest.raises(FileFormatError, match=r"the accel has ax, az but no ay; .* columns ay=NAME"):
        read_imu(path)


def test_text_among_numbers(tmp_path, moving):
    lines = rows(moving)
    lines[7] = lines[7].replace(lines[7].split(",")[2], "oops")
    path = written(tmp_path / "x.csv", "\n".join(["t,ax,ay,az,gx,gy,gz", *lines]))
    with pytest.raises(FileFormatError, match=r"line 9, column 'ay': 'oops' is not a number"):
        read_imu(path)


def test_empty_cells_are_left_out_and_told(tmp_path, moving):
    lines = rows(moving)
    lines[7] = lines[7].rsplit(",", 1)[0] + ","
    lines[9] = lines[9].rsplit(",", 3)[0] + ",nan,nan,nan"
    lines[11] = lines[11].rsplit(",", 2)[0]
    imu = read_imu(written(tmp_path / "x.csv", "\n".join(["t,ax,ay,az,gx,gy,gz", *lines])))
    assert len(imu) == len(moving) - 3
    assert any(
        "3 of 1001 rows hold no number somewhere" in f.what and f.severity == "warn" for f in imu.findings
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("\n\n,,,\n", "is empty"),
        ("t,ax,ay,az\n", "has a header and no sample"),
        ("t,ax,ay,az\nx,,,\ny,,,\n", "neither a number nor a date"),
    ],
)
def test_files_with_nothing_in_them(tmp_path, text, words):
    with pytest.raises(FileFormatError, match=words):
        read_imu(written(tmp_path / "x.csv", text))


def test_no_complete_row(tmp_path):
    with pytest.raises(MissingStreamError, match="no complete sample"):
        read_imu(written(tmp_path / "x.csv", "t,ax,ay,az,gx,gy,gz\n0,1,2,3,,,\n1,,,,1,2,3\n"))


def test_stamps_beyond_reason(tmp_path):
    text = "t [s],ax,ay,az\n0,0,0,9.8\n1e300,0,0,9.8\n"
    with pytest.raises(FileFormatError, match=r"the stamp '1e300' of sample 1 in s is over 292 years"):
        read_imu(written(tmp_path / "x.csv", text))


def test_binary_files_are_told(tmp_path):
    path = tmp_path / "x.csv"
    path.write_bytes(b"\x00\x01\x02binary")
    with pytest.raises(FileFormatError, match="is a binary file"):
        read_imu(path)


def test_wrong_options(tmp_path, moving):
    path = written(tmp_path / "x.csv", "\n".join(["t,ax,ay,az,gx,gy,gz", *rows(moving)]))
    with pytest.raises(DataError, match="did you mean 'mpu6050'"):
        read_imu(path, kind="mpu6500")
    with pytest.raises(DataError, match="positive number of Hz"):
        read_imu(path, rate=-1.0)
    with pytest.raises(DataError, match="did you mean"):
        read_imu(tmp_path / "y.csv")


def test_gravity_was_taken_away(tmp_path, moving):
    lines = rows(ImuRecording(moving.t, moving.accel - moving.accel[0], moving.gyro))
    still = "\n".join(
        ["t [s],ax [m/s^2],ay [m/s^2],az [m/s^2],gx [rad/s],gy [rad/s],gz [rad/s]", *lines[:150]]
    )
    with pytest.raises(FileFormatError, match="gravity was taken away"):
        read_imu(written(tmp_path / "x.csv", still))


# --- time out of order ---


def test_unsorted_lines_are_sorted_and_told(tmp_path, moving, rng):
    lines = rows(moving)
    for k in (50, 300, 700):
        lines[k], lines[k + 1] = lines[k + 1], lines[k]
    imu = read_imu(written(tmp_path / "x.csv", "\n".join(["t,ax,ay,az,gx,gy,gz", *lines])))
    np.testing.assert_allclose(imu.accel, moving.accel, atol=1e-6)
    assert any("3 stamps go backwards" in f.what for f in imu.findings)


def test_two_recordings_in_one_file(tmp_path, moving):
    lines = [*rows(moving)[:400], *rows(moving)[:300]]
    with pytest.raises(FileFormatError, match=r"2 recordings one after another: .* again at sample 400"):
        read_imu(written(tmp_path / "x.csv", "\n".join(["t,ax,ay,az,gx,gy,gz", *lines])))


def test_lines_that_stand_twice(tmp_path, moving):
    lines = rows(moving)
    lines.insert(5, lines[5])
    imu = read_imu(written(tmp_path / "x.csv", "\n".join(["t,ax,ay,az,gx,gy,gz", *lines])))
    assert len(imu) == len(moving)
    assert any("1 line stands twice" in f.what for f in imu.findings)


def test_a_coarse_clock_is_spread(tmp_path, moving):
    lines = rows(moving, stamp=lambda s: f"{np.floor(s * 10) / 10:.1f}")
    imu = read_imu(written(tmp_path / "x.csv", "\n".join(["t,ax,ay,az,gx,gy,gz", *lines])))
    assert len(imu) == len(moving)
    assert imu.rate == pytest.approx(50.0)
    assert np.abs(imu.seconds - moving.seconds).max() < 0.1
    assert any("the clock is coarse: 80%" in f.what for f in imu.findings)


def test_a_few_repeated_stamps_lose_their_samples(tmp_path, moving):
    lines = rows(moving)
    first = lines[500].split(",", 1)[0]
    lines[501] = first + "," + lines[501].split(",", 1)[1]
    imu = read_imu(written(tmp_path / "x.csv", "\n".join(["t,ax,ay,az,gx,gy,gz", *lines])))
    assert len(imu) == len(moving) - 1
    assert any("1 stamps repeat" in f.what and f.severity == "warn" for f in imu.findings)
