"""Networks that the tests write: the file's outside, every family of outputs, and pictures end to end."""

import numpy as np
import pytest
from onnx_worlds import NAMES, SIZE, colour_detector, colour_instances, colour_segmenter, constant, scene

from sequential.errors import DataError, FileFormatError, ShapeError
from vision3d.objects import (
    ObjectNetwork,
    Preparation,
    candidates,
    class_scores,
    guess_layout,
    iou,
)


@pytest.mark.parametrize("rows_first", [False, True])
@pytest.mark.parametrize("shape", [(120, 200), (200, 120), (64, 64), (60, 150)])
def test_squares_are_found_end_to_end(tmp_path, rows_first, shape):
    network = ObjectNetwork(colour_detector(tmp_path / "net.onnx", rows_first=rows_first, notes=NAMES))
    image = np.full((*shape, 3), 20, np.uint8)
    side = min(shape) // 3
    left, top = shape[1] // 2, shape[0] // 3
    image[top : top + side, left : left + side] = (10, 10, 240)
    found = network.detect(image, least_score=0.2, most_overlap=0.3)
    assert len(found) >= 1
    assert {found.name(k) for k in range(len(found))} == {"red"}
    middle = (left + (side - 1) / 2, top + (side - 1) / 2)
    cell = max(shape) / SIZE * 8  # px of the image that a cell of the network sees
    assert np.hypot(*(found.centres[0] - middle)) < cell
    assert np.all(found.boxes[:, :2] + found.boxes[:, 2:] <= np.array(shape[::-1]) + 1e-9)


def test_both_classes_and_their_boxes(tmp_path):
    network = ObjectNetwork(colour_detector(tmp_path / "net.onnx", notes=NAMES))
    image, truth = scene()
    found = network.detect(image, least_score=0.3)
    assert {found.name(k) for k in range(len(found))} == {"red", "blue"}
    for name, box in truth.items():
        best = next(k for k in range(len(found)) if found.name(k) == name)
        assert iou(found.boxes[best], [box])[0, 0] > 0.35
    assert np.all(np.diff(found.scores) <= 0)
    mirrored = network.detect(np.ascontiguousarray(image[:, ::-1]), least_score=0.3)
    assert len(mirrored) == len(found)


def test_colours_in_the_network_s_order(tmp_path):
    path = colour_detector(tmp_path / "net.onnx", notes=NAMES)
    image, truth = scene()
    swapped = ObjectNetwork(path, preparation=Preparation(rgb=False)).detect(image, least_score=0.3)
    k = next(k for k in range(len(swapped)) if swapped.name(k) == "blue")
    assert iou(swapped.boxes[k], [truth["red"]])[0, 0] > 0.3


@pytest.mark.parametrize("softmax", [False, True])
@pytest.mark.parametrize("cells", [64, 16])
def test_classes_of_pixels(tmp_path, softmax, cells):
    path = colour_segmenter(tmp_path / "net.onnx", softmax=softmax, cells=cells)
    network = ObjectNetwork(path, names=("ground", "red", "blue"))
    image, truth = scene((128, 192))
    found = network.segment(image)
    assert found.labels.shape == image.shape[:2]
    for label, name in ((1, "red"), (2, "blue")):
        left, top, width, height = truth[name]
        painted = np.zeros(found.labels.shape, bool)
        painted[top : top + height, left : left + width] = True
        inside = found.mask(label)
        assert (inside & painted).sum() / (inside | painted).sum() > (0.9 if cells == 64 else 0.65)
        assert found.name(label) == name
    assert 0.3 < found.confidence.min() <= found.confidence.max() <= 1.0 + 1e-6
    assert not found.mask(1, least_confidence=1.1).any()


def some_boxes(rng, n=30):
    low = rng.random((n, 2)) * 40
    return np.column_stack([low, 5 + rng.random((n, 2)) * 15]), rng.random(n), rng.integers(0, 3, n)


