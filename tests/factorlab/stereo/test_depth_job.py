"""The job of depth from two pictures on rigs and truths that the command's tests leave out."""

from dataclasses import replace

import numpy as np
import pytest

from factorlab.stereo.depth_document import depth_document
from factorlab.stereo.depth_files import depth_files
from factorlab.stereo.depth_job import DepthSettings, measure_depth
from factorlab.stereo.depth_numbers import accuracy_of
from factorlab.stereo.depth_pairs import StereoPair, rendered_pair
from vision3d.camera import Camera
from vision3d.render import render_stereo, repeated_wall
from vision3d.stereo import StereoRig, StereoSettings

SETTINGS = DepthSettings(StereoSettings())


@pytest.fixture(scope="module")
def pair():
    return rendered_pair(np.random.default_rng(6), (320, 240))


@pytest.fixture(scope="module")
def run(pair):
    return measure_depth(pair, SETTINGS)


def test_cameras_above_each_other_see_the_same_depth(pair, run):
    fx, fy, cx, cy = pair.rig.left.intrinsics
    camera = Camera("pinhole", (fy, fx, cy, cx), (), (240, 320))
    above = StereoRig(camera, camera, np.array([1.0, 0, 0, 0, 0, -0.1, 0]))
    turned = replace(
        pair, left=np.ascontiguousarray(pair.left.swapaxes(0, 1)),
        right=np.ascontiguousarray(pair.right.swapaxes(0, 1)), rig=above, truth_px=None,
    )  # fmt: skip
    found = measure_depth(turned, SETTINGS)
    assert found.geometry.vertical
    assert found.depth.z_m.shape == (320, 240)
    both = found.depth.measured.T & run.depth.measured
    assert both.mean() > 0.7
    ratio = found.depth.z_m.T[both] / run.depth.z_m[both]
    assert np.median(np.abs(ratio - 1.0)) < 0.01


def test_far_points_can_be_left_out(pair, run):
    near = measure_depth(pair, replace(SETTINGS, most_m=1.3, ground=False))
    assert near.cloud.points[:, 2].max() <= 1.3 < run.cloud.points[:, 2].max()
    assert near.ground is None
    assert near.planes == ()


def test_a_truth_in_whole_pixels_is_taken_as_rounded(run):
    exact = accuracy_of(run)
    rounded = accuracy_of(replace(run, pair=replace(run.pair, truth_px=np.rint(run.pair.truth_px))))
    assert 0.7 < exact.z_spread < 1.4
    assert rounded.z_spread < 2.5  # ten and more, were the rounding not known
    assert rounded.median_px > 2.0 * exact.median_px


def test_a_map_that_was_rectified_here_is_not_held_to_the_truth(pair, run):
    bent = Camera("brown5", pair.rig.left.intrinsics, (-0.1, 0.01, 0, 0, 0), (320, 240))
    moved = replace(pair, rig=StereoRig(bent, bent, pair.rig.right_T_left))
    found = measure_depth(moved, SETTINGS)
    assert accuracy_of(found) is None
    assert "Against the truth" not in {one.heading for one in depth_document(found).sections}


def test_a_repeated_texture_is_named(run):
    rng = np.random.default_rng(3)
    camera = Camera("pinhole", (300.0, 300.0, 159.5, 119.5), (), (320, 240))
    apart = np.array([1.0, 0, 0, 0, -0.12, 0, 0])
    view = render_stereo(camera, camera, apart, repeated_wall(rng), rng=rng, colour=True)
    tiles = StereoPair("left", "right", view.left.image, view.right.image, StereoRig(camera, camera, apart))
    found = measure_depth(tiles, SETTINGS)
    told = {one.metric: one for one in depth_document(found).verdicts}
    assert told["repeated texture"].verdict == "WARN"
    assert "one period off" in told["repeated texture"].meaning
    assert "repeated texture" not in {one.metric for one in depth_document(run).verdicts}


def test_files_without_points(pair):
    flat = [np.full((240, 320, 3), level, np.uint8) for level in (90, 100)]
    found = measure_depth(replace(pair, left=flat[0], right=flat[1], truth_px=None), SETTINGS)
    assert found.disparity.density == 0.0
    names = set(depth_files(found))
    assert {"disparity.npz", "mask.png", "depth.npz"} <= names
    assert "cloud.ply" not in names
    document = depth_document(found)
    assert document.failed
    assert [one.heading for one in document.sections] == ["The pair"]
