"""Overlap and suppression: OpenCV's answers, and laws."""

import cv2
import numpy as np
import pytest

from sequential.errors import DataError, NotFiniteError, ShapeError
from vision3d.objects import Detections, iou, non_maximum_suppression

LIMITS = [(0.0, 0.5), (0.25, 0.45), (0.5, 0.1), (0.3, 0.0), (0.3, 1.0)]


def crowd(rng, n, whole):
    """Boxes in heaps; on whole pixels and tenths, so that many are equal."""
    boxes = np.column_stack([rng.random((n, 2)) * 80, 1 + rng.random((n, 2)) * 40])
    scores = rng.random(n)
    return (np.floor(boxes), np.round(scores, 1)) if whole else (boxes, scores.astype(np.float32))


@pytest.mark.parametrize("n", [0, 1, 5, 200])
@pytest.mark.parametrize("whole", [False, True])
@pytest.mark.parametrize(("least", "overlap"), LIMITS)
def test_suppression_is_opencv_s(n, whole, least, overlap, rng):
    for _ in range(10):
        boxes, scores = crowd(rng, n, whole)
        kept = non_maximum_suppression(boxes, scores, least_score=least, most_overlap=overlap)
        theirs = cv2.dnn.NMSBoxes(boxes.tolist(), scores.tolist(), least, overlap)
        assert kept.tolist() == np.asarray(theirs).ravel().tolist()


@pytest.mark.parametrize(("least", "overlap"), LIMITS)
def test_classes_do_not_suppress_each_other(least, overlap, rng):
    boxes, scores = crowd(rng, 150, whole=False)
    labels = rng.integers(0, 3, 150)
    kept = non_maximum_suppression(boxes, scores, labels=labels, least_score=least, most_overlap=overlap)
    theirs = cv2.dnn.NMSBoxesBatched(boxes.tolist(), scores.tolist(), labels.tolist(), least, overlap)
    assert sorted(kept) == sorted(np.asarray(theirs).ravel())
    assert np.all(np.diff(scores[kept]) <= 0)


def test_laws_of_suppression(rng):
    boxes, scores = crowd(rng, 100, whole=False)
    kept = non_maximum_suppression(boxes, scores, least_score=0.1, most_overlap=0.4)
    table = iou(boxes[kept], boxes[kept]) - np.eye(len(kept))
    assert table.max() <= 0.4
    lost = np.setdiff1d(np.flatnonzero(scores > 0.1), kept)
    covered = (iou(boxes[lost], boxes[kept]) > 0.4) & (scores[kept] >= scores[lost][:, None])
    assert covered.any(axis=1).all()
    again = non_maximum_suppression(boxes[kept], scores[kept], least_score=0.1, most_overlap=0.4)
    assert again.tolist() == list(range(len(kept)))
    assert len(non_maximum_suppression(boxes, scores, least_score=0.1, most=3)) == 3


def test_overlap():
    a = [[0, 0, 10, 10]]
    others = [[0, 0, 10, 10], [5, 0, 10, 10], [10, 0, 5, 5], [2, 2, 5, 5], [30, 30, 0, 0]]
    np.testing.assert_allclose(iou(a, others), [[1.0, 1 / 3, 0.0, 0.25, 0.0]])
    assert iou([[1, 1, 0, 0]], [[5, 5, 0, 0]]) == 1.0
    assert iou(np.zeros((0, 4)), a).shape == (0, 1)


def test_overlap_of_whole_boxes_is_that_of_their_pixels(rng):
    def painted(box):
        left, top, width, height = box.astype(int)
        image = np.zeros((60, 60), bool)
        image[top : top + height, left : left + width] = True
        return image

    for _ in range(30):
        pair = np.column_stack([rng.integers(0, 30, (2, 2)), rng.integers(1, 30, (2, 2))]).astype(float)
        a, b = (painted(one) for one in pair)
        assert iou(pair[:1], pair[1:])[0, 0] == pytest.approx((a & b).sum() / (a | b).sum())


def test_names_and_centres():
    found = Detections(np.array([[2.0, 3.0, 4.0, 5.0]]), np.array([0.9]), np.array([1]), ("cat", "dog"))
    assert found.name(0) == "dog"
    assert found.centres.tolist() == [[3.5, 5.0]]
    assert Detections(found.boxes, found.scores, np.array([7])).name(0) == "class 7"


@pytest.mark.parametrize(
    ("boxes", "scores", "error", "words"),
    [
        (np.zeros((3, 5)), np.zeros(3), ShapeError, "left, top"),
        (np.zeros((3, 4)), np.zeros(2), ShapeError, "one for each"),
        (np.full((1, 4), np.nan), np.zeros(1), NotFiniteError, "NaN"),
        (np.zeros((1, 4)), np.array([np.nan]), NotFiniteError, "NaN"),
        (np.array([[5.0, 5.0, -2.0, 1.0]]), np.zeros(1), DataError, "corners"),
    ],
)
def test_bad_boxes_are_said(boxes, scores, error, words):
    with pytest.raises(error, match=words):
        non_maximum_suppression(boxes, scores)


def test_bad_limits_are_said():
    with pytest.raises(DataError, match="0 to 1"):
        non_maximum_suppression(np.zeros((1, 4)), np.zeros(1), most_overlap=2.0)
    with pytest.raises(ShapeError, match="labels"):
        non_maximum_suppression(np.zeros((1, 4)), np.zeros(1), labels=[1, 2])
