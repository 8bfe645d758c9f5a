"""Components: flooding, union and OpenCV name the same pieces."""

import cv2
import numpy as np
import pytest
from image_worlds import blobs
from scipy import ndimage

from sequential.errors import DataError
from vision3d.image import connected_components

WAYS = ({"method": "union-find"}, {"method": "breadth-first"}, {"backend": "opencv"})


def masks(rng):
    y, x = np.mgrid[:60, :61]
    return {
        "nothing": np.zeros((7, 5), bool),
        "everything": np.ones((7, 5), bool),
        "one pixel": np.ones((1, 1), bool),
        "a chessboard": (x + y) % 2 == 0,
        "a comb": (x % 2 == 0) | (y == 59),  # many provisional labels that all unite at the end
        "a spiral": (np.hypot(x - 30, y - 30) + np.arctan2(y - 30, x - 30) * 2) % 12.566 < 6,
        "noise at the percolation threshold": rng.random((70, 90)) < 0.5927,
        "sparse noise": rng.random((70, 90)) < 0.2,
        "blobs": blobs(rng),
        "a row": rng.random((1, 40)) < 0.5,
        "a column": rng.random((40, 1)) < 0.5,
    }


@pytest.mark.parametrize("name", masks(np.random.default_rng(0)))
@pytest.mark.parametrize("connectivity", [4, 8])
@pytest.mark.parametrize("way", WAYS, ids=("union-find", "breadth-first", "opencv"))
def test_pieces_are_scipy_s_and_measures_opencv_s(name, connectivity, way, rng):
    mask = masks(rng)[name]
    found = connected_components(mask, connectivity=connectivity, **way)
    window = np.ones((3, 3)) if connectivity == 8 else None
    labels, count = ndimage.label(mask, window)  # it numbers first pixels in reading order too
    assert len(found) == count
    np.testing.assert_array_equal(found.labels, labels)
    _, theirs, stats, centroids = cv2.connectedComponentsWithStats(
        mask.astype(np.uint8), connectivity=connectivity
    )
    for k in range(count):
        other = theirs[found.mask(k)][0]
        assert found.areas[k] == stats[other, cv2.CC_STAT_AREA]
        assert found.boxes[k].tolist() == stats[other, :4].tolist()
        np.testing.assert_allclose(found.centroids[k], centroids[other], rtol=0, atol=1e-9)


def test_order_by_area(rng):
    found = connected_components(blobs(rng))
    assert np.all(np.diff(found.areas[found.by_area()]) <= 0)
    assert found.areas.sum() == np.count_nonzero(found.labels)
    with pytest.raises(ValueError, match="read-only"):
        found.labels[0, 0] = 3


def test_bad_arguments_are_said():
    with pytest.raises(DataError, match="4 or 8"):
        connected_components(np.ones((3, 3)), connectivity=6)
    with pytest.raises(DataError, match="known are"):
        connected_components(np.ones((3, 3)), method="recursive")
