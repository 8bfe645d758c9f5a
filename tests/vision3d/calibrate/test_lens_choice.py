"""The lens is chosen by views left out: the true one or one as good, never one that folds in the image."""

import numpy as np
import pytest
from calibration_worlds import SIZE, world

from sequential.errors import DataError
from vision3d.calibrate import choose_lens, difference
from vision3d.camera import Camera
from vision3d.views import View


@pytest.mark.parametrize("truth", ["pinhole", "brown2", "brown5", "fisheye4"])
def test_the_chosen_lens_predicts_as_well_as_the_true_one(truth):
    scene = world(truth, n=12, seed=21)
    choice = choose_lens(scene.views(np.random.default_rng(0)))
    chosen, true = choice.score(choice.chosen), choice.score(truth)
    assert chosen.held_out_rms_px <= 1.005 * true.held_out_rms_px
    assert choice.calibration is chosen.calibration
    assert choice.chosen in choice.why
    # it is as far from the truth as it says, or a little more if it is simpler than the truth
    assert difference(choice.calibration, scene.camera).sigmas < 2.5


def test_a_lens_too_simple_is_worse_by_far_and_one_too_rich_is_not_taken():
    choice = choose_lens(world("brown2", n=12, seed=22).views(np.random.default_rng(1)))
    assert choice.score("pinhole").held_out_rms_px > 3.0 * choice.score("brown2").held_out_rms_px
    assert choice.chosen in {"brown1", "brown2", "brown4"}
    assert "worse on views left out" in choice.score("pinhole").remark
    assert not choice.score(choice.chosen).remark


def test_all_lenses_are_judged_on_the_same_corners():
    views = list(world("brown5", n=10, seed=23).views(np.random.default_rng(2)))
    pixels = views[4].pixels.copy()
    pixels[20] += (6.0, 2.0)
    views[4] = View("spoilt", SIZE, views[4].points, pixels, views[4].ids, 0.2)
    choice = choose_lens(views, ("pinhole", "brown2", "brown5"))
    assert {row.calibration.outliers for row in choice.table} == {((4, 20),)}


def test_a_lens_that_folds_in_the_image_is_not_chosen():
    # one coefficient of a wide lens, seen only in the middle: the true lens bends back, the fit as well
    camera = Camera("brown2", (330.0, 330.0, 320.0, 240.0), (-0.33, 0.10), SIZE)
    scene = world(camera=camera, n=10, seed=24, margin_px=100.0)
    choice = choose_lens(scene.views(np.random.default_rng(3)), ("brown1", "brown2", "fisheye4"))
    assert choice.score("brown1").folds_inside
    assert choice.score("brown1").remark == "its distortion folds within the image"
    assert choice.chosen != "brown1"


def test_a_lens_with_more_coefficients_than_the_views_can_tell_is_named():
    views = [
        view.subset(np.arange(0, 54, 6))
        for view in world("brown1", n=4, seed=25).views(np.random.default_rng(4))
    ]
    views = [view.subset(np.arange(5)) for view in views]
    choice = choose_lens(views, ("pinhole", "brown1", "thin12"))
    assert choice.score("thin12").calibration is None
    assert "take more views" in choice.score("thin12").remark


def test_too_few_views_to_leave_one_out():
    with pytest.raises(DataError, match="at least 4 views, to leave one out; got 3"):
        choose_lens(world(n=3, seed=26).views(np.random.default_rng(5)))


def test_when_no_lens_can_be_tried_the_reason_is_given():
    views = [view.subset(np.arange(3)) for view in world(n=5, seed=27).views(np.random.default_rng(6))]
    with pytest.raises(DataError, match="a pose takes 4"):
        choose_lens(views)
