"""Alignment of patches against known shifts and homographies of photographs and textures."""

import numpy as np
import pytest

from sequential.errors import ModelError, ShapeError
from vision3d.features import refine_matches


def texture(x, y):
    """Smooth light that can be evaluated anywhere, 0 to 255."""
    waves = ((0.21, 0.05, 0.3), (-0.08, 0.17, 1.1), (0.13, 0.19, 2.0), (0.31, -0.11, 0.7), (-0.05, 0.29, 2.7))
    return 127.0 + 22.0 * sum(np.sin(u * x + v * y + w) for u, v, w in waves)


@pytest.fixture
def pair(rng):
    """Two images of the texture, and the affine map between them."""
    y, x = np.mgrid[:220, :260].astype(float)
    matrix, shift = np.array([[1.05, 0.12], [-0.1, 0.96]]), np.array([3.3, -2.7])
    inverse = np.linalg.inv(matrix)
    back = np.stack([x - shift[0], y - shift[1]], axis=-1) @ inverse.T
    second = 0.8 * texture(back[..., 0], back[..., 1]) + 12.0
    images = [
        np.rint(light + rng.normal(0, 1, light.shape)).astype(np.uint8) for light in (texture(x, y), second)
    ]
    points = rng.uniform(40, 180, (200, 2))
    return *images, points, points @ matrix.T + shift, matrix


def test_finds_the_place_to_hundredths_from_pixels_away(pair, rng):
    a, b, points, truth, _ = pair
    found, cov, ok = refine_matches(a, b, points, truth + rng.uniform(-1.5, 1.5, truth.shape))
    error = (found - truth)[ok]
    assert ok.mean() > 0.95
    assert np.sqrt((error**2).mean()) < 0.05
    assert np.isfinite(cov[ok]).all()
    assert (np.linalg.eigvalsh(cov[ok]) > 0).all()


def test_refuses_what_lies_outside_or_is_flat(pair):
    a, b, points, truth, _ = pair
    points = points[:3].copy()
    points[0] = 2.0
    points[1] = np.nan
    flat = b.copy()
    flat[:] = 90
    _, cov, ok = refine_matches(a, b, points, truth[:3])
    assert ok.tolist() == [False, False, True]
    assert np.isnan(cov[:2]).all()
    found, _, ok = refine_matches(a, flat, points, truth[:3])
    assert not ok.any()
    assert np.array_equal(found, truth[:3])


def test_says_what_does_not_belong_together(pair):
    a, b, points, truth, _ = pair
    with pytest.raises(ShapeError, match="pairs"):
        refine_matches(a, b, points, truth[:-1])
    with pytest.raises(ShapeError, match="warps"):
        refine_matches(a, b, points, truth, warps=np.eye(2))
    with pytest.raises(ModelError, match="radius"):
        refine_matches(a, b, points, truth, radius_px=1)


def test_nothing_gives_nothing(pair):
    a, b, *_ = pair
    found, cov, ok = refine_matches(a, b, np.empty((0, 2)), np.empty((0, 2)))
    assert found.shape == (0, 2)
    assert cov.shape == (0, 2, 2)
    assert len(ok) == 0


@pytest.mark.parametrize("amplitude", [4.0, 10.0, 22.0])
@pytest.mark.parametrize("noise", [1.5, 3.0])
def test_covariance_is_honest(amplitude, noise, rng):
    """Normalised squared errors of known light: two degrees of freedom each, so 1 after halving."""
    y, x = np.mgrid[:300, :340].astype(float)
    matrix, shift = np.array([[0.9, 0.1], [-0.2, 1.1]]), np.array([20.3, -2.7])
    back = np.stack([x - shift[0], y - shift[1]], axis=-1) @ np.linalg.inv(matrix).T
    lights = (texture(1.5 * x, 1.5 * y), texture(1.5 * back[..., 0], 1.5 * back[..., 1]))
    a, b = (
        np.rint(127 + amplitude / 22 * (light - 127) + rng.normal(0, noise, light.shape)).astype(np.uint8)
        for light in lights
    )
    points = rng.uniform(60, 230, (400, 2))
    truth = points @ matrix.T + shift
    start = truth + rng.uniform(-1, 1, truth.shape)
    found, cov, ok = refine_matches(
        a, b, points, start, warps=np.broadcast_to(matrix, (400, 2, 2)), min_correlation=0.5
    )
    error = (found - truth)[ok]
    nees = np.einsum("ni,nij,nj->n", error, np.linalg.inv(cov[ok]), error) / 2
    assert ok.mean() > 0.4
    # the floor, which photographs need, is all that strong texture has left
    assert (0.7 if amplitude < 20 else 0.4) < nees.mean() < 1.35
