"""Checkerboards: found, ordered, a hundredth of a pixel from the truth, and honest about it."""

import cv2
import numpy as np
import pytest

from sequential.errors import ModelError, ShapeError
from vision3d.boards import Checkerboard
from vision3d.calibrate.detection import detect_view, detect_views
from vision3d.camera import Camera
from vision3d.cv import refine_corners
from vision3d.render import render_set

BOARD = Checkerboard(9, 6, 0.025)
CAMERA = Camera(
    "brown5",
    np.array([533.0, 533.0, 342.0, 234.0]),
    np.array([-0.28, 0.02, 0.0012, -0.0001, 0.16]),
    (640, 480),
)


@pytest.fixture(scope="module")
def rendered():
    return render_set(CAMERA, BOARD, 8, np.random.default_rng(3))


@pytest.fixture(scope="module")
def found(rendered):
    return detect_views(rendered.named(), BOARD)


def errors_of(detections, rendered):
    truth = dict(zip([name for name, _ in rendered.named()], rendered.corners, strict=True))
    return [view.pixels - truth[view.name][view.ids] for view in detections.views]


def test_every_board_is_found_whole_and_in_order(found):
    assert (len(found.views), found.missed, found.findings) == (8, (), ())
    for view in found.views:
        np.testing.assert_array_equal(view.ids, np.arange(54))
        assert view.findings == ()


def test_corners_beat_opencvs_five_times_and_are_honest(found, rendered):
    ours = np.concatenate(errors_of(found, rendered))
    theirs = np.concatenate([
        refine_corners(image, corners, 5) - corners
        for image, corners in zip(rendered.images, rendered.corners, strict=True)
    ])  # fmt: skip
    rms = np.sqrt(np.mean(ours**2))
    assert rms < 0.013
    assert rms < 0.5 * np.sqrt(np.mean(theirs**2))
    assert abs(ours.mean()) < 0.002
    z = ours / np.concatenate([view.sigma_px for view in found.views])[:, None]
    assert 0.8 < np.sqrt(np.mean(z**2)) < 1.2


@pytest.mark.parametrize("turn", [0, 1, 2, 3])
def test_corner_0_stays_beside_the_dark_square(rendered, turn):
    image, truth = np.rot90(rendered.images[0], turn), rendered.corners[0]
    view = detect_views([("turned", image)], BOARD).views[0]
    w, h = CAMERA.size
    back = {
        0: view.pixels,
        1: np.stack([w - 1 - view.pixels[:, 1], view.pixels[:, 0]], axis=1),
        2: [w - 1, h - 1] - view.pixels,
        3: np.stack([view.pixels[:, 1], h - 1 - view.pixels[:, 0]], axis=1),
    }[turn]
    np.testing.assert_allclose(back, truth[view.ids], atol=0.08)


def test_a_transposed_size_is_the_same_board(rendered):
    view = detect_views(rendered.named()[:1], Checkerboard(6, 9, 0.025)).views[0]
    assert len(view) == 54
    x, y = view.pixels[view.ids == 1] - view.pixels[0], view.pixels[view.ids == 6] - view.pixels[0]
    assert np.cross(np.append(x, 0), np.append(y, 0))[2] > 0.0


def test_covered_corners_are_left_out(rendered):
    image = np.array(rendered.images[1])
    hidden = [22, 31]
    for corner in rendered.corners[1][hidden]:
        cv2.circle(image, tuple(np.round(corner).astype(int).tolist()), 9, 128, -1)
    view, audit, _ = detect_view("covered", image, BOARD)
    assert set(range(54)) - set(view.ids.tolist()) == set(audit.lost) == set(hidden)
    assert any("could not be refined" in said for said in view.findings)
    assert np.abs(view.pixels - rendered.corners[1][view.ids]).max() < 0.1


def test_a_corner_that_is_no_corner_is_named(rendered):
    moved = np.array(rendered.images[2], dtype=np.uint8)
    x, y = np.round(rendered.corners[2][20]).astype(int)
    patch = moved[y - 12 : y + 13, x - 12 : x + 13].copy()
    moved[y - 11 : y + 14, x - 12 : x + 13] = patch
    view, audit, _ = detect_view("moved", moved, BOARD)
    assert audit.suspicious == (20,)
    assert "corner (2, 2) lies more than 5 standard deviations" in " ".join(view.findings)


def test_a_forced_window_that_is_too_large_is_flagged(rendered):
    small = [(name, cv2.resize(image, None, fx=0.6, fy=0.6, interpolation=cv2.INTER_AREA))
             for name, image in rendered.named()]  # fmt: skip
    own, forced = detect_views(small, BOARD), detect_views(small, BOARD, window=11)
    assert not any(audit.window_too_large for audit in own.audits)
    flagged = [audit for audit in forced.audits if audit.window_too_large]
    assert flagged
    assert all(audit.spacing_px.min() * 0.35 < 11 for audit in flagged)
    assert "the forced window of ±11 px is too large" in forced.findings[0]


def test_a_window_that_fits_is_not_flagged(rendered):
    forced = detect_views(rendered.named(), BOARD, window=5)
    assert not any(audit.window_too_large for audit in forced.audits)
    assert not any(audit.moved for audit in forced.audits)
    assert forced.findings == ()


@pytest.mark.parametrize(
    ("size", "said"),
    [((8, 5), "try --board 9x6"), ((10, 7), "one fewer each way"), ((7, 7), "I see 9x6 inner corners")],
)
def test_a_wrong_size_is_told_the_right_one(rendered, size, said):
    detections = detect_views(rendered.named()[:3], Checkerboard(*size, 0.025))
    assert detections.views == ()
    assert {missed.seen for missed in detections.missed} == {(9, 6)}
    assert said in " ".join([*detections.findings, detections.missed[0].reason])


def test_nothing_is_found_where_there_is_nothing(rng):
    noise = rng.integers(0, 256, (240, 320), dtype=np.uint8)
    flat = np.full((240, 320), 127, np.uint8)
    detections = detect_views([("noise", noise), ("flat", flat)], BOARD)
    assert [missed.seen for missed in detections.missed] == [None, None]
    assert "the whole board must be in the image" in detections.missed[0].reason


def test_colour_and_16_bits_say_the_same(rendered, found):
    grey = rendered.images[0]
    colour = np.repeat(grey[..., None], 3, axis=2)
    deep = (grey.astype(np.uint16) << 8) * np.uint16(1)
    for image in (colour, deep):
        view = detect_views([("same", image)], BOARD).views[0]
        np.testing.assert_allclose(view.pixels, found.views[0].pixels, atol=0.01)


def test_progress_is_told_in_order(rendered):
    told = []
    detect_views(rendered.named(), BOARD, progress=lambda done, name: told.append((done, name)))
    assert told == [(k + 1, name) for k, (name, _) in enumerate(rendered.named())]


@pytest.mark.parametrize(
    "image", [np.zeros((5, 5, 2), np.uint8), np.zeros((5, 5)), np.zeros((0, 5), np.uint8)]
)
def test_what_is_no_image_is_said(image):
    with pytest.raises(ShapeError, match="odd: an image is"):
        detect_views([("odd", image)], BOARD)


@pytest.mark.parametrize("window", [0, -3, 2.5])
def test_what_is_no_window_is_said(window):
    with pytest.raises(ModelError, match="whole number of pixels"):
        detect_views([], BOARD, window=window)
