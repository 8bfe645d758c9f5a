"""Tracks and filters: what matches join, and what a reconstruction is better without."""

import numpy as np
import pytest
from bundle_worlds import bundle_world

from sequential.errors import ShapeError
from vision3d.sfm.filtering import filter_observations
from vision3d.sfm.tracks import build_tracks


def scattered(rng, *counts):
    return [rng.uniform(0, 100, (count, 2)) for count in counts]


def test_matches_join_to_tracks(rng):
    pixels = scattered(rng, 4, 4, 3)
    tracks = build_tracks(pixels, {(0, 1): [[0, 1], [2, 2]], (1, 2): [[1, 0]], (0, 2): [[3, 2]]})
    found = {
        tuple(
            zip(
                tracks.images[tracks.tracks == t].tolist(),
                tracks.features[tracks.tracks == t].tolist(),
                strict=True,
            )
        )
        for t in range(tracks.count)
    }
    assert found == {((0, 0), (1, 1), (2, 0)), ((0, 2), (1, 2)), ((0, 3), (2, 2))}
    np.testing.assert_array_equal(tracks.lengths[tracks.tracks], [3, 3, 3, 2, 2, 2, 2])
    for image, feature, pixel in zip(tracks.images, tracks.features, tracks.pixels, strict=True):
        np.testing.assert_array_equal(pixel, pixels[image][feature])


def test_no_track_has_two_features_of_one_image(rng):
    """Features 0 and 1 of image 0 both lead to feature 0 of image 1; the pair with most matches is
    believed."""
    matches = {(0, 1): [[0, 0]], (1, 2): [[0, 0], [1, 1]], (0, 2): [[1, 0], [2, 1], [3, 2]], (2, 3): [[0, 0]]}
    tracks = build_tracks(scattered(rng, 4, 2, 3, 1), matches)
    of = {
        (int(i), int(f)): int(t)
        for i, f, t in zip(tracks.images, tracks.features, tracks.tracks, strict=True)
    }
    assert of[0, 1] == of[2, 0] == of[1, 0] == of[3, 0]
    assert (0, 0) not in of
    key = tracks.tracks * 10 + tracks.images
    assert len(np.unique(key)) == len(key)


def test_nothing_matched_gives_no_tracks(rng):
    assert build_tracks(scattered(rng, 3, 3), {}).count == 0
    assert build_tracks([], {}).count == 0
    assert build_tracks(scattered(rng, 3, 3), {(0, 1): np.zeros((0, 2), dtype=int)}).count == 0
    # the least number of images is a choice
    assert build_tracks(scattered(rng, 3, 3), {(0, 1): [[0, 0]]}, least=3).count == 0


def test_a_match_that_names_no_feature_is_refused(rng):
    with pytest.raises(ShapeError, match="images 0 and 1 name features"):
        build_tracks(scattered(rng, 3, 3), {(0, 1): [[0, 3]]})


def test_tracks_of_any_order_are_the_same(rng):
    world = bundle_world(rng, views=5, points=60)
    pixels = [world.pixels[world.image_index == i] for i in range(5)]
    of = [world.point_index[world.image_index == i] for i in range(5)]
    matches = {}
    for a in range(5):
        for b in range(a + 1, 5):
            _, rows_a, rows_b = np.intersect1d(of[a], of[b], return_indices=True)
            matches[a, b] = np.c_[rows_a, rows_b]
    tracks = build_tracks(
        pixels, dict(rng.permutation(np.array(list(matches.items()), dtype=object)).tolist())
    )
    assert tracks.count == len(world.points)
    for t in range(tracks.count):
        mine = tracks.tracks == t
        assert (
            len({int(of[i][f]) for i, f in zip(tracks.images[mine], tracks.features[mine], strict=True)}) == 1
        )


def test_filters_take_what_is_wrong_and_nothing_else(rng):
    world = bundle_world(rng, views=6, points=100, sigma_px=0.3)
    clean = filter_observations(world, max_error_px=4.0)
    assert clean.kept.all()
    assert (clean.far, clean.behind, clean.narrow, clean.alone) == (0, 0, 0, 0)
    pixels, points = np.array(world.pixels), np.array(world.points)
    pixels[7] += 30.0
    points[5, 2] = -4.0
    told = filter_observations(world.replaced(pixels=pixels, points=points), max_error_px=4.0)
    assert told.far == 1
    assert told.behind == int((world.point_index == 5).sum())
    assert not told.kept[7]
    assert len(told.reconstruction.points) == len(world.points) - 1
    assert told.kept.sum() == len(world.pixels) - told.far - told.behind - told.alone
    assert len(told.reconstruction.pixels) == told.kept.sum()


def test_points_seen_along_nearly_one_ray_go(rng):
    world = bundle_world(rng, views=6, points=100)
    points = np.array(world.points)
    points[:4] *= 1e3  # far away
    far = world.replaced(points=points)
    told = filter_observations(far, max_error_px=np.inf, min_angle_rad=np.radians(0.5))
    assert len(told.reconstruction.points) == 96
    assert told.narrow == int(np.isin(world.point_index, range(4)).sum())
