"""Stamps of frames from names and tables, corners counted from one end, and files of mountings."""

import json

import numpy as np
import pytest
import yaml

from factorlab.cam_imu.files import read_mounting
from factorlab.cam_imu.numbering import numbered_alike
from factorlab.cam_imu.stamped import open_stamped, read_stamps
from sequential.errors import DataError, FileFormatError
from sequential.manifold.quaternion import quaternion_exp
from vision3d.boards import Checkerboard
from vision3d.inertial.simulated import CAMERA
from vision3d.render import board_pixels
from vision3d.views import View


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("#timestamp [ns],filename\n1403636579763555584,a.png\n1403636579813555456,b.png\n",
         [1403636579763555584, 1403636579813555456]),
        ("frame,t_s,captured_unix_ns\n0,0.0,1700000000000000001\n1,0.1,1700000000100000001\n",
         [1700000000000000001, 1700000000100000001]),
        ("1403636579.763555584\n1403636579.813555456\n", [1403636579763555584, 1403636579813555456]),
        ("t [ms]\n0\n66.5\n", [0, 66_500_000]),
    ],
    ids=["euroc", "live", "seconds", "milliseconds"],
)  # fmt: skip
def test_tables_of_stamps(tmp_path, text, expected):
    path = tmp_path / "stamps.csv"
    path.write_text(text)
    np.testing.assert_array_equal(read_stamps(path), expected)


def test_stamps_that_go_back_are_refused(tmp_path):
    path = tmp_path / "stamps.csv"
    path.write_text("t [s]\n0.0\n0.2\n0.1\n")
    with pytest.raises(FileFormatError, match="frame 2 is not after"):
        read_stamps(path)


def test_a_table_of_another_recording_is_refused(on_disk, tmp_path):
    path = tmp_path / "stamps.csv"
    path.write_text("t [s]\n0.0\n0.1\n0.2\n")
    with pytest.raises(DataError, match=r"3 stamps and .* frames"):
        open_stamped(on_disk.folder / "film" / "video.avi", path)


def test_names_of_images_are_a_clock(on_disk):
    frames = open_stamped(on_disk.folder / "frames")
    assert frames.absolute
    stamps = [t for _, t, _ in frames.each()]
    np.testing.assert_array_equal(stamps, on_disk.demo.stamps_ns)
    thinned = [t for _, t, _ in open_stamped(on_disk.folder / "frames").each(most_hz=5.0)]
    assert len(thinned) == -(-len(stamps) // 2)


def test_a_rate_that_is_given_counts(on_disk):
    frames = open_stamped(on_disk.folder / "frames", fps=4.0)
    assert not frames.absolute
    assert [t for _, t, _ in frames.each()][:3] == [0, 250_000_000, 500_000_000]


def test_a_board_that_looks_the_same_upside_down_is_counted_from_one_end():
    board = Checkerboard(8, 6, 0.03)
    assert board.half_turn is not None
    views = []
    for k in range(6):
        pose = np.concatenate([quaternion_exp(np.array([0.1 * k, 0.05, 0.02 * k])), [-0.1, -0.07, 0.6]])
        pixels = board_pixels(CAMERA, board, pose)
        ids = np.arange(board.count) if k % 3 else board.half_turn
        views.append(View(f"{k}", CAMERA.size, board.points[ids], pixels, ids, np.full(len(ids), 0.1)))
    found = numbered_alike(CAMERA, board, tuple(views))
    assert len(found) == 6
    for view in found[1:]:
        np.testing.assert_array_equal(view.ids, found[0].ids)
        np.testing.assert_array_equal(view.points, board.points[view.ids])


def test_a_chain_without_an_imu_is_refused(tmp_path):
    path = tmp_path / "camchain.yaml"
    path.write_text(yaml.safe_dump({"cam0": {"camera_model": "pinhole"}}))
    with pytest.raises(FileFormatError, match="T_cam_imu"):
        read_mounting(path)
    other = tmp_path / "calibration.json"
    other.write_text(json.dumps({"camera": {}}))
    with pytest.raises(FileFormatError, match="is no calibration of a camera and an IMU"):
        read_mounting(other)
