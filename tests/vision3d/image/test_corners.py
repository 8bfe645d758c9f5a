"""Harris and Shi-Tomasi: OpenCV's scores and corners, and corners that are known."""

import cv2
import numpy as np
import pytest
from image_worlds import BACKENDS, BORDERS, noise

from sequential.errors import DataError
from vision3d.image import corners, gaussian_blur, harris
from vision3d.image.borders import cv2_border

SCORES = ("harris", "shi-tomasi")


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("score", SCORES)
@pytest.mark.parametrize(("block", "size"), [(2, 3), (3, 3), (5, 5), (2, 7)])
def test_scores_are_opencv_s(backend, score, block, size, rng):
    for image in (noise(rng), noise(rng, kind="float32") / 80):
        for border in BORDERS:
            if block % 2 == 0 and border in ("constant", "replicate"):
                continue  # there OpenCV goes by Intel's library, which lays even windows a pixel aside
            kind = cv2_border(border)
            theirs = (
                cv2.cornerHarris(image, block, size, 0.04, borderType=kind)
                if score == "harris"
                else cv2.cornerMinEigenVal(image, block, ksize=size, borderType=kind)
            )
            found = harris(image, block, size=size, score=score, border=border, backend=backend)
            np.testing.assert_allclose(found, theirs, rtol=0, atol=3e-6 * np.abs(theirs).max())


def in_order(points):
    return points[np.lexsort(points.T)]


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("score", SCORES)
@pytest.mark.parametrize(("most", "apart"), [(100, 10.0), (0, 3.0), (40, 0.0)])
def test_corners_of_photographs_are_opencv_s(backend, score, most, apart, data_dir):
    for name in ("building.jpg", "left01.jpg"):
        image = cv2.imread(str(data_dir / "vision" / "opencv" / name), cv2.IMREAD_GRAYSCALE)[
            :300, :400
        ].copy()
        theirs = cv2.goodFeaturesToTrack(image, most, 0.01, apart, useHarrisDetector=score == "harris")
        found = corners(image, most, min_distance_px=apart, score=score, backend=backend)
        # scores that differ in their last bit may stand in another order
        np.testing.assert_array_equal(in_order(found), in_order(theirs.reshape(-1, 2)))


@pytest.mark.parametrize("score", SCORES)
def test_the_corners_of_a_square(score):
    image = np.zeros((60, 70), np.uint8)
    image[20:41, 15:46] = 200
    found = corners(gaussian_blur(image, 1.0), score=score)
    expected = np.array([[15, 20], [45, 20], [15, 40], [45, 40]])
    assert len(found) == 4
    assert np.abs(in_order(found) - in_order(expected)).max() <= 1


def test_edges_and_plain_ground_are_none():
    step = np.zeros((40, 40), np.uint8)
    step[:, 20:] = 255
    assert harris(step)[5:-5, 5:-5].max() <= 1e-6 < -harris(step).min()
    assert len(corners(np.full((30, 30), 7, np.uint8))) == 0


def test_a_mask_and_the_best_first(rng):
    image = gaussian_blur(noise(rng, (80, 80)), 1.5)
    left = np.zeros(image.shape, bool)
    left[:, :40] = True
    found = corners(image, 20, mask=left)
    assert 5 < len(found) <= 20
    assert found[:, 0].max() < 40
    x, y = found.astype(int).T
    scores = harris(image, 3)[y, x]
    assert np.all(np.diff(scores) <= 0)
    assert len(corners(image, mask=np.zeros(image.shape))) == 0


def test_bad_arguments_are_said():
    image = np.zeros((9, 9), np.uint8)
    with pytest.raises(DataError, match="known are"):
        harris(image, score="fast")
    for wrong in ({"quality": 0.0}, {"min_distance_px": -1.0}):
        with pytest.raises(DataError, match="expected"):
            corners(image, **wrong)
