"""TUM trajectories: exact round trips, evo reads what we write, bad lines are named."""

import numpy as np
import pytest
from evo.tools import file_interface
from hypothesis import given
from hypothesis import strategies as st

from sequential.errors import DataError, FileFormatError, NotFiniteError, TimeOrderError
from sequential.evaluate import Trajectory
from sequential.readers import read_tum, write_tum

FINITE = st.floats(-1e6, 1e6)


@given(
    st.lists(st.integers(0, 2 * 10**18), min_size=1, max_size=8),
    st.lists(FINITE, min_size=3, max_size=3),
    st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1),
)
def test_a_round_trip_keeps_every_digit(tmp_path_factory, t, position, quaternion):
    path = tmp_path_factory.mktemp("tum") / "poses.txt"
    count = len(t)
    written = Trajectory(np.sort(t), np.tile(position, (count, 1)), np.tile(quaternion, (count, 1)))
    write_tum(path, written)
    read = read_tum(path)
    assert np.array_equal(read.t, written.t)
    assert np.array_equal(read.position, written.position)
    np.testing.assert_allclose(read.quaternion, written.quaternion, rtol=0, atol=3e-16)


def test_evo_reads_the_same_numbers(tmp_path, rng):
    t = 1_403_715_529_112_143_517 + np.arange(50) * 5_000_000
    poses = Trajectory(t, rng.standard_normal((50, 3)), rng.standard_normal((50, 4)))
    write_tum(tmp_path / "poses.txt", poses)
    theirs = file_interface.read_tum_trajectory_file(tmp_path / "poses.txt")
    assert np.array_equal(theirs.positions_xyz, poses.position)
    np.testing.assert_allclose(theirs.orientations_quat_wxyz, poses.quaternion, rtol=0, atol=1e-15)
    np.testing.assert_allclose(theirs.timestamps, t / 1e9, rtol=0, atol=2.4e-7)


@pytest.mark.parametrize("name", ["fr2_desk_groundtruth", "fr2_desk_ORB", "MH_01_easy", "V102"])
def test_recordings_read_as_evo_reads_them(name, data_dir):
    path = data_dir / "trajectory" / f"{name}.txt"
    ours, theirs = read_tum(path), file_interface.read_tum_trajectory_file(path)
    assert np.array_equal(ours.position, theirs.positions_xyz)
    np.testing.assert_allclose(ours.t * 1e-9, theirs.timestamps, rtol=0, atol=5e-7)
    unit = theirs.orientations_quat_wxyz / np.linalg.norm(
        theirs.orientations_quat_wxyz, axis=1, keepdims=True
    )
    np.testing.assert_allclose(np.abs(np.sum(unit * ours.quaternion, axis=1)), 1.0, atol=1e-12)


def test_positions_alone_are_written_with_the_identity(tmp_path):
    write_tum(tmp_path / "p.txt", Trajectory([1.5], [[1.0, 2.0]]))
    assert (tmp_path / "p.txt").read_text().splitlines() == [
        "# t x y z qx qy qz qw",
        "1.500000000 1.0 2.0 0.0 0.0 0.0 0.0 1.0",
    ]


GOOD = "# truth\n0.0 0 0 0 0 0 0 1\n"


@pytest.mark.parametrize(
    ("line", "error", "message"),
    [
        (
            "1.0 0 0 0 0 0 0",
            FileFormatError,
            r"line 3: a TUM line is 't x y z qx qy qz qw', 8 numbers.*has 7",
        ),
        ("1.0,0,0,0,0,0,0,1", FileFormatError, "line 3: .*separated by blanks; this one has 1"),
        ("1.0 0 zero 0 0 0 0 1", FileFormatError, "line 3: y is 'zero', which is not a number"),
        ("1.0 0 0 nan 0 0 0 1", NotFiniteError, "line 3: z is nan; drop poses"),
        ("1.0 0 0 0 0 0 0 0", FileFormatError, "line 3: the quaternion is zero"),
        ("1:00 0 0 0 0 0 0 1", FileFormatError, "line 3: '1:00' is not a number of seconds"),
        ("-1.0 0 0 0 0 0 0 1", TimeOrderError, r"line 3: the stamp -1\.0 comes before .* sort the lines"),
    ],
)
def test_bad_lines_are_named(line, error, message, tmp_path):
    path = tmp_path / "truth.txt"
    path.write_text(GOOD + line + "\n")
    with pytest.raises(error, match=message) as caught:
        read_tum(path)
    assert str(path) in str(caught.value)


def test_missing_and_empty_files_are_named(tmp_path):
    (tmp_path / "truth.txt").write_text("# nothing\n")
    with pytest.raises(DataError, match=r"there is no file .*trth\.txt; did you mean .*truth\.txt\?"):
        read_tum(tmp_path / "trth.txt")
    with pytest.raises(FileFormatError, match=r"truth\.txt holds no pose"):
        read_tum(tmp_path / "truth.txt")
    with pytest.raises(DataError, match="is a folder"):
        read_tum(tmp_path)
