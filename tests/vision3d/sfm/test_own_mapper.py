"""Our own mapper through the same door as COLMAP's: pictures in, a model and what is missing out."""

import numpy as np
import pytest

from vision3d.camera import Camera
from vision3d.render import desk, orbit_poses, render_journey
from vision3d.sfm import NoModelError, reconstruct

CAMERA = Camera("brown1", (290.0, 290.0, 119.5, 89.5), (-0.08,), (240, 180))


@pytest.fixture(scope="module")
def pictures():
    rng = np.random.default_rng(4)
    views = render_journey(CAMERA, orbit_poses([0.0, 0.0, 2.0], 2.0, 4, arc_rad=0.6), desk(rng), rng=rng)
    return {f"{k}.png": np.dstack([view.image] * 3) for k, view in enumerate(views)}


def test_pictures_become_a_model(pictures, rng):
    noise = rng.integers(0, 255, (180, 240, 3), dtype=np.uint8)
    found = reconstruct(pictures | {"noise.png": noise}, mapper="own", camera=CAMERA, max_size=240)
    assert found.names == tuple(pictures)
    assert found.cameras == (CAMERA,)
    assert found.rms_px < 0.5
    assert [name for name, _ in found.missing] == ["noise.png"]
    assert "overlaps no other picture" in found.missing[0][1]
    assert found.graph.names == (*pictures, "noise.png")


def test_an_unknown_camera_is_calibrated(pictures):
    found = reconstruct(pictures, mapper="own", max_size=240)
    assert found.names == tuple(pictures)
    assert found.cameras[0].intrinsics[0] == pytest.approx(290.0, rel=0.05)


def test_pictures_of_nothing_in_common_give_none(rng):
    strangers = {f"{k}.png": rng.integers(0, 255, (120, 160, 3), dtype=np.uint8) for k in range(3)}
    with pytest.raises(NoModelError) as told:
        reconstruct(strangers, mapper="own")
    assert len(told.value.missing) == 3


def test_balbianello(data_dir):
    found = reconstruct(data_dir / "vision" / "balbianello", mapper="own")
    assert len(found) == 5
    assert found.mean_error_px < 0.26
    # Bundler's file has 518.7, COLMAP finds 526.5
    assert found.cameras[0].intrinsics[0] == pytest.approx(523.0, abs=10.0)
