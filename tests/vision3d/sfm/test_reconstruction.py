"""A reconstruction: its quantities, what it refuses, and COLMAP's objects there and back."""

import numpy as np
import pytest
from sfm_worlds import CAMERA, seen_cloud

from sequential.errors import ModelError, NotFiniteError, ShapeError
from vision3d.camera import Camera
from vision3d.sfm import from_pycolmap, to_pycolmap
from vision3d.sfm.noise import noise_of

LENSES = {
    "pinhole": (),
    "brown1": (-0.1,),
    "brown2": (-0.1, 0.02),
    "brown4": (-0.1, 0.02, 1e-3, -5e-4),
    "brown5": (-0.1, 0.02, 1e-3, -5e-4, 0.003),
    "rational8": (-0.1, 0.02, 1e-3, -5e-4, 0.003, 0.01, -0.002, 0.001),
    "fisheye4": (-0.03, 0.004, -0.001, 0.0002),
}


def test_residuals_of_the_truth_are_its_noise(rng):
    exact = seen_cloud(rng)
    assert np.abs(exact.residuals()).max() < 1e-9
    noisy = seen_cloud(rng, sigma_px=0.7)
    assert noisy.rms_px == pytest.approx(0.7 * np.sqrt(2.0), rel=0.1)
    assert noisy.track_lengths.min() >= 2
    assert noisy.track_lengths.sum() == noisy.observations_of.sum() == len(noisy.pixels)


@pytest.mark.parametrize("lens", LENSES)
def test_colmap_projects_alike_and_comes_back(lens, rng):
    camera = Camera(lens, (520.0, 523.0, 318.0, 241.0), LENSES[lens], (640, 480))
    found = seen_cloud(rng, sigma_px=0.5, camera=camera)
    theirs = to_pycolmap(found)
    assert theirs.compute_mean_reprojection_error() == pytest.approx(found.mean_error_px, rel=1e-9)
    back = from_pycolmap(theirs, lenses={1: lens})
    assert back.cameras[0].lens == lens
    np.testing.assert_allclose(back.cameras[0].parameters, camera.parameters, atol=1e-12)
    for name in ("cameras_T_world", "points", "colors", "image_index", "pixels"):
        np.testing.assert_allclose(_in_order(back, name), _in_order(found, name), atol=1e-12, err_msg=name)


def _in_order(found, name):
    """Observations by point and picture: COLMAP keeps no order of its own."""
    values = getattr(found, name)
    order = np.lexsort((found.image_index, found.point_index))
    return values[order] if len(values) == len(found.pixels) else values


def test_a_model_with_one_focal_length_stays_one(rng):
    found = seen_cloud(rng).replaced(models=("SIMPLE_RADIAL",))
    theirs = to_pycolmap(found)
    assert theirs.cameras[1].model_name == "SIMPLE_RADIAL"
    np.testing.assert_allclose(theirs.cameras[1].params, [520.0, 320.0, 240.0, -0.08])
    assert from_pycolmap(theirs).cameras == (CAMERA,)
    two = Camera("brown1", (520.0, 530.0, 319.5, 239.5), (-0.08,), (640, 480))
    with pytest.raises(ModelError, match="SIMPLE_RADIAL cannot say"):
        to_pycolmap(found.replaced(cameras=(two,)))


def test_a_selection_keeps_points_that_two_pictures_see(rng):
    found = seen_cloud(rng, sigma_px=0.3)
    few = found.selected(found.image_index < 2)
    assert (few.track_lengths == 2).all()
    assert set(few.image_index.tolist()) == {0, 1}
    kept = {tuple(point) for point in found.points}
    assert {tuple(point) for point in few.points} <= kept
    assert few.rms_px == pytest.approx(0.3 * np.sqrt(2.0), rel=0.2)


def test_noise_is_read_from_residuals_of_a_fit(rng):
    """Residuals of the truth have no unknowns fitted; the factor for them is the one of the formula."""
    found = seen_cloud(rng, views=12, count=300, sigma_px=0.4)
    equations = 2 * len(found.pixels)
    unknowns = 6 * 12 + 3 * len(found.points) - 7 + 2
    expected = 0.4 * np.sqrt(equations / (equations - unknowns))
    assert noise_of(found) == pytest.approx(expected, rel=0.03)


@pytest.mark.parametrize(
    ("changes", "error"),
    [
        ({"points": np.zeros((5, 3))}, ShapeError),
        ({"names": ("one",)}, ShapeError),
        ({"cameras_T_world": np.full((6, 7), np.nan)}, NotFiniteError),
        ({"camera_of": np.full(6, 3)}, ShapeError),
    ],
)
def test_what_does_not_go_together_is_refused(changes, error, rng):
    with pytest.raises(error):
        seen_cloud(rng).replaced(**changes)


def test_arrays_are_read_only(rng):
    found = seen_cloud(rng)
    with pytest.raises(ValueError, match="read-only"):
        found.points[0] = 0.0
