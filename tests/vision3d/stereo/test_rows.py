"""Whether a pair is rectified, in what light, and what its calibration says of it."""

import cv2
import numpy as np
import pytest
from stereo_worlds import room

from sequential.errors import DataError, ModelError
from vision3d.camera import Camera
from vision3d.stereo import StereoRig
from vision3d.stereo.geometry import geometry_of, is_rectified
from vision3d.stereo.pair import levelled, light_of
from vision3d.stereo.rows import row_check

CAMERA = Camera("pinhole", (300.0, 300.0, 159.5, 119.5), (), (320, 240))
APART = np.array([1.0, 0.0, 0.0, 0.0, -0.1, 0.0, 0.0])


@pytest.fixture(scope="module")
def world():
    return room(np.random.default_rng(3))


def test_rows_of_a_rectified_pair_agree(world):
    rows = row_check(world.left, world.right)
    assert rows.known
    assert rows.rectified
    assert rows.rms_px < 0.1
    assert rows.count > 0.6 * rows.tried
    assert (rows.shifts_px > 0).mean() > 0.9


@pytest.mark.parametrize("offset", [-6.5, 2.25, 14.0])
def test_an_offset_is_measured(world, offset):
    moved = cv2.warpAffine(world.right, np.array([[1.0, 0, 0], [0, 1, offset]]), (320, 240))
    rows = row_check(world.left, moved)
    assert rows.mean_px == pytest.approx(offset, abs=0.15)
    assert not rows.rectified
    assert f"{rows.mean_px:+.2f} px on the whole" in rows.words


def test_a_turn_is_measured(world):
    turn = cv2.getRotationMatrix2D((159.5, 119.5), -2.0, 1.0)
    rows = row_check(world.left, cv2.warpAffine(world.right, turn, (320, 240)))
    assert rows.slopes[0] == pytest.approx(320 * np.sin(np.radians(2.0)), abs=1.5)
    assert not rows.rectified
    assert "across" in rows.words


def test_too_little_to_tell():
    rows = row_check(np.zeros((60, 80), np.uint8), np.full((60, 80), 9, np.uint8))
    assert not rows.known
    assert rows.rectified
    assert "too few" in rows.words


def test_real_pairs(data_dir):
    folder = data_dir / "vision"
    left, right = (cv2.imread(str(folder / f"motorcycle/motorcycle_{s}.png")) for s in ("left", "right"))
    assert row_check(left, right).rms_px < 0.2
    left, right = (cv2.imread(str(folder / f"opencv/{s}01.jpg")) for s in ("left", "right"))
    rows = row_check(left, right)
    assert not rows.rectified
    assert rows.mean_px == pytest.approx(11.2, abs=0.5)


def test_light_is_measured_and_taken_out(world):
    left, right = (one[..., None] for one in (world.left, world.right))
    assert not light_of(left, right).differs
    assert levelled(left, right) is right
    dim = np.rint(0.7 * right + 10.0).astype(np.uint8)
    light = light_of(left, dim)
    assert light.differs
    assert light.gain[0] == pytest.approx(1 / 0.7, rel=0.05)
    assert np.abs(levelled(left, dim).astype(float) - right).mean() < 4.0


def test_a_rectified_rig_is_known_as_one():
    other = Camera("pinhole", (300.0, 300.0, 190.5, 119.5), (), (320, 240))
    rig = StereoRig(CAMERA, other, APART)
    assert is_rectified(rig)
    geometry = geometry_of(rig, (320, 240))
    assert geometry.rectification is None
    assert geometry.doffs_px == pytest.approx(31.0)
    half = geometry_of(rig, (160, 120))
    assert half.focal_px == pytest.approx(150.0)
    assert half.doffs_px == pytest.approx(15.5)
    turned = StereoRig(CAMERA, other, APART + 1e-3 * np.eye(7)[2])
    assert not is_rectified(turned)
    assert geometry_of(turned, (320, 240)).rectification is not None
    assert geometry_of(turned, (320, 240), rectified=True).rectification is None


def test_pictures_that_were_cut():
    with pytest.raises(DataError, match="another shape"):
        geometry_of(StereoRig(CAMERA, CAMERA, APART), (320, 200))


def test_cameras_in_the_wrong_order():
    with pytest.raises(ModelError, match="exchange"):
        geometry_of(StereoRig(CAMERA, CAMERA, -APART), (320, 240))


def test_cameras_above_each_other():
    rig = StereoRig(CAMERA, CAMERA, np.array([1.0, 0, 0, 0, 0, -0.1, 0]))
    geometry = geometry_of(rig, (320, 240))
    assert geometry.vertical
    assert geometry.baseline_m == pytest.approx(0.1)
