"""A second radial coefficient: taken where the truth has one, and only there."""

import numpy as np
import pytest
from sfm_worlds import seen_cloud

from vision3d.camera import Camera
from vision3d.sfm.lens_choice import with_second_coefficient
from vision3d.sfm.settling import adjusted

ONE = Camera("brown1", (520.0, 520.0, 319.5, 239.5), (-0.08,), (640, 480))
TWO = Camera("brown2", (520.0, 520.0, 319.5, 239.5), (-0.16, 0.12), (640, 480))
SOFT_PX = 0.9


def fitted(rng, camera):
    """What the adjustment with one coefficient makes of pixels of a camera, 0.3 px of noise."""
    seen = seen_cloud(rng, views=8, count=600, sigma_px=0.3, camera=camera, reach=2.2)
    start = seen.replaced(cameras=(ONE,), models=("SIMPLE_RADIAL",))
    return adjusted(start, soft_px=SOFT_PX)


def test_where_the_lens_has_two(rng):
    larger = with_second_coefficient(fitted(rng, TWO), SOFT_PX)
    assert larger is not None
    (camera,) = larger.cameras
    assert camera.lens == "brown2"
    assert larger.models == ("RADIAL",)
    np.testing.assert_allclose(camera.distortion, [-0.16, 0.12], atol=0.03)
    assert camera.intrinsics[0] == pytest.approx(520.0, rel=0.005)


def test_not_where_it_has_one(rng):
    for _ in range(10):
        assert with_second_coefficient(fitted(rng, ONE), SOFT_PX) is None


def test_not_where_there_is_little_to_see(rng):
    seen = seen_cloud(rng, views=3, count=60, sigma_px=0.3, camera=TWO)
    assert with_second_coefficient(seen.replaced(cameras=(ONE,)), SOFT_PX) is None
