"""Finding markers: numbers, corners with an honest covariance, dictionaries told apart."""

import cv2
import numpy as np
import pytest
from marker_worlds import SIZE_M, corners_of, tilted

from sequential.errors import ModelError, ShapeError
from vision3d.camera import Camera
from vision3d.markers import detect_markers, find_markers
from vision3d.markers.dictionaries import DICTIONARIES, opencv_dictionary, smallest_of
from vision3d.render import Plane, marker_texture, render_planes


def drawn(name, identity, quad, size=(320, 240), oversample=8):
    """A marker whose corners lie exactly at `quad`, by area averaging of a large warped picture."""
    cells = DICTIONARIES[name].bits + 2
    bitmap = np.full((cells + 2, cells + 2), 255, np.uint8)
    bitmap[1:-1, 1:-1] = cv2.aruco.generateImageMarker(opencv_dictionary(name), identity, cells)
    scale = 32
    texture = np.kron(bitmap, np.ones((scale, scale), np.uint8))
    own = np.array([[1, 1], [cells + 1, 1], [cells + 1, cells + 1], [1, cells + 1]]) * scale - 0.5
    there = (np.asarray(quad) + 0.5) * oversample - 0.5
    H = cv2.getPerspectiveTransform(own.astype(np.float32), there.astype(np.float32))
    big = cv2.warpPerspective(texture, H, (size[0] * oversample, size[1] * oversample), borderValue=200)
    return cv2.resize(big, size, interpolation=cv2.INTER_AREA)


QUAD = np.array([[100.3, 60.7], [171.2, 66.1], [166.4, 131.8], [95.1, 127.4]])


@pytest.mark.parametrize(
    "name", ["4x4_50", "5x5_100", "6x6_250", "7x7_50", "apriltag_36h11", "apriltag_25h9"]
)
def test_finds_number_corners_and_dictionary(name, rng):
    identity = int(rng.integers(DICTIONARIES[name].count))
    picture = cv2.GaussianBlur(drawn(name, identity, QUAD), (0, 0), 0.7)
    (marker,) = detect_markers(picture, name)
    assert marker.id == identity
    assert marker.refined
    np.testing.assert_allclose(marker.corners, QUAD, atol=0.1)
    found, told = find_markers(picture)
    assert [one.id for one in found] == [identity]
    assert told.rsplit("_", 1)[0] == name.rsplit("_", 1)[0]


def test_nothing_is_found_in_nothing():
    empty = np.full((100, 120), 128, np.uint8)
    assert find_markers(empty) == ((), None)
    assert find_markers(empty, "4x4_50") == ((), "4x4_50")


def test_the_shortest_dictionary_is_named():
    assert smallest_of("6x6", 203) == "6x6_250"
    assert smallest_of("6x6", 49) == "6x6_50"
    assert smallest_of("apriltag_36h11", 3) == "apriltag_36h11"


def test_what_is_no_image_is_refused():
    with pytest.raises(ShapeError, match="uint8"):
        detect_markers(np.zeros((20, 20)), "4x4_50")
    with pytest.raises(ModelError, match="dictionary"):
        detect_markers(np.zeros((20, 20), np.uint8), "9x9_50")


def test_the_six_markers_of_the_tutorial(data_dir):
    picture = cv2.imread(str(data_dir / "vision/aruco/singlemarkersoriginal.jpg"))
    found, told = find_markers(picture)
    assert [one.id for one in found] == [23, 40, 62, 98, 124, 203]
    assert told == "6x6_250"


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("side_px", [40, 90])
def test_corners_meet_rendered_truth_with_an_honest_covariance(side_px, known, rng):
    """A lens that bends sides: the camera straightens them, or the covariance allows for it."""
    camera = Camera("brown5", (530, 531, 322, 240), (-0.28, 0.08, 1e-3, -2e-4, 0.02), (640, 480))
    errors, nees = [], []
    for identity in range(12):
        pose = tilted(side_px, 40.0 * rng.random(), rng, camera, at=rng.uniform(-0.3, 0.3, 2))
        picture = render_planes(camera, [Plane(pose, marker_texture("4x4_50", identity, SIZE_M))], rng=rng)
        (marker,) = detect_markers(picture, "4x4_50", camera=camera if known else None)
        assert marker.id == identity
        error = (marker.corners - corners_of(camera, pose)).ravel()
        errors.append(error)
        nees.append(error @ np.linalg.solve(marker.cov_px2, error) / 8.0)
    assert np.sqrt(np.mean(np.square(errors))) < 0.04
    assert 0.05 < np.mean(nees) < 1.5  # allows for ink, light and gamma, which the rendering has not
