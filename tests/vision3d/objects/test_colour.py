"""Objects by colour: hue through zero, learnt ranges, cleaning, and the light."""

import cv2
import numpy as np
import pytest

from sequential.errors import DataError, ShapeError
from vision3d.objects import (
    ColourRange,
    find_blobs,
    hue_margin,
    largest_object,
    learn_colour,
    light_margin,
)

RED = ColourRange.from_text("hsv:170-8,120-255,60-255")


def ball(colour, centre=(90, 60), radius=20, shape=(120, 180), ground=(60, 70, 60)):
    """A disc of a BGR colour on a ground, with its mask."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    inside = np.hypot(x - centre[0], y - centre[1]) <= radius
    return np.where(inside[:, :, None], np.array(colour), np.array(ground)).astype(np.uint8), inside


def of_hue(hue, saturation=220, value=200):
    one = np.array([[[hue, saturation, value]]], np.uint8)
    return cv2.cvtColor(one, cv2.COLOR_HSV2BGR)[0, 0].tolist()


@pytest.mark.parametrize("space", ["hsv", "bgr"])
def test_ranges_are_opencv_s(space, rng):
    image = rng.integers(0, 256, (40, 50, 3), dtype=np.uint8)
    low, high = (20.0, 40.0, 60.0), (90.0, 200.0, 250.0)
    channels = cv2.cvtColor(image, cv2.COLOR_BGR2HSV) if space == "hsv" else image
    np.testing.assert_array_equal(ColourRange(space, low, high).mask(image), cv2.inRange(channels, low, high))


@pytest.mark.parametrize("hue", range(0, 180, 9))
def test_every_hue_alike(hue):
    """A range around any hue finds it, and not the opposite one: zero is nothing special."""
    around = ColourRange("hsv", ((hue - 10) % 180, 100.0, 50.0), ((hue + 10) % 180, 255.0, 255.0))
    image, inside = ball(of_hue(hue))
    np.testing.assert_array_equal(around.mask(image) > 0, inside)
    other, _ = ball(of_hue((hue + 90) % 180))
    assert not around.mask(other).any()
    learnt = learn_colour(image, (80, 50, 20, 20))
    np.testing.assert_array_equal(learnt.mask(image) > 0, inside)
    assert not learnt.mask(other).any()


def test_learnt_from_noisy_pixels(rng):
    image, inside = ball(of_hue(178))
    noisy = np.clip(image + rng.normal(0, 8, image.shape), 0, 255).astype(np.uint8)
    learnt = learn_colour(noisy, inside)
    assert learnt.low[0] > learnt.high[0], "red lies on both sides of zero"
    found = find_blobs(noisy, learnt)
    assert len(found) == 1
    assert np.hypot(*np.subtract(found.objects[0].centroid, (90, 60))) < 0.5
    assert found.objects[0].area == pytest.approx(inside.sum(), rel=0.05)


def test_specks_go_and_holes_close(rng):
    image, inside = ball((20, 20, 230))
    image[rng.random(inside.shape) < 0.004] = (20, 20, 230)
    image[55:58, 85:88] = (255, 255, 255)  # a reflection
    found = find_blobs(image, RED, least_area=30)
    assert len(found) == 1
    assert 0 < found.specks < 0.15
    assert np.mean((found.mask > 0) == inside) > 0.995
    assert find_blobs(image, RED, least_area=1, open_px=1, close_px=1).specks == 0.0


def test_objects_by_size_and_cut_by_the_edge():
    one, _ = ball((20, 20, 230), (5, 60), 20)
    other, _ = ball((20, 20, 230), (120, 60), 12)
    image = np.maximum(one, other)
    found = find_blobs(image, RED)
    assert [b.cut for b in found.objects] == [True, False]
    assert found.objects[0].area > found.objects[1].area
    x, y = found.objects[1].centroid
    assert np.hypot(x - 120, y - 60) < 0.1
    assert found.objects[1].box == pytest.approx((108, 48, 25, 25), abs=1)


def test_the_largest_object():
    mask = np.zeros((20, 20))
    assert largest_object(mask) is None
    mask[2:5, 2:5] = 1
    mask[10:14, 10:14] = 1
    assert largest_object(mask) == (11.5, 11.5)
    assert largest_object(mask, 17) is None
    mask[5, 5] = 1  # hangs on by a corner only
    assert largest_object(mask, connectivity=8) == (11.5, 11.5)


def test_a_range_too_tight_for_another_light_is_told():
    image, _ = ball((20, 20, 200))
    wide = light_margin(image, ColourRange.from_text("hsv:170-8,120-255,*"))
    tight = light_margin(image, ColourRange.from_text("hsv:170-8,120-255,190-210"))
    assert min(wide.darker, wide.brighter) > 0.95
    assert max(tight.darker, tight.brighter) < 0.05
    nothing = light_margin(image, ColourRange.from_text("hsv:50-60,200-255,*"))
    assert (nothing.darker, nothing.brighter) == (0.0, 0.0)


def test_an_end_of_hue_that_cuts_through_a_colour_is_told():
    y, x = np.mgrid[:80, :100]
    hues = np.where(np.hypot(x - 50, y - 40) < 25, 2 + x // 5, 90)  # from 7 to 17 across the disc
    wheel = np.dstack([hues, np.full_like(hues, 220), np.full_like(hues, 200)]).astype(np.uint8)
    image = cv2.cvtColor(wheel, cv2.COLOR_HSV2BGR)
    assert hue_margin(image, ColourRange.from_text("hsv:170-12,100-255,*")) > 0.5
    assert hue_margin(image, ColourRange.from_text("hsv:170-30,100-255,*")) == 0.0
    assert np.isnan(hue_margin(image, ColourRange.from_text("hsv:130-140,100-255,*")))
    assert np.isnan(hue_margin(image, ColourRange.from_text("lab:*,*,*")))


def test_ends_of_hue_moved():
    assert RED.with_hue_moved(3).low[0] == 167
    assert RED.with_hue_moved(3).high[0] == 11
    assert RED.with_hue_moved(-9) == RED, "it would be gone"
    assert ColourRange.from_text("hsv:*,1-2,*").with_hue_moved(-1).low[0] == 0
    assert ColourRange.from_text("hsv:178-179,1-2,*").with_hue_moved(2).high[0] == 1


def test_text_there_and_back():
    for text in ("hsv:170-8,120-255,60-255", "lab:20..80,-10..30,5..60", "bgr:0-255,3-4,0-255"):
        one = ColourRange.from_text(text)
        assert ColourRange.from_text(str(one)) == one
    assert ColourRange.from_text("LAB: 0 to 50, *, -5..5") == ColourRange("lab", (0, -128, -5), (50, 127, 5))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("red", "expected hsv"),
        ("hsv:1-2,3-4", "three"),
        ("hsv:1-2,3-4,x", "no range"),
        ("hsv:0-200,0-255,0-255", "within 0 to 179"),
        ("hsv:10-20,200-100,0-255", "exchange"),
        ("lab:50..20,*,*", "exchange"),
    ],
)
def test_bad_ranges_are_said(text, words):
    with pytest.raises(DataError, match=words):
        ColourRange.from_text(text)


def test_bad_samples_are_said(rng):
    image, _ = ball(of_hue(60))
    grey = np.dstack([rng.integers(90, 99, (20, 20), dtype=np.uint8)] * 3)
    with pytest.raises(DataError, match="no pixel"):
        learn_colour(image, (500, 500, 10, 10))
    with pytest.raises(DataError, match="no one hue"):
        learn_colour(grey, (2, 2, 10, 10))
    assert learn_colour(grey, (2, 2, 10, 10), space="lab").mask(grey).all()
    with pytest.raises(ShapeError, match="mask"):
        learn_colour(image, np.zeros(3))
    with pytest.raises(ShapeError, match="blue, green, red"):
        RED.mask(image[:, :, 0])
    with pytest.raises(DataError, match="factor"):
        light_margin(image, RED, 2.0)
    with pytest.raises(DataError, match="colour space"):
        ColourRange("cmyk", (0, 0, 0), (1, 1, 1))