def packed(layout, boxes, scores, labels):
    """The same boxes as each family writes them."""
    n = len(boxes)
    centres = np.column_stack([boxes[:, :2] + boxes[:, 2:] / 2, boxes[:, 2:]])
    corners = np.column_stack([boxes[:, :2], boxes[:, :2] + boxes[:, 2:]])
    each = np.zeros((n, 3))
    each[np.arange(n), labels] = scores
    match layout:
        case "yolo":
            return [np.column_stack([centres, each]).T[None]]
        case "yolov5":
            return [np.column_stack([centres, np.full(n, 0.5), 2 * each])[None]]
        case "final":
            return [np.column_stack([corners, scores, labels])[None]]
        case "ssd":
            return [np.column_stack([np.zeros(n), labels, scores, corners / SIZE])[None, None]]
    return [(corners / SIZE)[None], np.column_stack([np.zeros(n), each])[None]]


@pytest.mark.parametrize("layout", ["yolo", "yolov5", "final", "ssd", "ssd-pair"])
def test_every_family_says_the_same(tmp_path, layout, rng):
    boxes, scores, labels = some_boxes(rng)
    arrays = packed(layout, boxes, scores, labels)
    path = constant(tmp_path / "net.onnx", **{f"out{k}": array for k, array in enumerate(arrays)})
    network = ObjectNetwork(path)
    found = network.detect(np.zeros((SIZE, SIZE, 3), np.uint8), least_score=0.1, most_overlap=1.0)
    assert guess_layout([a.shape for a in arrays]) == layout
    order = np.argsort(-scores, kind="stable")
    order = order[scores[order] > 0.1]
    np.testing.assert_allclose(found.boxes, boxes[order], atol=1e-4)
    np.testing.assert_allclose(found.scores, scores[order], atol=1e-6)
    assert (found.labels - (layout == "ssd-pair")).tolist() == labels[order].tolist()


def test_the_end_of_a_list_and_numbers_that_are_none():
    rows = np.array([[[[0, 1, 0.9, 0, 0, 0.5, 0.5], [-1, 0, 0.8, 0, 0, 1, 1], [0, 1, np.nan, 0, 0, 1, 1]]]])
    found = candidates([rows], "ssd", (SIZE, SIZE), 0.1)
    assert found.boxes.tolist() == [[0.0, 0.0, 32.0, 32.0]]
    with pytest.raises(DataError, match="NaN"):
        class_scores([np.full((1, 2, 4, 4), np.nan, np.float32)])


@pytest.mark.parametrize(
    ("shapes", "layout"),
    [
        ([(1, 84, 8400)], "yolo"),
        ([(1, 25200, 85)], "yolov5"),
        ([(1, 25200, 6)], "yolov5"),
        ([(1, 300, 6)], "final"),
        ([(1, 1, 100, 7)], "ssd"),
        ([(1, 4420, 2), (1, 4420, 4)], "ssd-pair"),
        ([(1, 21, 128, 128)], "mask"),
        ([(1, 1, 128, 128)], "mask"),
    ],
)
def test_layouts_of_known_models(shapes, layout):
    assert guess_layout(shapes) == layout


@pytest.mark.parametrize("shapes", [[(1, 1000)], [(1, 3, 4), (1, 2, 4), (1, 5)], [], [(1, 4, 4)]])
def test_an_unknown_layout_is_said(shapes):
    with pytest.raises(ShapeError, match="no family"):
        guess_layout(shapes)


@pytest.mark.parametrize(
    ("layout", "shape", "words"),
    [
        ("yolo", (1, 4, 20), "another layout"),
        ("final", (2, 5, 6), "another layout"),
        ("ssd", (1, 6, 64), "another layout"),
        ("ssd-pair", (1, 5, 4), "shapes"),
        ("mask", (1, 2, 3, 3), "no boxes"),
    ],
)
def test_a_layout_that_does_not_fit_is_said(layout, shape, words):
    outputs = [np.zeros(shape, np.float32)] * (2 if layout == "ssd-pair" else 1)
    outputs = [outputs[0], np.zeros((1, 9, 3), np.float32)] if layout == "ssd-pair" else outputs
    with pytest.raises((ShapeError, DataError), match=words):
        candidates(outputs, layout, (SIZE, SIZE), 0.1)


