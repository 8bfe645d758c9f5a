"""Brute force against OpenCV's, and what a match must be."""

import cv2
import numpy as np
import pytest

from sequential.errors import DataError, ModelError
from vision3d.features import Features, match_features


def bits(rng, count, width=32):
    return of_descriptors(rng.integers(0, 256, (count, width), dtype=np.uint8), rng)


def numbers(rng, count, width=64):
    return of_descriptors(rng.random((count, width), dtype=np.float32), rng)


def of_descriptors(rows, rng):
    zero = np.zeros(len(rows))
    return Features(rng.uniform(0, 1000, (len(rows), 2)), rows, zero + 31.0, zero, zero, zero + 0.5)


MAKERS = {"bits": (bits, cv2.NORM_HAMMING), "numbers": (numbers, cv2.NORM_L2)}


@pytest.mark.parametrize("kind", MAKERS)
@pytest.mark.parametrize("width", [8, 20, 64])
def test_nearest_are_those_of_opencv(kind, width, rng):
    make, norm = MAKERS[kind]
    a, b = make(rng, 300, width), make(rng, 411, width)
    found = match_features(a, b, ratio=None, cross_check=False, apart_px=0.0)
    best = {row: (col, d) for (row, col), d in zip(found.pairs.tolist(), found.distance, strict=True)}
    for first, second in cv2.BFMatcher(norm).knnMatch(a.descriptors, b.descriptors, k=2):
        column, distance = best[first.queryIdx]
        assert distance == pytest.approx(first.distance, abs=1e-5)
        if second.distance > first.distance:
            assert column == first.trainIdx


@pytest.mark.parametrize("kind", MAKERS)
def test_ratio_is_that_of_the_two_nearest(kind, rng):
    make, norm = MAKERS[kind]
    a, b = make(rng, 200), make(rng, 250)
    found = match_features(a, b, ratio=None, cross_check=False, apart_px=0.0)
    ratio = dict(zip(found.pairs[:, 0].tolist(), found.ratio, strict=True))
    for first, second in cv2.BFMatcher(norm).knnMatch(a.descriptors, b.descriptors, k=2):
        assert ratio[first.queryIdx] == pytest.approx(first.distance / second.distance, abs=1e-5)


@pytest.mark.parametrize("kind", MAKERS)
def test_cross_check_is_that_of_opencv(kind, rng):
    make, norm = MAKERS[kind]
    a = make(rng, 250)
    b = a.take(rng.permutation(250)[:180])
    found = match_features(a, b, ratio=None, apart_px=0.0)
    theirs = {(m.queryIdx, m.trainIdx) for m in cv2.BFMatcher(norm, True).match(a.descriptors, b.descriptors)}
    assert {tuple(pair) for pair in found.pairs.tolist()} == theirs
    assert (found.distance < 1e-6).all()


def test_best_first_and_symmetric(rng):
    a = numbers(rng, 300, 4)
    b = numbers(rng, 200, 4)
    there = match_features(a, b, ratio=None, apart_px=0.0)
    back = match_features(b, a, ratio=None, apart_px=0.0)
    assert (np.diff(there.ratio) >= 0).all()
    assert {tuple(p) for p in there.pairs.tolist()} == {tuple(p[::-1]) for p in back.pairs.tolist()}


def test_a_second_feature_in_the_same_place_does_not_hide_the_first(rng):
    a = numbers(rng, 50)
    twice = np.concatenate([a.descriptors + 1e-3, a.descriptors - 1e-3])
    zero = np.zeros(100)
    b = Features(np.tile(a.pixels, (2, 1)) + 0.5, twice, zero + 1, zero, zero, zero + 1)
    assert len(match_features(a, b, cross_check=False, apart_px=0.0)) == 0
    assert len(match_features(a, b, cross_check=False)) == 50


def test_tables_in_pieces_are_the_same(rng, monkeypatch):
    from vision3d.features import matching

    a, b = bits(rng, 97), bits(rng, 89)
    whole = match_features(a, b, ratio=None)
    monkeypatch.setattr(matching, "AT_ONCE", 500)
    assert np.array_equal(match_features(a, b, ratio=None).pairs, whole.pairs)


def test_nothing_matches_nothing(rng):
    a = bits(rng, 10)
    none = a.take(np.empty(0, int))
    assert len(match_features(a, none)) == len(match_features(none, a)) == 0


def test_kinds_cannot_be_mixed(rng):
    with pytest.raises(DataError, match="same kind"):
        match_features(bits(rng, 5), numbers(rng, 5))
    with pytest.raises(ModelError, match="ratio"):
        match_features(bits(rng, 5), bits(rng, 5), ratio=1.5)
