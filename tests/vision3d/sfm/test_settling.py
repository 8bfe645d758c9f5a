"""The last adjustment: gross errors leave, and the cameras come nearer to the truth."""

import numpy as np
import pytest
from sfm_worlds import seen_cloud

from vision3d.sfm import SfmSettings
from vision3d.sfm.alignment import align
from vision3d.sfm.noise import noise_of
from vision3d.sfm.settling import adjusted, settled


def with_gross_errors(rng, share):
    """Noise of 0.3 px and a share of observations off by up to 4 px, which mappers keep; and the truth."""
    exact = seen_cloud(rng, views=6, count=200)
    truth = dict(zip(exact.names, exact.cameras_T_world, strict=True))
    pixels = exact.pixels + rng.normal(0.0, 0.3, exact.pixels.shape)
    wrong = rng.uniform(size=len(pixels)) < share
    pixels[wrong] += rng.uniform(-4.0, 4.0, (int(wrong.sum()), 2))
    noisy = exact.replaced(pixels=pixels)
    return noisy.replaced(sigma_px=noise_of(noisy)), truth


@pytest.mark.parametrize("share", [0.03, 0.1])
def test_it_comes_nearer_to_the_truth_than_least_squares(share, rng):
    settings, better = SfmSettings(), []
    for _ in range(6):
        noisy, truth = with_gross_errors(rng, share)
        plain, robust = adjusted(noisy), settled(noisy, settings)
        better.append(align(robust, truth).ate / align(plain, truth).ate)
    assert np.median(better) < 0.8


def test_it_keeps_what_noise_explains(rng):
    noisy, _ = with_gross_errors(rng, 0.0)
    assert len(settled(noisy, SfmSettings()).pixels) > 0.999 * len(noisy.pixels)


def test_it_keeps_a_camera_that_was_given(rng):
    noisy, _ = with_gross_errors(rng, 0.05)
    kept = settled(noisy, SfmSettings(camera=noisy.cameras[0]))
    np.testing.assert_allclose(kept.cameras[0].parameters, noisy.cameras[0].parameters, atol=1e-9)
    freed = settled(noisy, SfmSettings())
    assert np.abs(freed.cameras[0].parameters - noisy.cameras[0].parameters).max() > 1e-3


@pytest.mark.parametrize("along_a_line", [False, True])
def test_alignment_finds_the_similarity(along_a_line, rng):
    """Also where all centres lie on a line, and only the directions tell the turn about it."""
    from sequential.manifold.quaternion import quaternion_exp
    from vision3d.rigid import inverse
    from vision3d.sfm.alignment import Alignment, transformed

    found = seen_cloud(rng)
    if along_a_line:
        poses = inverse(found.cameras_T_world)
        poses[:, 4:] = np.linspace(-1, 1, len(found))[:, None] * [1.0, 0.2, 0.1] + [0.0, 0.0, -5.0]
        found = found.replaced(cameras_T_world=inverse(poses))
    turn = quaternion_exp(np.array([0.3, -0.8, 0.5]))
    move = Alignment(2.5, turn, np.array([1.0, 2.0, -3.0]), np.zeros(0), np.zeros(0))
    truth = transformed(found, move)
    told = align(found, dict(zip(truth.names, truth.cameras_T_world, strict=True)))
    assert told.scale == pytest.approx(2.5, rel=1e-9)
    np.testing.assert_allclose(told.rotation, turn, atol=1e-9)
    np.testing.assert_allclose(told.translation, [1.0, 2.0, -3.0], atol=1e-8)
    assert told.ate < 1e-9
    assert told.rotation_errors_rad.max() < 1e-7