def test_what_is_no_network_is_said(tmp_path, rng):
    whole = colour_detector(tmp_path / "net.onnx").read_bytes()
    texts = {
        "empty": b"",
        "text": b"not a network",
        "noise": rng.bytes(500),
        "cut off": whole[: len(whole) // 2],
    }
    for name, content in texts.items():
        path = tmp_path / f"{name}.onnx"
        path.write_bytes(content)
        with pytest.raises(FileFormatError):
            ObjectNetwork(path)
    with pytest.raises(OSError, match="nowhere"):
        ObjectNetwork(tmp_path / "nowhere.onnx")


def test_an_operation_that_opencv_lacks_is_said(tmp_path):
    import onnx

    path = colour_detector(tmp_path / "net.onnx")
    model = onnx.load(str(path))
    model.graph.node[0].op_type = "Mystery"
    onnx.save(model, str(path))
    with pytest.raises(FileFormatError, match="OpenCV"):
        ObjectNetwork(path)


def test_a_canvas_of_another_size_is_said(tmp_path):
    path = colour_detector(tmp_path / "net.onnx")
    network = ObjectNetwork(path, preparation=Preparation(size=(96, 96)))
    with pytest.raises(ShapeError, match="give its size"):
        network.detect(scene()[0])
    for wrong in ({"size": (0, 5)}, {"scale": 0.0}, {"deviation": (1.0, 0.0, 1.0)}):
        with pytest.raises(DataError):
            Preparation(**wrong)


@pytest.mark.parametrize("shape", [(64, 64), (120, 200), (200, 90)])
def test_a_mask_for_every_box(tmp_path, shape):
    network = ObjectNetwork(colour_instances(tmp_path / "net.onnx", notes=NAMES))
    image, truth = np.full((*shape, 3), 20, np.uint8), np.zeros(shape, bool)
    rows, columns = slice(shape[0] // 4, shape[0] // 2), slice(shape[1] // 4, shape[1] // 2)
    image[rows, columns], truth[rows, columns] = (10, 10, 240), True
    found = network.detect(image, least_score=0.3, most_overlap=0.1)
    assert found.masks.shape == (len(found), *shape)
    assert {found.name(k) for k in range(len(found))} == {"red"}
    outside = found.masks & ~truth
    assert outside.sum() < 0.3 * found.masks.sum(), "the mask follows the object, and not the box"
    left, top, width, height = found.boxes[0]
    y, x = np.nonzero(found.masks[0])
    assert x.min() >= left - 0.5
    assert x.max() <= left + width
    assert y.min() >= top - 0.5
    assert y.max() <= top + height
    assert found.masks[0].sum() > 0.4 * truth.sum()


def test_masks_that_do_not_fit_are_said(tmp_path):
    path = constant(tmp_path / "net.onnx", rows=np.full((1, 8, 50), 0.5), maps=np.zeros((1, 3, 8, 8)))
    with pytest.raises(ShapeError, match="coefficients"):
        ObjectNetwork(path, names=("one", "two")).detect(np.zeros((9, 9, 3), np.uint8))


def test_a_model_of_key_points_is_told_apart(tmp_path, rng):
    rows = np.vstack([np.full((4, 200), 20.0), np.full((1, 200), 0.9), rng.random((51, 200)) * 640])
    path = constant(tmp_path / "net.onnx", rows=rows[None])
    image = np.zeros((SIZE, SIZE, 3), np.uint8)
    with pytest.raises(ShapeError, match="names of its classes"):
        ObjectNetwork(path).detect(image)
    found = ObjectNetwork(path, names=("person",)).detect(image)
    assert len(found) == 1
    assert found.scores[0] == pytest.approx(0.9)
    assert found.masks is None
