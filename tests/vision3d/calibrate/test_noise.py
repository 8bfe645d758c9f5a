"""The floor below stated sigmas: found where there is one, and then it makes the weights right."""

import numpy as np
import pytest
from calibration_worlds import SIZE, world

from vision3d.calibrate import calibrate, leave_one_out
from vision3d.calibrate.noise import floor_of
from vision3d.views import View


def drawn(sigma, floor, rng, scale=1.0):
    return scale * np.hypot(sigma, floor)[:, None] * rng.standard_normal((len(sigma), 2))


@pytest.mark.parametrize("floor", [0.1, 0.3, 1.0])
def test_a_floor_is_found_whatever_the_scale(floor, rng):
    sigma = np.exp(rng.normal(np.log(0.2), 0.8, 700))
    for scale in (0.5, 3.0):
        assert floor_of(drawn(sigma, floor, rng, scale), sigma) == pytest.approx(floor, rel=0.5)


def test_stated_sigmas_that_are_right_are_left_alone(rng):
    sigma = np.exp(rng.normal(np.log(0.2), 0.5, 700))
    assert sum(floor_of(drawn(sigma, 0.0, rng), sigma) > 0.0 for _ in range(40)) <= 1


def test_wrong_corners_make_no_floor(rng):
    sigma = np.exp(rng.normal(np.log(0.2), 0.5, 700))
    residuals = drawn(sigma, 0.0, rng)
    residuals[:20] += rng.normal(0.0, 10.0, (20, 2))
    residuals[20] = np.nan
    assert floor_of(residuals, sigma) < 0.05


def test_sigmas_that_are_all_alike_or_residuals_that_are_none_say_nothing(rng):
    assert floor_of(rng.normal(0.0, 1.0, (50, 2)), np.full(50, 0.3)) == 0.0
    assert floor_of(np.zeros((50, 2)), rng.uniform(0.1, 1.0, 50)) == 0.0


def test_views_that_claim_too_much_do_not_decide():
    """A detector that states a hundredth of a pixel for some views and half a pixel for others."""
    scene, z, claimed = world(n=12, seed=51), [], []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        views = [
            View(v.name, SIZE, v.points, v.pixels, v.ids, 0.01 if i % 4 == 0 else 0.4)
            for i, v in enumerate(scene.views(rng, sigma_px=0.05))
        ]
        found = calibrate(views)
        claimed.append(found.floor_px)
        z.append((found.camera.parameters - scene.camera.parameters) / found.std)
        assert found.outlier_views == ()
        assert found.rms_px == pytest.approx(0.05 * np.sqrt(2), rel=0.1)
    assert min(claimed) > 0.2
    assert 0.6 < np.sqrt(np.mean(np.square(z))) < 1.4
    assert leave_one_out(found).train_rms_px == pytest.approx(found.rms_px)
