"""Disparity against rendered truth, against OpenCV's matchers, and on pictures that are no pair."""

import cv2
import numpy as np
import pytest
from stereo_worlds import room

from sequential.errors import DataError, ModelError, ShapeError
from vision3d.stereo.disparity import MATCHERS, StereoSettings, compute_disparity


@pytest.fixture(scope="module")
def world():
    return room(np.random.default_rng(3))


@pytest.fixture(scope="module")
def found(world):
    return compute_disparity(world.left, world.right)


def errors(found, world):
    return found.map_px - world.disparity


def test_the_range_is_found(found, world):
    least, most = found.range_px
    assert least <= np.nanmin(world.disparity)
    assert np.nanmax(world.disparity) <= most <= 2 * np.nanmax(world.disparity)


def test_disparity_is_right_everywhere(found, world):
    known = np.isfinite(world.disparity)
    error = np.abs(errors(found, world))
    assert found.density > 0.85
    assert (error[known] > 2.0).mean() < 0.03
    assert (error[known & found.valid] > 1.0).mean() < 0.03
    assert np.median(error[known & found.valid]) < 0.12


def test_what_one_camera_alone_sees_is_told(found, world):
    told = found.occluded & world.occluded
    assert told.sum() > 0.4 * world.occluded.sum()
    assert told.sum() > 0.4 * found.occluded.sum()
    assert not (found.valid & found.occluded).any()


@pytest.mark.parametrize("matcher", MATCHERS)
def test_every_matcher_gives_the_same_kind_of_answer(world, matcher):
    found = compute_disparity(world.left, world.right, StereoSettings(matcher, 0, 31))
    error = np.abs(errors(found, world))[np.isfinite(world.disparity)]
    assert np.isfinite(found.map_px).all()
    assert (error > 2.0).mean() < (0.03 if matcher == "semi-global" else 0.15)
    assert found.matcher == matcher
    for array in (found.map_px, found.std_px, found.valid, found.occluded, found.confidence):
        assert array.shape == world.left.shape
        assert not array.flags.writeable


def test_ours_is_better_than_opencvs(world, found):
    ours = (np.abs(errors(found, world)) > 1.0).mean()
    for matcher in MATCHERS[1:]:
        theirs = compute_disparity(world.left, world.right, StereoSettings(matcher, *found.range_px))
        assert ours < (np.abs(errors(theirs, world)) > 1.0).mean()


def test_four_paths_are_enough_to_be_near(world):
    four = compute_disparity(world.left, world.right, StereoSettings(paths=4))
    assert np.nanmedian(np.abs(errors(four, world))) < 0.15


def test_without_filling_unmatched_pixels_are_nan(world, found):
    bare = compute_disparity(world.left, world.right, StereoSettings(fill=False))
    np.testing.assert_array_equal(np.isfinite(bare.map_px), bare.valid)
    np.testing.assert_array_equal(bare.matched_px, found.matched_px)


def test_a_shift_of_the_right_picture_shifts_disparity(world, found):
    moved = np.roll(world.right, 7, axis=1)
    moved[:, :7] = world.right[:, :1]
    again = compute_disparity(world.left, moved)
    both = found.valid & again.valid
    inside = np.indices(both.shape)[1] > 40
    difference = (found.map_px - again.map_px)[both & inside]
    assert np.median(np.abs(difference - 7.0)) < 0.02
    assert again.range_px[0] < -3


def test_light_may_differ_between_the_pictures(world):
    dim = np.clip(0.7 * world.right.astype(float) + 12.0, 0, 255).astype(np.uint8)
    found = compute_disparity(world.left, dim)
    error = np.abs(errors(found, world))[np.isfinite(world.disparity)]
    assert (error > 2.0).mean() < 0.04


def test_colour_does_as_well_as_grey(world):
    wide = [cv2.cvtColor(one, cv2.COLOR_GRAY2BGR) for one in (world.left, world.right)]
    colour, grey = compute_disparity(*wide), compute_disparity(world.left, world.right)
    np.testing.assert_allclose(colour.map_px, grey.map_px, atol=0.02)
    mixed = compute_disparity(wide[0], world.right)
    np.testing.assert_allclose(mixed.map_px, grey.map_px, atol=0.02)


