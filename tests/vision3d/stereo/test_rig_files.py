"""Rigs come back from every format, and what cannot be read is refused in a sentence."""

import json

import cv2
import numpy as np
import pytest
from rig_worlds import EVERY_RIG, FISHEYES, SIDE_BY_SIDE, VERTICAL, rig_of

from sequential.errors import DataError, FileFormatError, ModelError, NotFiniteError, ShapeError
from sequential.manifold import SE3
from vision3d.camera import Camera
from vision3d.stereo import StereoRig, read_rig, rectify, write_rig
from vision3d.stereo.rig_files import rig_texts

BROWN4 = rig_of(
    left=Camera("brown4", (533.0, 531.0, 342.0, 234.0), (-0.28, 0.02, 0.0012, -0.0006), (640, 480)),
    right=Camera("brown4", (536.0, 535.0, 327.0, 250.0), (-0.29, 0.06, 0.0009, -0.0003), (640, 480)),
)


def same(a, b, tolerance=1e-12):
    assert a.left == b.left
    assert a.right == b.right
    np.testing.assert_allclose(SE3().local(a.right_T_left, b.right_T_left), 0.0, atol=tolerance)


@pytest.mark.parametrize("rig", [*EVERY_RIG.values(), BROWN4], ids=[*EVERY_RIG, "brown4"])
def test_every_format_that_says_a_rig_gives_it_back(rig, tmp_path):
    texts = rig_texts(rig)
    assert {"rig.json", "stereo_opencv.yml", "left.yaml", "right.yaml"} <= texts.keys()
    assert ("camchain.yaml" in texts) == (rig.left.lens in {"brown4", "fisheye4"})
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    for name in texts:
        if rig is VERTICAL and name in {"left.yaml", "right.yaml"}:
            continue
        same(read_rig(tmp_path / name), rig, 1e-9)
    same(read_rig(tmp_path), rig)


def test_ros_keeps_a_vertical_rig(tmp_path):
    for name, text in rig_texts(VERTICAL).items():
        (tmp_path / name).write_text(text)
    same(read_rig(tmp_path / "right.yaml"), VERTICAL, 1e-9)


def test_json_keeps_the_covariance(tmp_path, rng):
    A = rng.standard_normal((24, 24))
    rig = StereoRig(SIDE_BY_SIDE.left, SIDE_BY_SIDE.right, SIDE_BY_SIDE.right_T_left, A @ A.T)
    found = read_rig(write_rig(tmp_path / "rig.json", rig))
    np.testing.assert_array_equal(found.joint_cov, rig.joint_cov)
    np.testing.assert_array_equal(found.cov, rig.cov)
    # beside other things of a report too
    (tmp_path / "report.json").write_text(
        json.dumps({"rig": json.loads((tmp_path / "rig.json").read_text())})
    )
    same(read_rig(tmp_path / "report.json"), rig)


def test_opencvs_own_files_are_read(tmp_path):
    """As the sample program stereo_calib writes them: in two files, without the size, here in millimetres."""
    rig = SIDE_BY_SIDE
    storage = cv2.FileStorage(str(tmp_path / "intrinsics.yml"), cv2.FILE_STORAGE_WRITE)
    for k, camera in ((1, rig.left), (2, rig.right)):
        storage.write(f"M{k}", camera.matrix.copy())
        storage.write(f"D{k}", camera.distortion[None].copy())
    storage.release()
    storage = cv2.FileStorage(str(tmp_path / "extrinsics.yml"), cv2.FILE_STORAGE_WRITE)
    storage.write("R", rig.R.copy())
    storage.write("T", 1e3 * rig.T.reshape(3, 1))
    storage.release()
    for name in ("intrinsics.yml", "extrinsics.yml"):
        same(read_rig(tmp_path / name, size=(640, 480), unit_m=1e-3), rig, 1e-9)
    with pytest.raises(FileFormatError, match="does not say how large its images are"):
        read_rig(tmp_path / "extrinsics.yml")
    (tmp_path / "intrinsics.yml").unlink()
    with pytest.raises(FileFormatError, match=r"is its intrinsics.yml beside it"):
        read_rig(tmp_path / "extrinsics.yml", size=(640, 480))


def test_opencv_reads_ours(tmp_path):
    storage = cv2.FileStorage(str(write_rig(tmp_path / "rig.yml", SIDE_BY_SIDE)), cv2.FILE_STORAGE_READ)
    np.testing.assert_array_equal(storage.getNode("M2").mat(), SIDE_BY_SIDE.right.matrix)
    np.testing.assert_array_equal(storage.getNode("T").mat()[:, 0], SIDE_BY_SIDE.T)
    np.testing.assert_array_equal(storage.getNode("Q").mat(), rectify(SIDE_BY_SIDE).Q)


