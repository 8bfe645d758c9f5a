"""The motion between two pictures: truth, honesty, and a verdict for what has none."""

import cv2
import numpy as np
import pytest
from two_view_worlds import PINHOLE, distorted, world

from sequential.errors import NotFiniteError, ShapeError
from vision3d.camera import Camera
from vision3d.features import detect_features, match_features
from vision3d.two_view import estimate_two_view, local_motion


def estimated(it, **options):
    return estimate_two_view(it.camera, it.camera, it.pixels_a, it.pixels_b, **options)


@pytest.mark.parametrize("camera", [PINHOLE, distorted])
@pytest.mark.parametrize("wrong", [0.0, 0.5])
def test_motion_in_space(rng, camera, wrong):
    it = world(rng, wrong=wrong, camera=camera, baseline=0.4)
    view = estimated(it)
    assert view.verdict == "general"
    error = local_motion(view.b_T_a, it.b_T_a)
    assert error @ np.linalg.solve(view.cov, error) < 25.0  # chi² of five, once in 7000
    assert view.inliers[it.right].mean() > 0.9
    assert view.inliers[~it.right].sum() <= 0.1 * len(it.right)
    assert view.sigma_px == pytest.approx(0.3, rel=0.25)
    both = np.isfinite(view.points_a[:, 0]) & it.right
    off = np.linalg.norm(view.points_a - it.points_a, axis=1) / np.linalg.norm(it.points_a, axis=1)
    assert np.median(off[both]) < 0.1


@pytest.mark.parametrize(("shape", "verdict"), [("plane", "planar"), ("turn", "pure rotation")])
def test_degenerate_worlds_are_named(rng, shape, verdict):
    for wrong in (0.0, 0.3):
        it = world(rng, shape=shape, wrong=wrong, baseline=0.4)
        view = estimated(it)
        assert view.verdict == verdict, view.words
        readings = [view.b_T_a, *view.rivals]
        if shape == "plane":
            assert min(np.linalg.norm(local_motion(one, it.b_T_a)) for one in readings) < np.radians(2.0)


def test_no_motion_no_overlap_and_too_few(rng):
    assert estimated(world(rng, still=True)).verdict == "identical"
    assert estimated(world(rng, wrong=1.0)).verdict == "no overlap"
    few = world(rng, count=6)
    view = estimated(few)
    assert view.verdict == "too few"
    assert not view.known
    assert "match more" in view.words


def test_bad_pixels_are_told(rng):
    it = world(rng, count=20)
    with pytest.raises(ShapeError, match="matches are pixels"):
        estimate_two_view(PINHOLE, PINHOLE, it.pixels_a, it.pixels_b[:5])
    with pytest.raises(ShapeError, match="sigma_px is one number"):
        estimated(it, sigma_px=np.ones(7))
    with pytest.raises(NotFiniteError, match="positive"):
        estimated(it, sigma_px=-1.0)
    it.pixels_a[3] = np.nan
    with pytest.raises(NotFiniteError, match="finite"):
        estimated(it)


def test_same_seed_same_motion(rng):
    it = world(rng, wrong=0.3)
    first, second = (estimated(it, rng=np.random.default_rng(4)) for _ in range(2))
    np.testing.assert_array_equal(first.b_T_a, second.b_T_a)


@pytest.mark.parametrize(
    ("shape", "verdict"), [("space", "general"), ("plane", "planar"), ("turn", "pure rotation")]
)
def test_nine_wrong_matches_in_ten_are_no_excuse(rng, shape, verdict):
    it = world(rng, shape=shape, wrong=0.9, count=600, baseline=0.4)
    # sorted as matches are: surer ones first, but not surely right
    order = np.argsort(rng.random(600) + 0.6 * ~it.right)
    view = estimate_two_view(it.camera, it.camera, it.pixels_a[order], it.pixels_b[order], best_first=True)
    assert view.verdict == verdict
    assert view.inliers[it.right[order]].mean() > 0.9


@pytest.mark.slow
def test_both_readings_of_a_plane_are_kept_unless_something_tells(seeds):
    for seed in seeds:
        it = world(np.random.default_rng(1000 + seed), shape="plane", wrong=0.2, baseline=0.4, sigma_px=0.2)
        view = estimated(it)
        readings = [view.b_T_a, *view.rivals]
        assert min(np.linalg.norm(local_motion(one, it.b_T_a)) for one in readings) < np.radians(3.0)


@pytest.mark.slow
def test_chance_is_called_chance(seeds):
    verdicts = {estimated(world(np.random.default_rng(seed), wrong=1.0)).verdict for seed in seeds}
    assert verdicts == {"no overlap"}


def test_real_pairs_of_a_rig(data_dir):
    folder = data_dir / "vision" / "opencv"
    left = Camera("brown5", (532.9, 533.0, 342.4, 233.9), (-0.281, 0.026, 0.0012, -0.0001, 0.162), (640, 480))
    right = Camera("brown5", (536.0, 535.7, 326.9, 250.1), (-0.289, 0.106, 0.0, 0.0, -0.043), (640, 480))
    for name in ("01", "06"):
        found = [
            detect_features(cv2.imread(str(folder / f"{side}{name}.jpg"), 0), "sift")
            for side in ("left", "right")
        ]
        matched = match_features(*found, ratio=0.75).pairs
        view = estimate_two_view(
            left, right, found[0].pixels[matched[:, 0]], found[1].pixels[matched[:, 1]], best_first=True
        )
        assert view.verdict == "general"
        assert abs(view.b_T_a[4]) > 0.999
        assert np.degrees(2.0 * np.arccos(view.b_T_a[0])) < 1.5
        assert view.sigma_px < 0.4
