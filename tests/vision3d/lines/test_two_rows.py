"""The line in two bands of rows: where it is, how well that is known, and when there is none."""

import numpy as np
import pytest

from sequential.errors import ModelError, ShapeError
from vision3d.camera import Camera
from vision3d.lines import CameraMount, TwoRows, read_two_rows
from vision3d.render import GroundView, line_pixels, random_line

CAMERA = Camera("pinhole", (50.0, 50.0, 29.5, 19.5), (), (60, 40))
MOUNT = CameraMount(0.15, np.radians(40.0), forward_m=0.05)
VIEW = GroundView(CAMERA, MOUNT)
SETTINGS = TwoRows((6.1, 4.3))


def stripe(centres, widths, level=60.0, ground=160.0, shape=(40, 60)):
    """An image whose rows hold a stripe with exact edges: (h,) centres and widths, px."""
    u = np.arange(shape[1])
    centres, widths = np.asarray(centres)[:, None], np.asarray(widths)[:, None]
    share = np.clip(0.5 + (0.5 * widths - np.abs(u - centres)), 0.0, 1.0)
    return np.clip(ground + share * (level - ground) + 0.5, 0, 255).astype(np.uint8)


def sightings(noise, count, rng):
    """(n, 2) errors in px and the standard deviations that were stated."""
    rows = []
    for _ in range(count):
        line = random_line(rng, width_m=0.02, length_m=2.0)
        pose = line.at(rng.uniform(0.3, 1.2)) + rng.normal(0.0, [0.0, 0.02, 0.1])
        reading = read_two_rows(VIEW.image(line, pose, rng=rng, noise=noise), SETTINGS)
        truth = line_pixels(CAMERA, MOUNT, line, pose, [reading.bottom_px[1], reading.middle_px[1]])
        if reading.found and np.isfinite(truth).all():
            error = np.array([reading.bottom_px[0], reading.middle_px[0]]) - truth
            rows.append([error, np.sqrt(np.diag(reading.cov_px))])
    return np.array(rows).reshape(-1, 2, 2)


@pytest.mark.parametrize("centre", [12.0, 29.5, 30.3, 51.8])
@pytest.mark.parametrize("dark", [True, False])
def test_finds_a_stripe_to_a_few_hundredths(centre, dark):
    image = stripe(np.full(40, centre), np.full(40, 5.0))
    image = image if dark else 255 - image
    reading = read_two_rows(image, TwoRows((5.0, 5.0), dark=dark))
    assert reading.found
    assert reading.confidence == 1.0
    np.testing.assert_allclose(
        [reading.bottom_px, reading.middle_px], [(centre, 37), (centre, 20)], atol=0.03
    )
    assert reading.offset == pytest.approx((centre - 29.5) / 30.0, abs=1e-3)


def test_is_as_sure_as_it_says(rng):
    errors, sigmas = np.swapaxes(sightings(40.0, 120, rng), 0, 1)
    assert len(errors) > 110
    whitened = errors / sigmas
    assert 0.75 < np.sqrt(np.mean(whitened**2)) < 1.25
    assert np.sqrt(np.mean(errors**2)) < 0.25


def test_says_so_where_there_is_no_line(rng):
    noise = np.clip(rng.normal(150.0, 40.0, (200, 40, 60)), 0, 255).astype(np.uint8)
    readings = [read_two_rows(image, SETTINGS) for image in noise]
    assert np.mean([reading.found for reading in readings]) <= 0.02
    blank = read_two_rows(np.full((40, 60), 120, np.uint8), SETTINGS)
    assert not blank.found
    assert "stands out" in blank.reason


def test_one_sided_shadow_is_no_line():
    image = np.full((40, 60), 160, np.uint8)
    image[:, 35:] = 60
    assert not read_two_rows(image, SETTINGS).found


@pytest.mark.parametrize("settings", [{"width_px": (0.5, 4.0)}, {"middle": 1.0}, {"half_rows": -1}])
def test_refuses_settings_without_meaning(settings):
    with pytest.raises(ModelError, match="two rows take"):
        TwoRows(**({"width_px": (6.0, 4.0)} | settings))


def test_refuses_what_is_no_image():
    with pytest.raises(ShapeError, match="expected an image"):
        read_two_rows(np.zeros((40, 60)), SETTINGS)