def test_middlebury(tmp_path):
    text = (
        "cam0=[994.978 0 311.193; 0 994.978 254.877; 0 0 1]\n"
        "cam1=[994.978 0 342.279; 0 994.978 254.877; 0 0 1]\n"
        "doffs=31.086\nbaseline=193.001\nwidth=741\nheight=497\nndisp=70\nisint=0\n"
    )
    (tmp_path / "calib.txt").write_text(text)
    rig = read_rig(tmp_path)
    assert rig.left.size == (741, 497)
    assert abs(rig.baseline_m - 0.193001) < 1e-12
    assert not rig.is_swapped
    pair = rectify(rig, alpha=None, zero_disparity=False)
    np.testing.assert_allclose(pair.left_R_rectified, np.eye(3), atol=1e-12)
    assert abs(pair.doffs_px - 31.086) < 1e-9
    same(read_rig(write_rig(tmp_path / "again.txt", rig)), rig)
    (tmp_path / "calib.txt").write_text(text.replace("doffs=31.086", "doffs=13"))
    with pytest.raises(FileFormatError, match="doffs = 13 px, but the principal points"):
        read_rig(tmp_path / "calib.txt")
    with pytest.raises(ModelError, match="rectify the rig first"):
        write_rig(tmp_path / "other.txt", SIDE_BY_SIDE)
    rectified = rectify(SIDE_BY_SIDE, zero_disparity=False).rig_rectified
    same(read_rig(write_rig(tmp_path / "ours.txt", rectified)), rectified)


@pytest.mark.parametrize(
    ("name", "text", "sentence"),
    [
        ("rig.json", "", "is empty"),
        ("rig.json", '{"format": "factorlab stereo rig"', "is damaged: line 1 is no JSON"),
        ("rig.json", '{"format": "factorlab stereo rig", "left": 3}', "left of a rig is a camera; got 3"),
        ("rig.yaml", "a: 1\nb: 2\n", "is no stereo rig of factorlab.*it holds a, b"),
        ("rig.yaml", "a: [1\nb: 2\n", "is no file of a stereo rig, or damaged"),
        ("rig.yml", "%YAML:1.0\n---\nR: 3\n", "holds no two cameras"),
        ("calib.txt", "cam0=[1 0 2; 0 1 3; 0 0 1]\n", "has no baseline"),
        ("calib.txt", "cam0=[1 0 2; 0 1]\nbaseline=3\n", "expected 9 numbers for cam0, got 5"),
    ],
)
def test_damaged_files_are_refused(name, text, sentence, tmp_path):
    (tmp_path / name).write_text(text)
    with pytest.raises(FileFormatError, match=sentence):
        read_rig(tmp_path / name)


def test_what_is_missing_is_said(tmp_path):
    with pytest.raises(DataError, match="there is no file"):
        read_rig(tmp_path / "nothing.json")
    with pytest.raises(DataError, match=r"holds none of rig\.json"):
        read_rig(tmp_path)
    texts = rig_texts(SIDE_BY_SIDE)
    (tmp_path / "left.yaml").write_text(texts["left.yaml"])
    with pytest.raises(DataError, match=r"right\.yaml, is not beside it"):
        read_rig(tmp_path / "left.yaml")
    (tmp_path / "right.yaml").write_text(texts["left.yaml"])
    with pytest.raises(FileFormatError, match="calibrated apart"):
        read_rig(tmp_path / "left.yaml")
    (tmp_path / "binary").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(FileFormatError, match="is no text"):
        read_rig(tmp_path / "binary")
    (tmp_path / "camchain.yaml").write_text(
        rig_texts(BROWN4)["camchain.yaml"].replace("T_cn_cnm1", "T_other")
    )
    with pytest.raises(FileFormatError, match="cam1 has no T_cn_cnm1"):
        read_rig(tmp_path / "camchain.yaml")
    with pytest.raises(ModelError, match="does not tell its format"):
        write_rig(tmp_path / "rig.xyz", BROWN4)


def test_a_rig_that_is_none_is_refused():
    with pytest.raises(ModelError, match="stand apart"):
        rig_of(translation=(0.0, 0.0, 0.0))
    with pytest.raises(ShapeError, match="right_T_left is"):
        StereoRig(SIDE_BY_SIDE.left, SIDE_BY_SIDE.right, np.zeros(6))
    with pytest.raises(NotFiniteError, match="seven finite numbers"):
        StereoRig(SIDE_BY_SIDE.left, SIDE_BY_SIDE.right, np.full(7, np.nan))
    with pytest.raises(ShapeError, match=r"\(6, 6\) of its pose, or \(24, 24\)"):
        StereoRig(SIDE_BY_SIDE.left, SIDE_BY_SIDE.right, SIDE_BY_SIDE.right_T_left, np.eye(7))


def test_exchanging_twice_changes_nothing(rng):
    A = rng.standard_normal((24, 24))
    rig = StereoRig(SIDE_BY_SIDE.left, SIDE_BY_SIDE.right, SIDE_BY_SIDE.right_T_left, A @ A.T)
    once = rig.swapped()
    assert once.is_swapped
    assert abs(once.baseline_m - rig.baseline_m) < 1e-12
    assert abs(once.baseline_std_m - rig.baseline_std_m) < 1e-9
    same(once.swapped(), rig)
    np.testing.assert_allclose(once.swapped().joint_cov, rig.joint_cov, atol=1e-9)


def test_scaled_images_have_a_scaled_rig(rng):
    from rig_worlds import seen_by_both

    points, left, right = seen_by_both(FISHEYES, rng, 50)
    half = FISHEYES.resized((320, 240))
    for moved, pixels in zip(half.project(points), (left, right), strict=True):
        np.testing.assert_allclose(moved, (pixels + 0.5) / 2.0 - 0.5, atol=1e-9)