def test_strips_give_what_the_whole_gives(world, found, monkeypatch):
    monkeypatch.setattr("vision3d.stereo.semi_global.MOST_CELLS", 1)
    strips = compute_disparity(world.left, world.right, StereoSettings("semi-global", *found.range_px))
    assert (np.abs(strips.map_px - found.map_px) > 0.5).mean() < 0.005


def test_pictures_without_texture_match_nowhere():
    rng = np.random.default_rng(0)
    flat = [np.full((60, 80), level, np.uint8) for level in (120, 121)]
    found = compute_disparity(*flat)
    assert np.isnan(found.map_px).all() or found.std_px[found.valid].min(initial=9.0) > 0.4
    noise = [rng.integers(0, 256, (60, 80), dtype=np.uint8) for _ in range(2)]
    assert compute_disparity(*noise).density < 0.4


@pytest.mark.parametrize(
    ("left", "right", "error", "said"),
    [
        (
            np.zeros((40, 50), np.uint8),
            np.zeros((40, 51), np.uint8),
            ShapeError,
            "50x40 px, the right one 51x40",
        ),
        (np.zeros((1, 1), np.uint8), np.zeros((1, 1), np.uint8), DataError, "too small to match"),
        (np.zeros((40, 50), np.uint8), np.zeros((40, 50), np.uint8), DataError, "are the same"),
        (np.zeros((40, 50)), np.zeros((40, 50)), ShapeError, "of 8 bits"),
        (np.zeros((40, 50, 4), np.uint8), np.zeros((40, 50, 4), np.uint8), ShapeError, r"\(h, w, 3\)"),
    ],
)
def test_what_is_no_pair_is_refused(left, right, error, said):
    with pytest.raises(error, match=said):
        compute_disparity(left, right)


@pytest.mark.parametrize("size", [(16, 16), (16, 300), (300, 16), (17, 33)])
def test_the_smallest_pictures(size, rng):
    wide = rng.integers(0, 256, (size[0], size[1] + 3), dtype=np.uint8)
    found = compute_disparity(wide[:, :-3], wide[:, 3:])
    assert found.density > 0.7
    assert np.median(np.abs(found.map_px[found.valid] - 3.0)) < 0.1
    if size[1] == 16:
        with pytest.raises(DataError, match="OpenCV's sgbm cannot match"):
            compute_disparity(wide[:, :-3], wide[:, 3:], StereoSettings("sgbm", 0, 7))


@pytest.mark.parametrize(
    "settings",
    [
        {"matcher": "magic"}, {"paths": 5}, {"small_step": 9, "large_step": 3}, {"least_px": 5, "most_px": 5},
        {"least_px": 0, "most_px": 99999},
    ],
)  # fmt: skip
def test_settings_that_make_no_sense(settings):
    with pytest.raises(ModelError):
        StereoSettings(**settings)


def test_the_motorcycle(data_dir):
    """Bad pixels of Middlebury's motorcycle at a quarter of its size, unmatched ones too."""
    folder = data_dir / "vision" / "motorcycle"
    left, right = (cv2.imread(str(folder / f"motorcycle_{side}.png")) for side in ("left", "right"))
    with np.load(folder / "motorcycle_disp.npz") as held:
        truth = held[held.files[0]]
    assert bad(compute_disparity(left, right), np.where(truth > 0, truth, np.nan)) < 0.065


def test_the_aloe(data_dir):
    """The same of the aloe at a quarter of its size, whose truth is in whole pixels of the full size."""
    folder = data_dir / "vision" / "opencv"
    left, right = (
        cv2.resize(cv2.imread(str(folder / f"aloe{side}.jpg")), (320, 277), interpolation=cv2.INTER_AREA)
        for side in "LR"
    )
    truth = cv2.imread(str(folder / "aloeGT.png"), 0)[::4, ::4][:277, :320].astype(float) / 4.0
    assert bad(compute_disparity(left, right), np.where(truth > 0, truth, np.nan)) < 0.06


def bad(found, truth):
    """Share of all pixels with a known disparity whose answer is off by more than two pixels."""
    known = np.isfinite(truth)
    return (np.abs(found.map_px - truth)[known] > 2.0).mean()
