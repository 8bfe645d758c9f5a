"""Five photographs of a villa, with the result of another program beside them."""

import numpy as np
import pytest

from vision3d.sfm import reconstruct
from vision3d.sfm.geometry import triangulation_angles

FOCAL_BUNDLER = 518.69


@pytest.fixture(scope="module")
def model(data_dir):
    return reconstruct(data_dir / "vision" / "balbianello")


def test_every_picture_has_its_place(model):
    assert len(model) == 5
    assert not model.missing
    assert model.mean_error_px < 0.22
    assert len(model.points) > 480


def test_the_focal_length_is_near_the_one_of_bundler(model):
    (camera,) = model.cameras
    assert camera.lens == "brown2", "a second coefficient takes 15 % off the error"
    assert camera.intrinsics[0] == pytest.approx(FOCAL_BUNDLER, rel=0.03)


def test_loops_close_and_rays_cross(model):
    assert np.degrees(np.median(model.graph.loops().errors_rad)) < 1.0
    assert np.degrees(np.median(triangulation_angles(model))) > 10.0


@pytest.mark.parametrize("changes", [{}, {"threads": 1}])
def test_a_second_run_gives_the_same(model, data_dir, changes):
    again = reconstruct(data_dir / "vision" / "balbianello", **changes)
    np.testing.assert_array_equal(again.points, model.points)
    np.testing.assert_array_equal(again.cameras_T_world, model.cameras_T_world)


def test_the_global_mapper_agrees(model, data_dir):
    whole = reconstruct(data_dir / "vision" / "balbianello", mapper="global")
    assert len(whole) == 5
    assert whole.mean_error_px < 0.26
    assert whole.cameras[0].intrinsics[0] == pytest.approx(model.cameras[0].intrinsics[0], rel=5e-3)
